#include "semvslam/motion/camera_motion.h"

#include <Eigen/Cholesky>
#include <algorithm>
#include <array>
#include <cmath>

#include "semvslam/base/random.h"
#include "semvslam/geometry/ransac.h"

namespace semvslam {
namespace {

using Vector6 = SE3::Tangent;
using Matrix6 = Eigen::Matrix<double, 6, 6>;

constexpr int kSampleSize = 3;
constexpr double kNearestPointM = 0.05;  // points nearer to the camera's plane are not projected
constexpr double kDepthSigmas = 4;       // within which the measured depth must agree
constexpr double kHintShare = 0.5;       // a motion that the hint speaks against needs 1 / this as much support

struct Ready {  // a pair that can vote
  Eigen::Vector3d point;
  Eigen::Vector2d to_px;
  double to_depth_m, depth_sigma_m, weight;
  int cell;
};

struct Hypothesis {
  SE3 motion;
  double support = 0, score = -1;
};

double depth_sigma_m(const CameraMotionOptions& options, double a_m, double b_m) {
  const double noise_a = options.depth_sigma_per_m2 * a_m * a_m, noise_b = options.depth_sigma_per_m2 * b_m * b_m;
  const double bias = options.depth_bias_share * b_m;
  return std::sqrt(noise_a * noise_a + noise_b * noise_b + bias * bias);
}

class Estimator {
 public:
  Estimator(std::span<const PointPair> pairs, const Camera& camera, const std::optional<SE3>& hint,
            const CameraMotionOptions& options)
      : camera_(camera), hint_(hint), options_(options) {
    columns_ = camera.width_px / options.cell_px + 1;
    cells_.resize(static_cast<std::size_t>(columns_ * (camera.height_px / options.cell_px + 1)));
    for (const PointPair& pair : pairs) {
      if (!(pair.from_depth_m > 0) || !(pair.weight > 0)) continue;
      const int cell = cell_of(pair.to_px);
      if (cell < 0) continue;
      cells_[static_cast<std::size_t>(cell)].push_back(static_cast<int>(ready_.size()));
      ready_.push_back({camera.back_project(pair.from_px, pair.from_depth_m), pair.to_px, pair.to_depth_m,
                        depth_sigma_m(options, pair.from_depth_m, pair.to_depth_m), pair.weight, cell});
    }
    for (std::size_t c = 0; c < cells_.size(); ++c)
      if (!cells_[c].empty()) used_cells_.push_back(static_cast<int>(c));
  }

  CameraMotion run() {
    CameraMotion result;
    if (hint_) {
      result.source = CameraMotionSource::kPredicted;
      result.cur_from_prev = *hint_;
    }
    if (static_cast<int>(ready_.size()) < std::max(kSampleSize, options_.min_points)) return result;
    search();
    Hypothesis best = best_;
    for (int round = 0; round < 3; ++round) {
      Hypothesis refined{best.motion};
      if (!refine(refined.motion)) break;
      rate(refined);
      if (refined.score < best.score - 1e-3) break;
      best = refined;
    }
    const int agreeing = count_agreeing(best.motion);
    if (agreeing < options_.min_points) return result;
    result.source = CameraMotionSource::kEstimated;
    result.cur_from_prev = best.motion;
    result.points = agreeing;
    result.support = best.support;
    result.runner_up = runner_up(best.motion);
    return result;
  }

 private:
  int cell_of(const Eigen::Vector2d& pixel) const {
    if (!(pixel.x() >= 0 && pixel.y() >= 0)) return -1;
    const int cell = static_cast<int>(pixel.y()) / options_.cell_px * columns_ +
                     std::min(static_cast<int>(pixel.x()) / options_.cell_px, columns_ - 1);
    return cell < static_cast<int>(cells_.size()) ? cell : -1;
  }

