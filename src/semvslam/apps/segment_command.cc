#include <fmt/core.h>

#include <CLI/CLI.hpp>
#include <filesystem>
#include <memory>
#include <string>
#include <vector>

#include "semvslam/apps/command.h"
#include "semvslam/apps/segmenter_options.h"
#include "semvslam/data/file_io.h"
#include "semvslam/semantic/segmentation_files.h"

namespace semvslam {
namespace {

struct SegmentArguments {
  std::vector<std::string> images;
  std::string out;
  SegmenterOptions options;
};

Result<int> run_segment(const SegmentArguments& a) {
  StageTimers timers;
  Result<std::unique_ptr<Segmenter>> segmenter = make_segmenter(a.options, RoleTable(), &timers);
  if (!segmenter) return segmenter.error();
  if (!a.out.empty())
    if (const Status status = make_folder(a.out); !status) return status.error();
  StageTimer& whole = timers["whole"];
  for (const std::string& file : a.images) {
    const Result<cv::Mat> image = read_picture(file);
    if (!image) return image.error();
    Result<Segmentation> found = [&] {
      const auto lap = whole.time();
      return (*segmenter)->segment({FrameId(0), TimeStamp{}, *image, std::filesystem::path(file).filename().string()});
    }();
    if (!found) return Error{found.error().code, fmt::format("{}: {}", file, found.error().message)};
    fmt::print("{}:", file);
    for (const Instance& i : found->instances) fmt::print(" {} {:.2f}", i.class_name, i.score);
    fmt::print("\n");
    if (!a.out.empty())
      if (const Status s = write_segmentation(a.out, std::filesystem::path(file).stem().string(), *image, *found); !s)
        return s.error();
  }
  const StageSummary time = whole.summary();
  fmt::print("{}; {} images, {:.1f} ms each (median)\n", (*segmenter)->description(), time.count, time.median_ms);
  return static_cast<int>(kExitSuccess);
}

}  // namespace

CommandHandler setup_segment(CLI::App& parser) {
  auto a = std::make_shared<SegmentArguments>();
  parser.add_option("IMAGE", a->images, "pictures to segment")->required();
  parser.add_option("--out", a->out, "folder for overlays, instance images (PNG) and JSON");
  a->options.score = Segmenter::kLeastScoreOfStills;
  parser.add_option("--score", a->options.score, "least score of an object")
      ->capture_default_str()
      ->check(CLI::Range(0.01, 1.0));
  add_segmenter_options(parser, a->options);
  return [a] { return run_segment(*a); };
}

}  // namespace semvslam
