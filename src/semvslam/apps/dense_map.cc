#include "semvslam/apps/dense_map.h"

#include <fmt/core.h>

#include <chrono>

namespace semvslam {

Result<DenseMapSummary> make_dense_map(const std::filesystem::path& sequence, SequenceOptions sequence_options,
                                       const Trajectory& key_frames, const std::vector<KeyFrameMask>& masks,
                                       const DenseOptions& options, const std::filesystem::path& file) {
  const auto start = std::chrono::steady_clock::now();
  DenseMapSummary summary;
  summary.file = file;
  sequence_options.want_colour = true;
  Result<std::unique_ptr<FrameSource>> source = open_sequence(sequence, sequence_options);
  if (!source) return source.error();
  VoxelMap map((*source)->camera(), options);
  for (std::size_t k = 0; k < key_frames.size();) {
    const Result<std::optional<RgbdFrame>> next =
        next_readable(**source);  // the others were skipped by the run as well
    if (!next) return next.error();
    if (!*next) break;
    const RgbdFrame& frame = **next;
    while (k < key_frames.size() && key_frames[k].stamp < frame.stamp) ++k;
    if (k == key_frames.size() || key_frames[k].stamp != frame.stamp) continue;
    const cv::Mat moving = k < masks.size() ? masks[k].moving.mask() : cv::Mat();
    if (Status status = map.integrate(frame, moving, key_frames[k].world_from_camera); !status) return status.error();
    ++k;
  }
  const std::vector<CloudPoint> points = map.points();
  if (Status status = write_cloud(file, points); !status) return status.error();
  summary.points = points.size();
  summary.key_frames = map.frames();
  summary.absent = key_frames.size() - map.frames();
  summary.seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
  return summary;
}

std::string format_summary(const DenseMapSummary& summary) {
  std::string out = fmt::format("dense map {} points of {} key frames in {:.1f} s: {}\n", summary.points,
                                summary.key_frames, summary.seconds, summary.file.string());
  if (summary.absent > 0) out += fmt::format("{} key frames could not be read again\n", summary.absent);
  return out;
}

}  // namespace semvslam