  // 0 = does not agree, 1 = fits exactly.
  double agreement(const SE3& motion, const Eigen::Matrix3d& rotation, const Ready& pair) const {
    const Eigen::Vector3d p = rotation * pair.point + motion.translation();
    if (p.z() < kNearestPointM) return 0;
    const double limit = options_.inlier_px * options_.inlier_px;
    const double squared = (camera_.project(p) - pair.to_px).squaredNorm();
    if (squared > limit) return 0;
    if (pair.to_depth_m > 0 && std::abs(pair.to_depth_m - p.z()) > kDepthSigmas * pair.depth_sigma_m) return 0;
    return 1 - squared / limit;
  }

  // Support: mean over the cells of the share of their votes that agree, so that many points in one place are one vote.
  void rate(Hypothesis& hypothesis) const {
    const Eigen::Matrix3d rotation = hypothesis.motion.rotation_matrix();
    double sum = 0, possible = 0;
    for (const int cell : used_cells_) {
      double votes = 0, agree = 0;
      for (const int i : cells_[static_cast<std::size_t>(cell)]) {
        const Ready& pair = ready_[static_cast<std::size_t>(i)];
        votes += pair.weight;
        agree += pair.weight * agreement(hypothesis.motion, rotation, pair);
      }
      // A cell with a single weak vote counts less than one with two good ones.
      const double trust = std::min(1.0, votes / 2);
      sum += trust * agree / votes;
      possible += trust;
    }
    hypothesis.support = possible > 0 ? sum / possible : 0;
    hypothesis.score = hypothesis.support * hint_factor(hypothesis.motion);
  }

  double hint_factor(const SE3& motion) const {
    if (!hint_) return 1;
    const SE3 difference = motion * hint_->inverse();
    const double t = difference.translation().norm() / options_.prediction_sigma_m;
    const double r = difference.rotation_angle_rad() / options_.prediction_sigma_rad;
    return kHintShare + (1 - kHintShare) * std::exp(-0.5 * (t * t + r * r));
  }

  // One Gauss-Newton step's normal equations over some pairs; the damping keeps unobservable directions at rest.
  template <typename Indices>
  bool step(const Indices& indices, double damping, SE3& motion) const {
    Matrix6 normal = Matrix6::Zero();
    Vector6 right = Vector6::Zero();
    for (const auto i : indices) {
      const Ready& pair = ready_[static_cast<std::size_t>(i)];
      const Eigen::Vector3d p = motion * pair.point;
      if (p.z() < kNearestPointM) return false;
      const double iz = 1 / p.z(), x = p.x() * iz, y = p.y() * iz, fx = camera_.fx_px, fy = camera_.fy_px;
      const Eigen::Vector2d error = pair.to_px - camera_.project(p);
      Vector6 jx, jy;
      jx << fx * iz, 0, -fx * x * iz, -fx * x * y, fx * (1 + x * x), -fx * y;
      jy << 0, fy * iz, -fy * y * iz, -fy * (1 + y * y), fy * x * y, fy * x;
      normal += jx * jx.transpose() + jy * jy.transpose();
      right += jx * error.x() + jy * error.y();
    }
    // In units of pixels: about one pixel per centimetre and per centiradian at indoor distances.
    for (int k = 0; k < 6; ++k) normal(k, k) += damping;
    const Vector6 xi = normal.ldlt().solve(right);
    if (!xi.allFinite() || xi.norm() > 1) return false;
    motion = SE3::exp(xi) * motion;
    return true;
  }

  bool refine(SE3& motion) const {
    std::vector<int> agreeing;
    const Eigen::Matrix3d rotation = motion.rotation_matrix();
    for (std::size_t i = 0; i < ready_.size(); ++i)
      if (agreement(motion, rotation, ready_[i]) > 0) agreeing.push_back(static_cast<int>(i));
    if (static_cast<int>(agreeing.size()) < options_.min_points) return false;
    return step(agreeing, 1e-6, motion);
  }

  int count_agreeing(const SE3& motion) const {
    const Eigen::Matrix3d rotation = motion.rotation_matrix();
    return static_cast<int>(std::count_if(ready_.begin(), ready_.end(),
                                          [&](const Ready& r) { return agreement(motion, rotation, r) > 0; }));
  }

