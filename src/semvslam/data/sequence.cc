#include "semvslam/data/sequence.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "semvslam/data/camera_file.h"
#include "semvslam/data/file_io.h"
#include "semvslam/data/image_decode.h"
#include "semvslam/data/sequence_layout.h"
#include "semvslam/data/trajectory_io.h"

namespace semvslam {
namespace {

namespace fs = std::filesystem;

constexpr double kIclFrameRateHz = 30;

std::string join(const std::vector<std::string>& words) {
  std::string text;
  for (const std::string& word : words) text += (text.empty() ? "" : ", ") + word;
  return text;
}

std::string folder_name(const fs::path& folder) {
  std::error_code error;
  const fs::path canonical = fs::canonical(folder, error);
  return (error ? folder : canonical).filename().string();
}

struct NamedCamera {
  Camera camera;
  std::string origin;  // for description()
};

Result<NamedCamera> preset_camera(const std::string& preset) {
  const Result<Camera> camera = camera_preset(preset);
  if (!camera) return camera.error();
  return NamedCamera{*camera, "built-in " + preset};
}

Result<NamedCamera> file_camera(const fs::path& file) {
  const Result<Camera> camera = read_camera(file);
  if (!camera) return camera.error();
  return NamedCamera{*camera, file.string()};
}

Result<NamedCamera> find_camera(const fs::path& folder, const SequenceOptions& options, SequenceKind kind) {
  if (!options.camera_file.empty()) return file_camera(options.camera_file);
  if (!options.camera_preset.empty()) return preset_camera(options.camera_preset);
  std::error_code error;
  if (fs::exists(folder / "camera.yaml", error)) return file_camera(folder / "camera.yaml");
  if (const std::string preset = camera_preset_of_folder(folder_name(folder)); !preset.empty())
    return preset_camera(preset);
  if (kind == SequenceKind::kIclNuim) return preset_camera("icl");
  return Error{ErrorCode::kNotFound,
               fmt::format("{}: no camera: put a camera.yaml there, give a camera file, or name a built-in camera ({})",
                           folder.string(), join(camera_preset_names()))};
}

/// A recording on disk; reads and decodes in next().
class RecordedSequence final : public FrameSource {
 public:
  RecordedSequence(fs::path folder, SequenceLayout layout, NamedCamera camera, bool want_colour, fs::path mask_folder)
      : folder_(std::move(folder)),
        layout_(std::move(layout)),
        camera_(std::move(camera)),
        want_colour_(want_colour),
        mask_folder_(std::move(mask_folder)),
        decoder_(cv::Size(camera_.camera.width_px, camera_.camera.height_px)) {}

  Result<std::optional<RgbdFrame>> next() override {
    if (index_ >= layout_.pairs.pairs.size()) return std::optional<RgbdFrame>();
    const std::size_t index = index_++;
    Result<RgbdFrame> frame = load(index);
    if (!frame) return Error{frame.error().code, fmt::format("frame {}: {}", index, frame.error().message)};
    return std::optional<RgbdFrame>(std::move(*frame));
  }

  const Camera& camera() const override { return camera_.camera; }
  std::optional<std::size_t> size() const override { return layout_.pairs.pairs.size(); }

  std::string description() const override {
    const PairList& pairs = layout_.pairs;
    std::string text =
        fmt::format("{} ({}, {} frames {}x{}, camera {}", folder_.string(), layout_.kind_name(), pairs.pairs.size(),
                    camera_.camera.width_px, camera_.camera.height_px, camera_.origin);
    if (pairs.colour_without_depth > 0)
      text += fmt::format(", {} colour images without depth", pairs.colour_without_depth);
    if (!layout_.warnings.empty()) text += "; " + join(layout_.warnings);
    return text + ")";
  }

  Result<RgbdFrame> load(std::size_t index) {
    const ImagePair& pair = layout_.pairs.pairs[index];
    RgbdFrame frame;
    frame.id = FrameId(static_cast<std::uint32_t>(index));
    frame.stamp = pair.stamp;
    const auto decode = [&](const fs::path& path, auto decoding) -> Status {
      if (Status s = read_binary_file(path, bytes_); !s) return s;
      Status s = decoding(bytes_);
      if (!s) return Error{s.error().code, path.string() + ": " + s.error().message};
      return s;
    };
    if (Status s = decode(
            folder_ / pair.colour_file,
            [&](ByteSpan b) { return decoder_.colour_image(b, frame.gray, want_colour_ ? &frame.colour : nullptr); });
        !s)
      return s.error();
    if (Status s = decode(folder_ / pair.depth_file, [&](ByteSpan b) { return decoder_.depth_image(b, frame.depth); });
        !s)
      return s.error();
    if (mask_folder_.empty()) return frame;
    const fs::path mask = mask_path(pair);
    std::error_code error;
    if (!fs::exists(mask, error)) return frame;  // unknown for this frame
    if (Status s = decode(mask, [&](ByteSpan b) { return decoder_.label_image(b, frame.mask); }); !s) return s.error();
    return frame;
  }

  /// Whether anything can be read at all: the first frame, or else one of two others.
  Status probe() {
    const std::size_t count = layout_.pairs.pairs.size();
    const Result<RgbdFrame> first = load(0);
    if (first || load(count / 2) || load(count - 1)) return Status::success();
    return first.error();
  }

  std::size_t masks_missing() const {
    std::error_code error;
    const std::vector<ImagePair>& pairs = layout_.pairs.pairs;
    return static_cast<std::size_t>(std::count_if(
        pairs.begin(), pairs.end(), [&](const ImagePair& pair) { return !fs::exists(mask_path(pair), error); }));
  }

