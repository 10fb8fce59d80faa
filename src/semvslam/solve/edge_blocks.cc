#include "semvslam/solve/edge_blocks.h"

#include <algorithm>
#include <stdexcept>

namespace semvslam {
namespace {

struct Robust {
  Lanes weight, cost;
};

// Huber's loss of a squared error; below its corner the root is exactly 1.
Robust huber(const Lanes& s, double limit) {
  const Lanes corner = broadcast(limit);
  const Lanes weight = sqrt_lanes(corner / (s > corner ? s : corner));
  return {weight, s > corner ? 2 * s * weight - corner : s};
}

// Everything the normal equations take from eight edges.
struct Contribution {
  Lanes pose[kPoseEntries + 6];
  Lanes point[9];
  Lanes coupling[3][6];
};

Contribution contribution(const PointInformation<Lanes>& m, const Lanes (&r)[3][3], const Lanes& x, const Lanes& y,
                          const Lanes& z) {
  Contribution c;
  pose_normal(m, x, y, z, c.pose, c.pose + kPoseEntries);
  Lanes n[3][3];  // M R
  for (int k = 0; k < 3; ++k) {
    n[0][k] = m.xx * r[0][k] + m.xz * r[2][k];
    n[1][k] = m.yy * r[1][k] + m.yz * r[2][k];
    n[2][k] = m.xz * r[0][k] + m.yz * r[1][k] + m.zz * r[2][k];
    c.coupling[k][0] = n[0][k];
    c.coupling[k][1] = n[1][k];
    c.coupling[k][2] = n[2][k];
    c.coupling[k][3] = y * n[2][k] - z * n[1][k];
    c.coupling[k][4] = z * n[0][k] - x * n[2][k];
    c.coupling[k][5] = x * n[1][k] - y * n[0][k];
    c.point[6 + k] = r[0][k] * m.gx + r[1][k] * m.gy + r[2][k] * m.gz;
  }
  int entry = 0;
  for (int i = 0; i < 3; ++i)
    for (int k = i; k < 3; ++k) c.point[entry++] = r[0][i] * n[0][k] + r[1][i] * n[1][k] + r[2][i] * n[2][k];
  return c;
}

}  // namespace

EdgeBlocks::EdgeBlocks(const BaProblem& problem, std::vector<Eigen::Vector3d>& points, double pixel_limit,
                       double disparity_limit)
    : camera_(problem.camera),
      pixel_limit_(pixel_limit),
      disparity_limit_(disparity_limit),
      edges_(problem.edges.size()) {
  std::vector<std::uint32_t> free_index(problem.poses.size(), kNoSlot);
  std::uint32_t free_poses = 0;
  for (std::size_t i = 0; i < free_index.size(); ++i)
    if (!problem.pose_fixed[i]) free_index[i] = free_poses++;

  // Two stable counting sorts, by pose and then by point: sums do not depend on the order of the edges in the problem.
  std::vector<std::uint32_t> by_pose(edges_), order(edges_);
  std::vector<std::uint32_t> pose_end(problem.poses.size() + 1, 0), point_end(points.size() + 1, 0);
  for (const auto& e : problem.edges) {
    ++pose_end[e.pose + 1];
    ++point_end[e.point + 1];
  }
  for (std::size_t i = 1; i < pose_end.size(); ++i) pose_end[i] += pose_end[i - 1];
  for (std::size_t i = 1; i < point_end.size(); ++i) point_end[i] += point_end[i - 1];
  for (std::uint32_t i = 0; i < edges_; ++i) by_pose[pose_end[problem.edges[i].pose]++] = i;
  for (const std::uint32_t i : by_pose) order[point_end[problem.edges[i].point]++] = i;

  std::vector<std::uint8_t> finite(points.size());
  for (std::size_t i = 0; i < points.size(); ++i) {
    finite[i] = is_usable(points[i]);
    if (!finite[i]) points[i].setZero();
  }
  blocks_.resize((edges_ + kLanes - 1) / kLanes);
  for (Block& b : blocks_) b.slot.fill(kNoSlot);
  slot_begin_.assign(points.size() + 1, 0);
  slot_pose_.reserve(edges_);
  for (std::size_t k = 0; k < edges_; ++k) {
    const auto& e = problem.edges[order[k]];
    if (k > 0 && problem.edges[order[k - 1]].point == e.point && problem.edges[order[k - 1]].pose == e.pose)
      throw std::invalid_argument("adjust_bundle: a point has two edges to the same pose");
    Block& b = blocks_[k / kLanes];
    const std::size_t lane = k % kLanes;
    b.pose[lane] = e.pose;
    b.point[lane] = e.point;
    b.original[lane] = order[k];
    if (free_index[e.pose] != kNoSlot) {
      b.slot[lane] = static_cast<std::uint32_t>(slot_pose_.size());
      slot_pose_.push_back(free_index[e.pose]);
      ++slot_begin_[e.point + 1];
    }
    if (finite[e.point] && is_usable(e.observation)) set_observation(b, lane, e.observation);
  }
  for (std::size_t i = 1; i < slot_begin_.size(); ++i) slot_begin_[i] += slot_begin_[i - 1];
  switch_off_weak_points();
}

void EdgeBlocks::set_observation(Block& b, std::size_t lane, const PointObservation& o) {
  b.u[lane] = o.pixel.x();
  b.v[lane] = o.pixel.y();
  b.pixel_weight[lane] = b.pixel_variance_inverse[lane] = o.inverse_variance_px;
  if (!has_depth(o)) return;
  b.disparity[lane] = o.disparity_px;
  b.disparity_weight[lane] = b.disparity_variance_inverse[lane] = o.inverse_variance_disparity;
}

bool EdgeBlocks::any_active() const {
  for (const Block& b : blocks_)
    for (int i = 0; i < kLanes; ++i)
      if (b.pixel_weight[i] > 0) return true;
  return false;
}

void EdgeBlocks::switch_off_weak_points() {
  std::vector<std::uint32_t> pixels(slot_begin_.size(), 0);  // a depth counts as a second pixel
  for (const Block& b : blocks_)
    for (std::size_t i = 0; i < kLanes; ++i)
      pixels[b.point[i]] += (b.pixel_weight[i] > 0) + (b.disparity_weight[i] > 0);
  for (Block& b : blocks_) {
    for (std::size_t i = 0; i < kLanes; ++i) {
      if (pixels[b.point[i]] >= 2) continue;
      b.pixel_weight[i] = b.disparity_weight[i] = 0;
    }
  }
}

inline EdgeBlocks::View EdgeBlocks::view(const Block& b, const std::vector<PoseMatrix>& poses,
                                         const std::vector<Eigen::Vector3d>& points) {
  View w;
  Lanes t[3], p[3];
  for (std::size_t i = 0; i < kLanes; ++i) {
    const PoseMatrix& pose = poses[b.pose[i]];
    const Eigen::Vector3d& point = points[b.point[i]];
    for (int k = 0; k < 3; ++k) {
      for (int c = 0; c < 3; ++c) w.r[k][c][i] = pose.r(k, c);
      t[k][i] = pose.t[k];
      p[k][i] = point[k];
    }
  }
  w.x = w.r[0][0] * p[0] + w.r[0][1] * p[1] + w.r[0][2] * p[2] + t[0];
  w.y = w.r[1][0] * p[0] + w.r[1][1] * p[1] + w.r[1][2] * p[2] + t[1];
  w.z = w.r[2][0] * p[0] + w.r[2][1] * p[1] + w.r[2][2] * p[2] + t[2];
  w.in_front_z = w.z > kMinDepthM ? w.z : broadcast(1);
  w.visible = w.z > kMinDepthM ? broadcast(1) : broadcast(0);
  return w;
}

double EdgeBlocks::cost(const std::vector<PoseMatrix>& poses, const std::vector<Eigen::Vector3d>& points) const {
  Lanes sum = broadcast(0);
  for (const Block& b : blocks_) {
    const View w = view(b, poses, points);
    const ResidualTerms<Lanes> e = residual_terms(camera_, w.x, w.y, w.in_front_z, b.u, b.v, b.disparity);
    const Lanes seen = huber(b.pixel_weight * (e.u * e.u + e.v * e.v), pixel_limit_).cost +
                       huber(b.disparity_weight * e.disparity * e.disparity, disparity_limit_).cost;
    const Lanes unseen = b.pixel_weight > 0.0 ? broadcast(kBehindCameraCost) : broadcast(0);
    sum += w.visible > 0.0 ? seen : unseen;
  }
  return sum_lanes(sum);
}

void EdgeBlocks::linearize(const std::vector<PoseMatrix>& poses, const std::vector<Eigen::Vector3d>& points,
                           std::vector<PoseNormal>& pose_normals, std::vector<PointNormal>& point_normals,
                           std::vector<Columns3>& coupling) const {
  std::fill(pose_normals.begin(), pose_normals.end(), PoseNormal{});
  std::fill(point_normals.begin(), point_normals.end(), PointNormal{});
  for (const Block& b : blocks_) {
    const View w = view(b, poses, points);
    const ResidualTerms<Lanes> e = residual_terms(camera_, w.x, w.y, w.in_front_z, b.u, b.v, b.disparity);
    const Lanes wp = b.pixel_weight * w.visible, wd = b.disparity_weight * w.visible;
    const Lanes hp = huber(wp * (e.u * e.u + e.v * e.v), pixel_limit_).weight;
    const Lanes hd = huber(wd * e.disparity * e.disparity, disparity_limit_).weight;
    const Contribution c = contribution(point_information<Lanes>(e, wp * hp, wd * hd), w.r, w.x, w.y, w.in_front_z);
    for (std::size_t i = 0; i < kLanes; ++i) {
      PointNormal& point = point_normals[b.point[i]];
      for (std::size_t k = 0; k < point.size(); ++k) point[k] += c.point[k][i];
      const std::uint32_t slot = b.slot[i];
      if (slot == kNoSlot) continue;
      PoseNormal& pose = pose_normals[slot_pose_[slot]];
      for (std::size_t k = 0; k < pose.size(); ++k) pose[k] += c.pose[k][i];
      for (std::size_t k = 0; k < 3; ++k) {
        const Lanes(&from)[6] = c.coupling[k];
        coupling[slot][k] = Lanes{from[0][i], from[1][i], from[2][i], from[3][i], from[4][i], from[5][i], 0, 0};
      }
    }
  }
}

void EdgeBlocks::classify(const std::vector<PoseMatrix>& poses, const std::vector<Eigen::Vector3d>& points) {
  const Lanes zero = broadcast(0);
  for (Block& b : blocks_) {
    const View w = view(b, poses, points);
    const ResidualTerms<Lanes> e = residual_terms(camera_, w.x, w.y, w.in_front_z, b.u, b.v, b.disparity);
    const Lanes sp = b.pixel_variance_inverse * (e.u * e.u + e.v * e.v);
    const Lanes sd = b.disparity_variance_inverse * e.disparity * e.disparity;
    b.pixel_weight = sp <= pixel_limit_ ? b.pixel_variance_inverse * w.visible : zero;
    b.disparity_weight = sd <= disparity_limit_ ? (b.pixel_weight > zero ? b.disparity_variance_inverse : zero) : zero;
  }
}

int EdgeBlocks::write_inliers(std::vector<std::uint8_t>& edge_inlier) const {
  edge_inlier.assign(edges_, 0);
  int outliers = 0;
  for (std::size_t k = 0; k < edges_; ++k) {
    const Block& b = blocks_[k / kLanes];
    const bool inlier = b.pixel_weight[k % kLanes] > 0;
    edge_inlier[b.original[k % kLanes]] = inlier;
    outliers += !inlier;
  }
  return outliers;
}

}  // namespace semvslam
