#include "semvslam/dense/free_space.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <limits>
#include <opencv2/imgproc.hpp>
#include <unordered_map>
#include <utility>

namespace semvslam {
namespace {

constexpr int kBlockPx = 4;          // side of a block of View::free_m
constexpr int kFarthestCubes = 200;  // from a camera

/// Whole numbers, from the first to the last.
struct Stretch {
  int first, last;

  /// Leaves those n where start + slope * n >= 0.
  void keep(double start, double slope) {
    const double before = first - 1, behind = last + 1, zero = -start / slope;
    if (slope > 0) first = static_cast<int>(std::ceil(std::clamp<double>(zero, first, behind)));
    if (slope < 0) last = static_cast<int>(std::floor(std::clamp<double>(zero, before, last)));
    if (slope == 0 && start < 0) last = first - 1;
  }
};

}  // namespace

/// A set of cubes: a bit each, in blocks of 8 x 8 x 8.
class FreeSpace::Cubes {
 public:
  /// @param bits of the cubes at x to x + 7, which is a multiple of 8.
  void add_row(int x, int y, int z, std::uint64_t bits) {
    if (bits == 0) return;
    const auto part = [](int number, int shift) {
      return static_cast<std::uint64_t>((number + kOctreeReach) >> 3) << shift;
    };
    blocks_[part(x, 26) | part(y, 13) | part(z, 0)][static_cast<std::size_t>(z & 7)] |= bits << 8 * (y & 7);
  }

  std::vector<OctreeCode> codes() const {
    std::vector<OctreeCode> out;
    const auto number = [](std::uint64_t key, int shift) {
      return static_cast<int>(key >> shift << 3 & 0xffff) - kOctreeReach;
    };
    for (const auto& [key, layers] : blocks_)
      for (int z = 0; z < 8; ++z)
        for (std::uint64_t bits = layers[static_cast<std::size_t>(z)]; bits != 0; bits &= bits - 1) {
          const int bit = std::countr_zero(bits);
          out.push_back(*octree_code({number(key, 26) + (bit & 7), number(key, 13) + (bit >> 3), number(key, 0) + z}));
        }
    std::sort(out.begin(), out.end());
    return out;
  }