  const SequenceLayout& layout() const { return layout_; }

 private:
  fs::path mask_path(const ImagePair& pair) const {
    return mask_folder_ / (fs::path(pair.colour_file).stem().string() + ".png");
  }

  fs::path folder_;
  SequenceLayout layout_;
  NamedCamera camera_;
  bool want_colour_;
  fs::path mask_folder_;
  ImageDecoder decoder_;
  std::vector<std::uint8_t> bytes_;
  std::size_t index_ = 0;
};

std::string left_out(std::size_t count, const char* kind, const char* other) {
  return fmt::format("{} {} {} no {} image and {} left out", count, kind, count == 1 ? "image has" : "images have",
                     other, count == 1 ? "is" : "are");
}

void tell_warnings(const RecordedSequence& sequence, const fs::path& folder, std::size_t masks_missing,
                   const std::function<void(const std::string&)>& tell) {
  if (!tell) return;
  const PairList& pairs = sequence.layout().pairs;
  const auto say = [&](const std::string& what) { tell(folder.string() + ": " + what); };
  for (const std::string& warning : sequence.layout().warnings) say(warning);
  if (pairs.colour_without_depth > 0) say(left_out(pairs.colour_without_depth, "colour", "depth"));
  if (pairs.depth_without_colour > 0) say(left_out(pairs.depth_without_colour, "depth", "colour"));
  if (masks_missing > 0) say(fmt::format("no mask for {} of {} frames", masks_missing, pairs.pairs.size()));
}

bool is_icl_name(const fs::path& file) { return file.filename().string().ends_with(".gt.freiburg"); }

fs::path ground_truth_file(const fs::path& folder) {
  std::error_code error;
  const fs::path usual = folder / "groundtruth.txt";
  if (fs::exists(usual, error)) return usual;
  for (fs::directory_iterator it(folder, error), end; !error && it != end; it.increment(error))
    if (is_icl_name(it->path())) return it->path();
  return usual;
}

bool has_frame_numbers(const Trajectory& trajectory) {
  return std::all_of(trajectory.begin(), trajectory.end(),
                     [](const StampedPose& p) { return p.stamp.ns % 1000000000 == 0; });
}

bool is_icl_folder(const fs::path& folder) {
  const Result<SequenceLayout> layout = detect_layout(folder, 0);
  return layout && layout->kind == SequenceKind::kIclNuim;
}

/// With S = diag(1, -1, 1) a pose (R, t) of their frames becomes (S R S, S t) of ours.
void mirror_icl(Trajectory& trajectory) {
  for (StampedPose& pose : trajectory) {
    const Eigen::Vector3d& t = pose.world_from_camera.translation();
    const Eigen::Quaterniond& q = pose.world_from_camera.rotation();
    pose.stamp.ns = std::llround(static_cast<long double>(pose.stamp.ns) / kIclFrameRateHz);
    pose.world_from_camera = SE3(Eigen::Quaterniond(q.w(), -q.x(), q.y(), -q.z()), {t.x(), -t.y(), t.z()});
  }
}

}  // namespace

Result<fs::path> find_folder(const fs::path& recording, const std::string& name) {
  std::error_code error;
  for (const fs::path& candidate : {fs::path(name), recording / name})
    if (fs::is_directory(candidate, error)) return candidate;
  return Error{ErrorCode::kNotFound,
               fmt::format("{}: no such folder, neither here nor in {}", name, recording.string())};
}

Result<std::unique_ptr<FrameSource>> open_sequence(const fs::path& folder, const SequenceOptions& options) {
  Result<SequenceLayout> layout = detect_layout(folder, options.max_association_gap_s);
  if (!layout) return layout.error();
  const Result<NamedCamera> camera = find_camera(folder, options, layout->kind);
  if (!camera) return camera.error();
  scale_stamps(*layout, camera->camera.frame_rate_hz);
  Result<fs::path> masks = fs::path();
  if (!options.mask_folder.empty()) masks = find_folder(folder, options.mask_folder);
  if (!masks) return masks.error();
  auto sequence = std::make_unique<RecordedSequence>(folder, std::move(*layout), *camera, options.want_colour, *masks);
  if (Status s = sequence->probe(); !s) return s.error();
  const std::size_t masks_missing = masks->empty() ? 0 : sequence->masks_missing();
  if (masks_missing == sequence->size())
    return Error{ErrorCode::kNotFound,
                 fmt::format("{}: no mask is named like a colour image of the sequence", masks->string())};
  tell_warnings(*sequence, folder, masks_missing, options.on_warning);
  return std::unique_ptr<FrameSource>(std::move(sequence));
}

Result<std::optional<RgbdFrame>> next_readable(FrameSource& source) {
  for (;;)
    if (Result<std::optional<RgbdFrame>> next = source.next(); next || source.fatal()) return next;
}

Result<Trajectory> read_ground_truth(const fs::path& path) {
  std::error_code error;
  const bool is_folder = fs::is_directory(path, error);
  const fs::path file = is_folder ? ground_truth_file(path) : path;
  Result<Trajectory> trajectory = read_trajectory(file);
  if (!trajectory) return trajectory;
  if (is_icl_name(file) || (is_folder && has_frame_numbers(*trajectory) && is_icl_folder(path)))
    mirror_icl(*trajectory);
  return trajectory;
}

}  // namespace semvslam
