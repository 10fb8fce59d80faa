#include "semvslam/dense/voxel_map.h"

#include <fmt/core.h>

#include <algorithm>
#include <cmath>
#include <iterator>
#include <limits>
#include <opencv2/imgproc.hpp>
#include <utility>

#include "semvslam/geometry/depth_image.h"
#include "semvslam/geometry/mask_growth.h"

namespace semvslam {
namespace {

constexpr int kBits = 21;
constexpr std::int64_t kHalf = std::int64_t{1} << (kBits - 1);
constexpr int kBlockPx = 4;                     // side of a block of View::free_m
constexpr std::size_t kLeastPending = 1 << 20;  // voxels that are worth merging

cv::Mat metres(const cv::Mat& depth, float metres_per_unit) {
  cv::Mat out(depth.size(), CV_32FC1);
  for (int y = 0; y < depth.rows; ++y)
    for (int x = 0; x < depth.cols; ++x) out.at<float>(y, x) = depth_at_m(depth, metres_per_unit, x, y);
  return out;
}

/// Of the voxel: its corner with the least coordinates.
Eigen::Vector3d corner_m(std::uint64_t place, double voxel_m) {
  constexpr std::uint64_t kMask = (std::uint64_t{1} << kBits) - 1;
  const auto axis = [&](int bits) {
    return static_cast<double>(static_cast<std::int64_t>(place >> bits & kMask) - kHalf);
  };
  return voxel_m * Eigen::Vector3d(axis(2 * kBits), axis(kBits), axis(0));
}

}  // namespace

void DenseOptions::add_to(ConfigSchema& schema) {
  schema.add("dense.voxel_m", &voxel_m, {0.001, 1}, "side of the cubes that the dense map's points are averaged in, m");
  schema.add("dense.min_depth_m", &min_depth_m, {0, 100}, "nearer depth does not get into it, m");
  schema.add("dense.max_depth_m", &max_depth_m, {0.1, 1000}, "farther depth does not get into it, m");
  schema.add("dense.edge_share", &edge_share, {0.001, 10},
             "a larger step to a neighbouring pixel is a depth edge, which is left out, share of the depth");
  schema.add("dense.margin_px", &margin_px, {0, 100}, "so much around what moves is left out, px");
  schema.add("dense.least_frames", &least_frames, {1, 1000}, "key frames that must have measured a point");
  schema.add("dense.seen_through", &seen_through, {1, 100000},
             "a point goes when so many key frames look through it ...");
  schema.add("dense.seen_through_share", &seen_through_share, {0, 1000}, "... and so many for each that measured it");
  schema.add("dense.free_margin_m", &free_margin_m, {0, 10},
             "looking through: depth behind the point by this at least, m");
  schema.add("dense.free_share", &free_share, {0, 1}, "and by this share of its depth more");
}

Status DenseOptions::check() const {
  if (min_depth_m < max_depth_m) return Status::success();
  return Error{ErrorCode::kInvalidInput,
               fmt::format("dense.min_depth_m = {} is not less than dense.max_depth_m = {}", min_depth_m, max_depth_m)};
}

VoxelMap::VoxelMap(const Camera& camera, const DenseOptions& options) : camera_(camera), options_(options) {
  const auto pixels = static_cast<std::size_t>(camera.width_px) * static_cast<std::size_t>(camera.height_px);
  rays_.reserve(pixels);
  block_of_pixel_.reserve(pixels);
  const int columns = camera.width_px / kBlockPx, rows = camera.height_px / kBlockPx;
  for (int y = 0; y < camera.height_px; ++y)
    for (int x = 0; x < camera.width_px; ++x) {
      const Eigen::Vector2d ideal = camera.undistort({x, y});
      rays_.push_back(camera.back_project(ideal, 1).head<2>().cast<float>());
      const double c = std::floor((ideal.x() + .5) / kBlockPx), r = std::floor((ideal.y() + .5) / kBlockPx);
      const bool inside = c >= 0 && r >= 0 && c < columns && r < rows;
      block_of_pixel_.push_back(inside ? static_cast<int>(r) * columns + static_cast<int>(c) : -1);
    }
}

Status VoxelMap::integrate(const RgbdFrame& frame, const cv::Mat& moving, const SE3& world_from_camera) {
  const cv::Size size(camera_.width_px, camera_.height_px);
  const cv::Mat& picture = frame.colour.empty() ? frame.gray : frame.colour;
  const auto fits = [&](const cv::Mat& image, int one_type, int other_type) {
    return image.size() == size && (image.type() == one_type || image.type() == other_type);
  };
  if (!fits(frame.depth, CV_16UC1, CV_32FC1) || !fits(picture, CV_8UC3, CV_8UC1) ||
      (!moving.empty() && !fits(moving, CV_8UC1, CV_8UC1)))
    return Error{ErrorCode::kInvalidInput,
                 fmt::format("dense map: an image of the frame at {:.6f} s has not the camera's size or another type",
                             frame.stamp.seconds())};
  if (!world_from_camera.is_finite())
    return Error{ErrorCode::kInvalidInput,
                 fmt::format("dense map: the pose at {:.6f} s is not finite", frame.stamp.seconds())};
  const cv::Mat depth_m = metres(frame.depth, static_cast<float>(1 / camera_.depth_units_per_m));
  collect(usable_depth(depth_m, moving), frame, world_from_camera);
  views_.push_back({world_from_camera.inverse().rotation_matrix().cast<float>(), world_from_camera.translation(),
                    free_space(depth_m)});
  return Status::success();
}

/// Per block the nearest depth in it and the blocks around it: at an outline a pixel's error of the pose must not count
/// as free space. Not measured is 0, nearer than all.
cv::Mat VoxelMap::free_space(const cv::Mat& depth_m) const {
  constexpr float kNone = std::numeric_limits<float>::max();
  cv::Mat blocks(depth_m.rows / kBlockPx, depth_m.cols / kBlockPx, CV_32FC1, cv::Scalar(kNone)), out;
  float* nearest = blocks.ptr<float>();
  const float* depth = depth_m.ptr<float>();
  for (std::size_t i = 0; i < block_of_pixel_.size(); ++i)
    if (const int b = block_of_pixel_[i]; b >= 0) nearest[b] = std::min(nearest[b], depth[i]);
  blocks.setTo(0, blocks == kNone);
  cv::erode(blocks, out, cv::Mat());
  return out;
}

void VoxelMap::Voxel::add(const Voxel& other) {
  position_sum_m += other.position_sum_m;
  colour_sum += other.colour_sum;
  pixels += other.pixels;
  frames += other.frames;
}

bool VoxelMap::is_before(const Voxel& a, const Voxel& b) { return a.place < b.place; }

/// Of sorted voxels: makes one of all at one place.
void VoxelMap::add_up(std::vector<Voxel>& voxels) {
  std::size_t kept = 0;
  for (std::size_t i = 0; i < voxels.size(); ++i) {
    if (kept > 0 && voxels[kept - 1].place == voxels[i].place) {
      voxels[kept - 1].add(voxels[i]);
    } else {
      voxels[kept++] = voxels[i];
    }
  }
  voxels.erase(voxels.begin() + static_cast<std::ptrdiff_t>(kept), voxels.end());
}

void VoxelMap::reduce(std::vector<Voxel>& voxels) {
  // Short keys are sorted instead of voxels. Their numbers make the order, and with it the sums' last bits, certain.
  std::vector<std::pair<std::uint64_t, std::uint32_t>> order(voxels.size());
  for (std::size_t i = 0; i < voxels.size(); ++i) order[i] = {voxels[i].place, static_cast<std::uint32_t>(i)};
  std::sort(order.begin(), order.end());
  std::vector<Voxel> sorted;
  sorted.reserve(voxels.size());
  for (const auto& [place, i] : order) sorted.push_back(voxels[i]);
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

void VoxelMap::collect(const cv::Mat& depth_m, const RgbdFrame& frame, const SE3& world_from_camera) {
  const Eigen::Matrix3f rotation = world_from_camera.rotation().toRotationMatrix().cast<float>();
  const Eigen::Vector3d origin = world_from_camera.translation();
  const double per_m = 1 / options_.voxel_m;
  const cv::Mat& picture = frame.colour.empty() ? frame.gray : frame.colour;
  const std::uint8_t* pixels = picture.data;
  const std::size_t pixel_step = picture.step[0];
  const int channels = picture.channels();
  std::vector<Voxel> fresh;
  for (int y = 0; y < depth_m.rows; ++y) {
    const float* depth = depth_m.ptr<float>(y);
    for (int x = 0; x < depth_m.cols; ++x) {
      if (!(depth[x] > 0)) continue;
      const Eigen::Vector2f& ray = rays_[static_cast<std::size_t>(y * depth_m.cols + x)];
      const Eigen::Vector3d p =
          origin + (rotation * Eigen::Vector3f(ray.x() * depth[x], ray.y() * depth[x], depth[x])).cast<double>();
      const Eigen::Array3d cell = (p.array() * per_m).floor();
      if ((cell.abs() >= static_cast<double>(kHalf)).any()) continue;
      std::uint64_t place = 0;
      for (int axis = 0; axis < 3; ++axis)
        place = place << kBits | static_cast<std::uint64_t>(static_cast<std::int64_t>(cell[axis]) + kHalf);
      const std::uint8_t* bgr = pixels + static_cast<std::size_t>(y) * pixel_step + x * channels;
      const Eigen::Vector3f colour(bgr[0], bgr[channels / 2], bgr[channels - 1]);
      const Eigen::Vector3f within = (p - cell.matrix() * options_.voxel_m).cast<float>();
      if (!fresh.empty() && fresh.back().place == place)  // as the pixel beside it: half of the sorting saved
        fresh.back().add({place, within, colour, 1, 0});
      else
        fresh.push_back({place, within, colour, 1, 1});
    }
  }
  reduce(fresh);
  for (Voxel& v : fresh) v.frames = 1;  // its pixels are of one frame
  pending_.insert(pending_.end(), fresh.begin(), fresh.end());
  // Merged when as many wait as there are: each voxel is moved a few times only, however many frames come.
  if (pending_.size() > std::max(kLeastPending, voxels_.size())) merge();
}

void VoxelMap::merge() {
  reduce(pending_);
  if (voxels_.empty()) {
    voxels_.swap(pending_);
  } else {
    std::vector<Voxel> both;
    both.reserve(voxels_.size() + pending_.size());
    std::merge(voxels_.begin(), voxels_.end(), pending_.begin(), pending_.end(), std::back_inserter(both), is_before);
    add_up(both);
    voxels_ = std::move(both);
  }
  pending_.clear();
}

std::uint32_t VoxelMap::count_views_through(const Eigen::Vector3d& point) const {
  const auto fx = static_cast<float>(camera_.fx_px), fy = static_cast<float>(camera_.fy_px);
  const auto cx = static_cast<float>(camera_.cx_px + .5), cy = static_cast<float>(camera_.cy_px + .5);
  const auto least_m = static_cast<float>(options_.min_depth_m), share = static_cast<float>(options_.free_share),
             margin_m = static_cast<float>(options_.free_margin_m);
  std::uint32_t count = 0;
  for (const View& view : views_) {
    const Eigen::Vector3f p = view.rotation * (point - view.centre_m).cast<float>();
    if (!(p.z() > least_m)) continue;
    const float c = (p.x() / p.z() * fx + cx) / kBlockPx, r = (p.y() / p.z() * fy + cy) / kBlockPx;
    if (!(c >= 0 && r >= 0 && c < static_cast<float>(view.free_m.cols) && r < static_cast<float>(view.free_m.rows)))
      continue;
    count += view.free_m.at<float>(static_cast<int>(r), static_cast<int>(c)) > p.z() * (1 + share) + margin_m;
  }
  return count;
}

std::vector<CloudPoint> VoxelMap::points() {
  merge();
  std::vector<CloudPoint> out;
  out.reserve(voxels_.size());
  for (const Voxel& v : voxels_) {
    if (v.frames < static_cast<std::uint32_t>(options_.least_frames)) continue;
    const Eigen::Vector3d position =
        corner_m(v.place, options_.voxel_m) + (v.position_sum_m / static_cast<float>(v.pixels)).cast<double>();
    const std::uint32_t through = count_views_through(position);
    if (through >= static_cast<std::uint32_t>(options_.seen_through) &&
        through >= options_.seen_through_share * v.frames)
      continue;
    const Eigen::Array3f bgr = (v.colour_sum / static_cast<float>(v.pixels)).array().round();
    CloudPoint point;
    point.position_m = position.cast<float>();
    for (int k = 0; k < 3; ++k) point.rgb[static_cast<std::size_t>(k)] = static_cast<std::uint8_t>(bgr[2 - k]);
    out.push_back(point);
  }
  return out;
}

}  // namespace semvslam