 private:
  std::unordered_map<std::uint64_t, std::array<std::uint64_t, 8>> blocks_;  // per layer of z eight rows of x
};

FreeSpace::FreeSpace(const Camera& camera, const DenseOptions& options)
    : options_(options),
      focal_px_(static_cast<float>(camera.fx_px), static_cast<float>(camera.fy_px)),
      centre_px_(static_cast<float>(camera.cx_px + .5), static_cast<float>(camera.cy_px + .5)) {
  block_of_pixel_.reserve(static_cast<std::size_t>(camera.width_px) * static_cast<std::size_t>(camera.height_px));
  const int columns = camera.width_px / kBlockPx, rows = camera.height_px / kBlockPx;
  for (int y = 0; y < camera.height_px; ++y)
    for (int x = 0; x < camera.width_px; ++x) {
      const Eigen::Vector2d ideal = camera.undistort({x, y});
      const double c = std::floor((ideal.x() + .5) / kBlockPx), r = std::floor((ideal.y() + .5) / kBlockPx);
      const bool inside = c >= 0 && r >= 0 && c < columns && r < rows;
      block_of_pixel_.push_back(inside ? static_cast<int>(r) * columns + static_cast<int>(c) : -1);
    }
}

/// Per block the nearest depth in it and the blocks around it: at an outline a pixel's error of the pose must not count
/// as free space. Not measured is 0, nearer than all.
void FreeSpace::add(const cv::Mat& depth_m, const SE3& world_from_camera) {
  constexpr float kNone = std::numeric_limits<float>::max();
  cv::Mat blocks(depth_m.rows / kBlockPx, depth_m.cols / kBlockPx, CV_32FC1, cv::Scalar(kNone)), free_m;
  float* nearest = blocks.ptr<float>();
  const float* depth = depth_m.ptr<float>();
  for (std::size_t i = 0; i < block_of_pixel_.size(); ++i)
    if (const int b = block_of_pixel_[i]; b >= 0) nearest[b] = std::min(nearest[b], depth[i]);
  blocks.setTo(0, blocks == kNone);
  cv::erode(blocks, free_m, cv::Mat());
  views_.push_back({world_from_camera.inverse().rotation_matrix().cast<float>(), world_from_camera.translation(),
                    std::move(free_m)});
}

/// @param point in the view's camera, before it. @return how far its direction is free, as a depth; 0 = not seen.
float FreeSpace::free_depth_m(const View& view, const Eigen::Vector3f& point) const {
  const Eigen::Array2f block = (point.head<2>().array() / point.z() * focal_px_ + centre_px_) / kBlockPx;
  const bool inside = block.x() >= 0 && block.y() >= 0 && block.x() < static_cast<float>(view.free_m.cols) &&
                      block.y() < static_cast<float>(view.free_m.rows);
  return inside ? view.free_m.at<float>(static_cast<int>(block.y()), static_cast<int>(block.x())) : 0.f;
}

std::uint32_t FreeSpace::count_views_through(const Eigen::Vector3d& point) const {
  const auto least_m = static_cast<float>(options_.min_depth_m), share = static_cast<float>(options_.free_share),
             margin_m = static_cast<float>(options_.free_margin_m);
  std::uint32_t count = 0;
  for (const View& view : views_) {
    const Eigen::Vector3f p = view.rotation * (point - view.centre_m).cast<float>();
    if (p.z() > least_m) count += free_depth_m(view, p) > p.z() * (1 + share) + margin_m;
  }
  return count;
}

/// The cubes whose middles lie in the view's pyramid, row by row.
void FreeSpace::mark_cubes(const View& view, Cubes& cubes) const {
  const double side_m = options_.octree_m, reach_m = std::min(options_.max_depth_m, kFarthestCubes * side_m);
  const Eigen::Array2d focal = focal_px_.cast<double>(), centre = centre_px_.cast<double>(),
                       size = kBlockPx * Eigen::Array2d(view.free_m.cols, view.free_m.rows);
  const Eigen::Affine3d camera_from_cube = Eigen::Affine3d(view.rotation.cast<double>()) *
                                           Eigen::Translation3d(-view.centre_m) * Eigen::Scaling(side_m) *
                                           Eigen::Translation3d(.5, .5, .5);
  // Products with a point of the camera's frame are positive inside the pyramid.
  Eigen::Matrix<double, 6, 4> faces;
  faces << 0, 0, 1, -side_m, 0, 0, -1, reach_m,                              //
      focal.x(), 0, centre.x(), 0, -focal.x(), 0, size.x() - centre.x(), 0,  //
      0, focal.y(), centre.y(), 0, 0, -focal.y(), size.y() - centre.y(), 0;
  faces *= camera_from_cube.matrix();
  const Eigen::Affine3d cube_from_camera = camera_from_cube.inverse();
  Eigen::AlignedBox3d box(Eigen::Vector3d(cube_from_camera.translation()));
  for (const double x : {0., size.x()})
    for (const double y : {0., size.y()}) {
      const Eigen::Array2d ray = (Eigen::Array2d(x, y) - centre) / focal;
      box.extend(cube_from_camera * (reach_m * Eigen::Vector3d(ray.x(), ray.y(), 1)));
    }
  const auto number = [](const Eigen::Vector3d& cube) -> Eigen::Vector3i {
    return cube.array().floor().max(-kOctreeReach).min(kOctreeReach - 1).cast<int>();
  };
  const Eigen::Vector3i low = number(box.min()), high = number(box.max());
  for (int z = low.z(); z <= high.z(); ++z)
    for (int y = low.y(); y <= high.y(); ++y) {
      const Eigen::Vector4d begin(0, y, z, 1);
      Stretch row{low.x(), high.x()};
      for (int k = 0; k < faces.rows(); ++k) row.keep(faces.row(k).dot(begin), faces(k, 0));
      mark_row(view, camera_from_cube, {row.first, y, z}, row.last, cubes);
    }
}

/// @param first of the row's cubes. @param last_x of its last one.
void FreeSpace::mark_row(const View& view, const Eigen::Affine3d& camera_from_cube, const Eigen::Vector3i& first,
                         int last_x, Cubes& cubes) const {
  const Eigen::Vector3d begin = camera_from_cube * Eigen::Vector3d(0, first.y(), first.z());
  const auto half_m = static_cast<float>(options_.octree_m / 2);
  std::uint64_t bits = 0;
  for (int x = first.x(); x <= last_x; ++x) {
    const Eigen::Vector3f middle = (begin + x * camera_from_cube.linear().col(0)).cast<float>();
    bits |= std::uint64_t{free_depth_m(view, middle) > middle.z() + half_m} << (x & 7);
    if ((x & 7) == 7 || x == last_x) cubes.add_row(x & ~7, first.y(), first.z(), std::exchange(bits, 0));
  }
}

std::vector<OctreeCode> FreeSpace::octree_cubes() const {
  Cubes cubes;
  for (const View& view : views_) mark_cubes(view, cubes);
  return cubes.codes();
}

}  // namespace semvslam
