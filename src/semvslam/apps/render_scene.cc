#include "semvslam/apps/render_scene.h"

#include <fmt/core.h>

#include <charconv>
#include <nlohmann/json.hpp>
#include <system_error>

#include "semvslam/apps/interrupt.h"
#include "semvslam/apps/progress.h"
#include "semvslam/data/file_io.h"
#include "semvslam/data/sequence_writer.h"

namespace semvslam {
namespace fs = std::filesystem;

namespace {

std::string format_roles(const std::vector<SceneRole>& roles) {
  nlohmann::ordered_json json = nlohmann::ordered_json::array();
  for (std::size_t i = 0; i < roles.size(); ++i)
    json.push_back({{"number", i + 1}, {"actor", roles[i].name}, {"label", roles[i].kind}, {"moves", roles[i].moves}});
  return json.dump(2) + "\n";
}

Status render_frames(RenderedScene& scene, const fs::path& folder, bool jpeg, bool quiet) {
  SequenceWriterOptions writer_options;
  writer_options.jpeg = jpeg;
  Result<SequenceWriter> writer = SequenceWriter::create(folder, scene.camera(), writer_options);
  if (!writer) return writer.error();
  const InterruptGuard interrupt;
  const auto count = static_cast<std::size_t>(scene.options().frames);
  Progress progress(count, quiet);
  for (std::size_t i = 0; i < count; ++i) {
    if (InterruptGuard::received() != 0)
      return Error{ErrorCode::kIo, fmt::format("interrupted after {} of {} frames", i, count)};
    RenderedFrame rendered = scene.render(i);
    rendered.frame.mask = rendered.instances;
    if (rendered.frame.depth.type() == CV_32FC1) {  // the exact picture
      cv::Mat units;
      rendered.frame.depth.convertTo(units, CV_16UC1, scene.camera().depth_units_per_m);
      rendered.frame.depth = units;
    }
    if (Status status = writer->write(rendered.frame, rendered.world_from_camera); !status) return status;
    progress.update(i + 1, "rendering");
  }
  return write_file_atomically(folder / "roles.json", format_roles(scene.roles()));
}

}  // namespace

bool parse_size(const std::string& text, int& width_px, int& height_px) {
  const auto x = text.find('x');
  if (x == std::string::npos) return false;
  const char* end = text.data() + text.size();
  const auto first = std::from_chars(text.data(), text.data() + x, width_px);
  const auto second = std::from_chars(text.data() + x + 1, end, height_px);
  return first.ec == std::errc() && first.ptr == text.data() + x && second.ec == std::errc() && second.ptr == end;
}

Status render_to_folder(const SceneOptions& options, const fs::path& folder, bool jpeg, bool quiet) {
  if (fs::exists(folder))
    return Error{ErrorCode::kInvalidInput,
                 fmt::format("{} exists already; remove it or choose another folder", folder.string())};
  Result<RenderedScene> scene = RenderedScene::create(options);
  if (!scene) return scene.error();
  fs::path unfinished = folder;
  if (unfinished.filename().empty()) unfinished = unfinished.parent_path();  // a final slash
  unfinished += ".part";
  std::error_code code;
  fs::remove_all(unfinished, code);
  Status status = render_frames(*scene, unfinished, jpeg, quiet);
  if (status) {
    fs::rename(unfinished, folder, code);
    if (code)
      status = Error{ErrorCode::kIo, fmt::format("{}: cannot be named so ({})", folder.string(), code.message())};
  }
  if (!status) fs::remove_all(unfinished, code);
  return status;
}

}  // namespace semvslam
