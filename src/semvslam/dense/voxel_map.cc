#include "semvslam/dense/voxel_map.h"

#include <fmt/core.h>

#include <algorithm>
#include <cmath>
#include <iterator>
#include <opencv2/imgproc.hpp>
#include <utility>

#include "semvslam/geometry/depth_image.h"
#include "semvslam/geometry/mask_growth.h"

namespace semvslam {
namespace {

constexpr int kBits = 18, kLabelBits = 8;
constexpr std::int64_t kHalf = std::int64_t{1} << (kBits - 1);
constexpr std::size_t kLeastPending = 1 << 20;  // voxels that are worth merging

cv::Mat metres(const cv::Mat& depth, float metres_per_unit) {
  cv::Mat out(depth.size(), CV_32FC1);
  for (int y = 0; y < depth.rows; ++y)
    for (int x = 0; x < depth.cols; ++x) out.at<float>(y, x) = depth_at_m(depth, metres_per_unit, x, y);
  return out;
}

/// Of the voxel: its corner with the least coordinates.
Eigen::Vector3d corner_m(std::uint64_t key, double voxel_m) {
  constexpr std::uint64_t kMask = (std::uint64_t{1} << kBits) - 1;
  const auto axis = [&](int bits) {
    return static_cast<double>(static_cast<std::int64_t>(key >> (kLabelBits + bits) & kMask) - kHalf);
  };
  return voxel_m * Eigen::Vector3d(axis(2 * kBits), axis(kBits), axis(0));
}

std::uint64_t place_of(std::uint64_t key) { return key >> kLabelBits; }

}  // namespace

VoxelMap::VoxelMap(const Camera& camera, const DenseOptions& options)
    : camera_(camera), options_(options), free_(camera, options) {
  rays_.reserve(static_cast<std::size_t>(camera.width_px) * static_cast<std::size_t>(camera.height_px));
  for (int y = 0; y < camera.height_px; ++y)
    for (int x = 0; x < camera.width_px; ++x)
      rays_.push_back(camera.back_project(camera.undistort({x, y}), 1).head<2>().cast<float>());
}

Status VoxelMap::integrate(const RgbdFrame& frame, const cv::Mat& moving, const SE3& world_from_camera,
                           const cv::Mat& labels) {
  const cv::Size size(camera_.width_px, camera_.height_px);
  const cv::Mat& picture = frame.colour.empty() ? frame.gray : frame.colour;
  const auto fits = [&](const cv::Mat& image, int one_type, int other_type) {
    return image.size() == size && (image.type() == one_type || image.type() == other_type);
  };
  if (!fits(frame.depth, CV_16UC1, CV_32FC1) || !fits(picture, CV_8UC3, CV_8UC1) ||
      (!moving.empty() && !fits(moving, CV_8UC1, CV_8UC1)) || (!labels.empty() && !fits(labels, CV_8UC1, CV_8UC1)))
    return Error{ErrorCode::kInvalidInput,
                 fmt::format("dense map: an image of the frame at {:.6f} s has not the camera's size or another type",
                             frame.stamp.seconds())};
  if (!world_from_camera.is_finite())
    return Error{ErrorCode::kInvalidInput,
                 fmt::format("dense map: the pose at {:.6f} s is not finite", frame.stamp.seconds())};
  const cv::Mat depth_m = metres(frame.depth, static_cast<float>(1 / camera_.depth_units_per_m));
  collect(usable_depth(depth_m, moving), frame, world_from_camera, labels);
  free_.add(depth_m, world_from_camera);
  return Status::success();
}

void VoxelMap::Voxel::add(const Voxel& other) {
  position_sum_m += other.position_sum_m;
  colour_sum += other.colour_sum;
  pixels += other.pixels;
  frames += other.frames;
}

bool VoxelMap::is_before(const Voxel& a, const Voxel& b) { return a.key < b.key; }

/// Of sorted voxels: makes one of all with one key.
void VoxelMap::add_up(Voxels& voxels) {
  std::size_t kept = 0;
  for (std::size_t i = 0; i < voxels.size(); ++i) {
    if (kept > 0 && voxels[kept - 1].key == voxels[i].key) {
      voxels[kept - 1].add(voxels[i]);
    } else {
      voxels[kept++] = voxels[i];
    }
  }
  voxels.erase(voxels.begin() + static_cast<std::ptrdiff_t>(kept), voxels.end());
}

void VoxelMap::reduce(Voxels& voxels) {
  // Short keys are sorted instead of voxels. Their numbers make the order, and with it the sums' last bits, certain.
  std::vector<std::pair<std::uint64_t, std::uint32_t>> order(voxels.size());
  for (std::size_t i = 0; i < voxels.size(); ++i) order[i] = {voxels[i].key, static_cast<std::uint32_t>(i)};
  std::sort(order.begin(), order.end());
  Voxels sorted;
  sorted.reserve(voxels.size());
  for (const auto& [key, i] : order) sorted.push_back(voxels[i]);
  add_up(sorted);
  voxels = std::move(sorted);
}

/// 0 where the depth does not get into the map.
cv::Mat VoxelMap::usable_depth(const cv::Mat& depth_m, const cv::Mat& moving) const {
  cv::Mat out = cv::Mat::zeros(depth_m.size(), CV_32FC1);
  const auto low = static_cast<float>(options_.min_depth_m), high = static_cast<float>(options_.max_depth_m),
             step = static_cast<float>(options_.edge_share);
  for (int y = 1; y + 1 < depth_m.rows; ++y) {
    const float *row = depth_m.ptr<float>(y), *above = depth_m.ptr<float>(y - 1), *below = depth_m.ptr<float>(y + 1);
    float* to = out.ptr<float>(y);
    for (int x = 1; x + 1 < depth_m.cols; ++x) {
      const float z = row[x];
      // A neighbour that was not measured says nothing.
      const auto near = [&](float other) { return !(other > 0) || std::abs(other - z) <= step * z; };
      if (z >= low && z <= high && near(row[x - 1]) && near(row[x + 1]) && near(above[x]) && near(below[x])) to[x] = z;
    }
  }
  if (!moving.empty()) {
    cv::Mat wide = moving.clone();
    grow_mask(wide, options_.margin_px);
    out.setTo(0, wide);
  }
  return out;
}

void VoxelMap::collect(const cv::Mat& depth_m, const RgbdFrame& frame, const SE3& world_from_camera,
                       const cv::Mat& labels) {
  const Eigen::Matrix3f rotation = world_from_camera.rotation().toRotationMatrix().cast<float>();
  const Eigen::Vector3d origin = world_from_camera.translation();
  const double per_m = 1 / options_.voxel_m;
  const cv::Mat& picture = frame.colour.empty() ? frame.gray : frame.colour;
  const std::uint8_t* pixels = picture.data;
  const std::size_t pixel_step = picture.step[0];
  const int channels = picture.channels();
  Voxels fresh;
  for (int y = 0; y < depth_m.rows; ++y) {
    const float* depth = depth_m.ptr<float>(y);
    for (int x = 0; x < depth_m.cols; ++x) {
      if (!(depth[x] > 0)) continue;
      const Eigen::Vector2f& ray = rays_[static_cast<std::size_t>(y * depth_m.cols + x)];
      const Eigen::Vector3d p =
          origin + (rotation * Eigen::Vector3f(ray.x() * depth[x], ray.y() * depth[x], depth[x])).cast<double>();
      const Eigen::Array3d cell = (p.array() * per_m).floor();
      if ((cell.abs() >= static_cast<double>(kHalf)).any()) continue;
      std::uint64_t key = 0;
      for (int axis = 0; axis < 3; ++axis)
        key = key << kBits | static_cast<std::uint64_t>(static_cast<std::int64_t>(cell[axis]) + kHalf);
      key = key << kLabelBits | (labels.empty() ? std::uint8_t{0} : labels.at<std::uint8_t>(y, x));
      const std::uint8_t* bgr = pixels + static_cast<std::size_t>(y) * pixel_step + x * channels;
      const Eigen::Vector3f colour(bgr[0], bgr[channels / 2], bgr[channels - 1]);
      const Eigen::Vector3f within = (p - cell.matrix() * options_.voxel_m).cast<float>();
      if (!fresh.empty() && fresh.back().key == key)  // as the pixel beside it: half of the sorting saved
        fresh.back().add({key, within, colour, 1, 0});
      else
        fresh.push_back({key, within, colour, 1, 1});
    }
  }
  reduce(fresh);
  for (Voxels::const_iterator next = fresh.begin(); next != fresh.end();) {
    pending_.push_back(next_place(next, fresh.end(), &Voxel::pixels));
    pending_.back().frames = 1;  // its pixels are of one frame
  }
  // Merged when as many wait as there are: each voxel is moved a few times only, however many frames come.
  if (pending_.size() > std::max(kLeastPending, voxels_.size())) merge();
}

/// All voxels at one place in one, with the label of the most votes. @param from the first of them; then behind them.
VoxelMap::Voxel VoxelMap::next_place(Voxels::const_iterator& from, Voxels::const_iterator end,
                                     std::uint32_t Voxel::*votes) {
  Voxel joined = *from;
  std::uint32_t most = joined.*votes;
  for (++from; from != end && place_of(from->key) == place_of(joined.key); ++from) {
    if ((*from).*votes > most) joined.key = from->key, most = (*from).*votes;
    joined.add(*from);
  }
  return joined;
}

void VoxelMap::merge() {
  reduce(pending_);
  if (voxels_.empty()) {
    voxels_.swap(pending_);
  } else {
    Voxels both;
    both.reserve(voxels_.size() + pending_.size());
    std::merge(voxels_.begin(), voxels_.end(), pending_.begin(), pending_.end(), std::back_inserter(both), is_before);
    add_up(both);
    voxels_ = std::move(both);
  }
  pending_.clear();
}

std::vector<CloudPoint> VoxelMap::points() {
  merge();
  std::vector<CloudPoint> out;
  out.reserve(voxels_.size());
  for (Voxels::const_iterator next = voxels_.begin(); next != voxels_.end();) {
    const Voxel v = next_place(next, voxels_.end(), &Voxel::frames);
    if (v.frames < static_cast<std::uint32_t>(options_.least_frames)) continue;
    const Eigen::Vector3d position =
        corner_m(v.key, options_.voxel_m) + (v.position_sum_m / static_cast<float>(v.pixels)).cast<double>();
    const std::uint32_t through = free_.count_views_through(position);
    if (through >= static_cast<std::uint32_t>(options_.seen_through) &&
        through >= options_.seen_through_share * v.frames)
      continue;
    const Eigen::Array3f bgr = (v.colour_sum / static_cast<float>(v.pixels)).array().round();
    CloudPoint point;
    point.position_m = position.cast<float>();
    point.label = static_cast<std::uint8_t>(v.key);
    for (int k = 0; k < 3; ++k) point.rgb[static_cast<std::size_t>(k)] = static_cast<std::uint8_t>(bgr[2 - k]);
    out.push_back(point);
  }
  return out;
}

std::vector<OctreeLeaf> VoxelMap::octree(std::span<const CloudPoint> points) const {
  std::vector<OctreeCode> occupied;
  for (const CloudPoint& point : points) {
    const Eigen::Array3d cube = (point.position_m.cast<double>().array() / options_.octree_m).floor();
    if ((cube.abs() > kOctreeReach).any()) continue;
    const std::optional<OctreeCode> code = octree_code(cube.cast<int>().matrix());
    if (code && (occupied.empty() || occupied.back() != *code)) occupied.push_back(*code);
  }
  std::sort(occupied.begin(), occupied.end());
  occupied.erase(std::unique(occupied.begin(), occupied.end()), occupied.end());
  const std::vector<OctreeCode> free = free_.octree_cubes();
  std::vector<OctreeLeaf> leaves;
  leaves.reserve(occupied.size() + free.size());
  auto next = occupied.begin();
  for (const OctreeCode code : free) {
    for (; next != occupied.end() && *next < code; ++next) leaves.push_back({*next, true});
    if (next == occupied.end() || *next != code) leaves.push_back({code, false});
  }
  for (; next != occupied.end(); ++next) leaves.push_back({*next, true});
  return leaves;
}

}  // namespace semvslam
