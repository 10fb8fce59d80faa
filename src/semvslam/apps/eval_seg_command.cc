#include <fmt/core.h>

#include <CLI/CLI.hpp>
#include <filesystem>
#include <memory>
#include <nlohmann/json.hpp>
#include <string>

#include "semvslam/apps/command.h"
#include "semvslam/apps/segmenter_options.h"
#include "semvslam/semantic/segmentation_files.h"
#include "semvslam/semantic/segmentation_score.h"

namespace semvslam {
namespace {

constexpr double kLeastScore = 0.02;  // average precision wants the unsure ones too

struct EvalSegArguments {
  std::string labels, images, json;
  double sure = Segmenter::kLeastScoreOfStills;
  SegmenterOptions options;
};

nlohmann::json as_json(const SegmentationScore& s, const StageSummary& time, const Segmenter& segmenter) {
  return {{"model", segmenter.description()},
          {"gflops", segmenter.gflops()},
          {"images", s.images},
          {"person_pixel_iou", s.person_pixel_iou},
          {"person_pixel_recall", s.person_pixel_recall},
          {"person_pixel_precision", s.person_pixel_precision},
          {"person_mask_ap", s.person_mask_ap},
          {"person_mask_ap50", s.person_mask_ap50},
          {"mask_ap", s.mask_ap},
          {"mask_ap50", s.mask_ap50},
          {"near_persons", s.near_persons},
          {"near_person_recall", s.near_person_recall},
          {"near_person_mean_iou", s.near_person_mean_iou},
          {"ms_mean", time.mean_ms},
          {"ms_median", time.median_ms},
          {"ms_p95", time.p95_ms}};
}

Result<int> run_eval_seg(EvalSegArguments a) {
  const Result<CocoDataset> dataset = CocoDataset::read(a.labels);
  if (!dataset) return dataset.error();
  a.options.score = kLeastScore;
  const Result<std::unique_ptr<Segmenter>> segmenter = make_segmenter(a.options, RoleTable());
  if (!segmenter) return segmenter.error();
  SegmentationScorer scorer(*dataset, a.sure);
  StageTimer timer("segment");
  for (const CocoImage& image : dataset->images) {
    const std::filesystem::path file = std::filesystem::path(a.images) / image.file;
    const Result<cv::Mat> picture = read_picture(file);
    if (!picture) return picture.error();
    if (picture->size() != image.size)
      return Error{ErrorCode::kInvalidInput, fmt::format("{}: its size is not the one in {}", file.string(), a.labels)};
    const Result<Segmentation> found = [&] {
      const auto lap = timer.time();
      return (*segmenter)->segment({FrameId(0), TimeStamp{}, *picture, image.file});
    }();
    if (!found) return Error{found.error().code, fmt::format("{}: {}", file.string(), found.error().message)};
    scorer.add(image, *found);
  }
  const SegmentationScore s = scorer.score();
  const StageSummary time = timer.summary();
  if (a.json != "-") {
    fmt::print("{}, {} images\n", (*segmenter)->description(), s.images);
    fmt::print("person pixels (score >= {:.2f}): IoU {:.3f}, recall {:.3f}, precision {:.3f}\n", a.sure,
               s.person_pixel_iou, s.person_pixel_recall, s.person_pixel_precision);
    fmt::print("person masks: AP50 {:.3f}, AP {:.3f}; all classes: AP50 {:.3f}, AP {:.3f}\n", s.person_mask_ap50,
               s.person_mask_ap, s.mask_ap50, s.mask_ap);
    fmt::print("{} persons above 96x96 px: {:.3f} found, mean IoU of the found {:.3f}\n", s.near_persons,
               s.near_person_recall, s.near_person_mean_iou);
    fmt::print("ms per image, unsure objects included: mean {:.1f}, median {:.1f}, p95 {:.1f}\n", time.mean_ms,
               time.median_ms, time.p95_ms);
    if (const double g = (*segmenter)->gflops(); g > 0)
      fmt::print("GFLOPs per image with {} proposals and {} masks (two operations a multiply-add): {:.2f}\n",
                 Segmenter::kCostProposals, Segmenter::kCostMasks, g);
  }
  if (a.json.empty()) return static_cast<int>(kExitSuccess);
  if (const Status status = write_report(a.json, as_json(s, time, **segmenter).dump(1) + "\n"); !status)
    return status.error();
  return static_cast<int>(kExitSuccess);
}

}  // namespace

CommandHandler setup_eval_seg(CLI::App& parser) {
  auto a = std::make_shared<EvalSegArguments>();
  parser.add_option("COCO_JSON", a->labels, "labels in the format of the COCO data set")->required();
  parser.add_option("IMAGES", a->images, "folder that the labels' file names are relative to")->required();
  parser.add_option("--sure", a->sure, "least score of an instance for the pixel numbers")
      ->capture_default_str()
      ->check(CLI::Range(0.0, 1.0));
  parser.add_option("--json", a->json, "write all numbers to this file (- = standard output, alone)");
  add_segmenter_options(parser, a->options);
  return [a] { return run_eval_seg(*a); };
}

}  // namespace semvslam