  void consider(const SE3& motion) {
    Hypothesis hypothesis{motion};
    rate(hypothesis);
    tried_.push_back(hypothesis);
    if (hypothesis.score > best_.score) best_ = hypothesis;
  }

  void search() {
    const SE3 start = hint_.value_or(SE3());
    consider(start);
    Random random(options_.seed, "motion.camera");
    int needed = options_.max_iterations;
    for (int k = 0; k < needed; ++k) {
      // Cells first, then a point in each: a thing with many points is drawn no more often than its area says.
      std::array<int, kSampleSize> sample{};
      for (int j = 0; j < kSampleSize; ++j) {
        const auto& cell = cells_[static_cast<std::size_t>(used_cells_[random.index(used_cells_.size())])];
        sample[static_cast<std::size_t>(j)] = cell[random.index(cell.size())];
      }
      if (sample[0] == sample[1] || sample[0] == sample[2] || sample[1] == sample[2]) continue;
      SE3 motion = start;
      bool fine = true;
      for (int round = 0; round < 3 && fine; ++round) fine = step(sample, 1e-3, motion);
      if (!fine) continue;
      const double before = best_.score;
      consider(motion);
      if (best_.score > before)
        needed = std::clamp(ransac_iterations(best_.support, kSampleSize, 0.999, options_.max_iterations),
                            std::min(30, options_.max_iterations), options_.max_iterations);
    }
  }

  // Support of the best hypothesis that moves the points clearly elsewhere.
  double runner_up(const SE3& chosen) const {
    double best = 0;
    for (const Hypothesis& other : tried_) {
      if (other.support <= best) continue;
      int apart = 0, asked = 0;
      for (const int cell : used_cells_) {
        const Ready& pair = ready_[static_cast<std::size_t>(cells_[static_cast<std::size_t>(cell)].front())];
        const Eigen::Vector3d p = chosen * pair.point, q = other.motion * pair.point;
        if (p.z() < kNearestPointM || q.z() < kNearestPointM) continue;
        ++asked;
        apart += (camera_.project(p) - camera_.project(q)).norm() > 2 * options_.inlier_px;
      }
      if (2 * apart > asked) best = other.support;
    }
    return best;
  }

  const Camera& camera_;
  const std::optional<SE3>& hint_;
  const CameraMotionOptions& options_;
  int columns_ = 0;
  std::vector<Ready> ready_;
  std::vector<std::vector<int>> cells_;
  std::vector<int> used_cells_;
  std::vector<Hypothesis> tried_;
  Hypothesis best_;
};

}  // namespace

std::string_view to_string(CameraMotionSource source) {
  switch (source) {
    case CameraMotionSource::kNone:
      return "none";
    case CameraMotionSource::kGiven:
      return "given";
    case CameraMotionSource::kEstimated:
      return "estimated";
    case CameraMotionSource::kPredicted:
      return "predicted";
  }
  return "";
}

void CameraMotionOptions::add_to(ConfigSchema& schema) {
  schema.add("motion.camera.min_points", &min_points, {4, 1000}, "points that must agree on the camera's motion");
  schema.add("motion.camera.cell_px", &cell_px, {16, 640}, "side of the cells in which votes are counted, px");
  schema.add("motion.camera.inlier_px", &inlier_px, {0.2, 20.0}, "reprojection error of a point that agrees, px");
  schema.add("motion.camera.prediction_sigma_m", &prediction_sigma_m, {1e-4, 10.0},
             "standard deviation of the expected motion per frame, m");
  schema.add("motion.camera.prediction_sigma_rad", &prediction_sigma_rad, {1e-4, 3.2},
             "standard deviation of the expected rotation per frame, rad");
  schema.add("motion.camera.max_iterations", &max_iterations, {10, 10000}, "samples tried at most");
}

CameraMotion estimate_camera_motion(std::span<const PointPair> pairs, const Camera& camera,
                                    const std::optional<SE3>& hint, const CameraMotionOptions& options) {
  return Estimator(pairs, camera, hint, options).run();
}

}  // namespace semvslam
