#include "semvslam/apps/dense_map.h"

#include <fmt/core.h>

#include <algorithm>
#include <chrono>
#include <limits>
#include <optional>
#include <utility>

#include "semvslam/dense/dense_file.h"

namespace semvslam {
namespace {

/// A class's label; 0 where it is too many for one.
std::uint8_t label_of(const ClassMask& mask) {
  const int label = mask.class_index + 1;
  return label <= std::numeric_limits<std::uint8_t>::max() ? static_cast<std::uint8_t>(label) : std::uint8_t{0};
}

/// As VoxelMap::integrate() takes them.
cv::Mat label_image(const std::vector<ClassMask>& classes) {
  cv::Mat labels;
  for (const ClassMask& mask : classes) {
    if (labels.empty()) labels = cv::Mat::zeros(mask.pixels.size(), CV_8UC1);
    labels.setTo(label_of(mask), mask.pixels.mask());
  }
  return labels;
}

/// Empty where no key frame was segmented.
std::optional<LabelNames> label_names(const std::vector<KeyFrameMask>& masks) {
  std::optional<LabelNames> names;
  for (const KeyFrameMask& key_frame : masks) {
    if (!key_frame.classes) continue;
    if (!names) names.emplace();
    for (const ClassMask& mask : *key_frame.classes)
      if (const std::uint8_t label = label_of(mask); label != 0) names->emplace(label, mask.class_name);
  }
  return names;
}

/// To all files of the summary, which gets the numbers.
Status write(VoxelMap& voxels, std::optional<LabelNames> labels, double leaf_m, DenseMapSummary& summary) {
  DenseMap map{voxels.points(), std::move(labels), {}, leaf_m};
  const auto names_octree = [](const std::filesystem::path& file) {
    const Result<DenseFormat> format = dense_format(file);
    return format && is_octree(*format);
  };
  if (std::ranges::any_of(summary.files, names_octree)) map.leaves = voxels.octree(map.points);
  summary.points = map.points.size();
  summary.occupied = static_cast<std::size_t>(std::ranges::count_if(map.leaves, &OctreeLeaf::occupied));
  summary.free = map.leaves.size() - summary.occupied;
  Status written;
  for (const std::filesystem::path& file : summary.files)
    if (Status status = write_dense_map(file, map); !status && written) written = std::move(status);
  return written;
}

}  // namespace

Result<DenseMapSummary> make_dense_map(const std::filesystem::path& sequence, SequenceOptions sequence_options,
                                       const Trajectory& key_frames, const std::vector<KeyFrameMask>& masks,
                                       const DenseOptions& options, const std::vector<std::filesystem::path>& files) {
  const auto start = std::chrono::steady_clock::now();
  DenseMapSummary summary;
  summary.files = files;
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
    const cv::Mat labels = k < masks.size() && masks[k].classes ? label_image(*masks[k].classes) : cv::Mat();
    if (Status status = map.integrate(frame, moving, key_frames[k].world_from_camera, labels); !status)
      return status.error();
    ++k;
  }
  if (Status status = write(map, label_names(masks), options.octree_m, summary); !status) return status.error();
  summary.key_frames = map.frames();
  summary.absent = key_frames.size() - map.frames();
  summary.seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
  return summary;
}

std::string format_summary(const DenseMapSummary& summary) {
  std::string out = fmt::format("dense map {} points of {} key frames in {:.1f} s:", summary.points, summary.key_frames,
                                summary.seconds);
  for (const std::filesystem::path& file : summary.files) out += " " + file.string();
  out += '\n';
  if (summary.occupied + summary.free > 0)
    out += fmt::format("its octree {} cubes occupied, {} free\n", summary.occupied, summary.free);
  if (summary.absent > 0) out += fmt::format("{} key frames could not be read again\n", summary.absent);
  return out;
}

}  // namespace semvslam
