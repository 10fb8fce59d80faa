#include "semvslam/solve/relative_pose.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <limits>

#include "semvslam/geometry/alignment.h"
#include "semvslam/solve/residuals.h"

namespace semvslam {
namespace {

double pixel_chi2(const Intrinsics& camera, const Eigen::Vector3d& p, const PointObservation& o) {
  if (!(p.z() > kMinDepthM)) return std::numeric_limits<double>::infinity();
  const double u = o.pixel.x() - (camera.fx_px * p.x() / p.z() + camera.cx_px);
  const double v = o.pixel.y() - (camera.fy_px * p.y() / p.z() + camera.cy_px);
  return o.inverse_variance_px * (u * u + v * v);
}

struct RelativePoseProblem {
  struct Model {
    SE3 a_from_b, b_from_a;
    explicit Model(const SE3& pose = {}) : a_from_b(pose), b_from_a(pose.inverse()) {}
  };
  static constexpr int kSampleSize = 3;
  Intrinsics camera;
  std::vector<MatchedPoint> matches;

  std::size_t size() const { return matches.size(); }
  void hypotheses(const std::array<std::size_t, 3>& s, std::vector<Model>& out) const {
    const std::array<Eigen::Vector3d, 3> a{matches[s[0]].in_a, matches[s[1]].in_a, matches[s[2]].in_a};
    const std::array<Eigen::Vector3d, 3> b{matches[s[0]].in_b, matches[s[1]].in_b, matches[s[2]].in_b};
    const Result<Alignment> alignment = align_points(a, b, false);
    if (alignment.ok()) out.emplace_back(alignment->a_from_b.rigid);
  }
  // The worse of the two images.
  double squared_residual(const Model& m, std::size_t i) const {
    return std::max(pixel_chi2(camera, m.a_from_b * matches[i].in_b, matches[i].seen_by_a),
                    pixel_chi2(camera, m.b_from_a * matches[i].in_a, matches[i].seen_by_b));
  }
};

bool usable(const MatchedPoint& m) {
  return is_usable(m.in_a) && is_usable(m.in_b) && is_usable(m.seen_by_a) && is_usable(m.seen_by_b);
}

}  // namespace

Result<RelativePoseEstimate> estimate_relative_pose(const Intrinsics& camera, std::span<const MatchedPoint> matches,
                                                    const RelativePoseOptions& options) {
  const auto refuse = [](std::string why) {
    return Error{ErrorCode::kInvalidInput, "relative pose: " + std::move(why)};
  };
  RelativePoseProblem problem{camera, {}};
  std::copy_if(matches.begin(), matches.end(), std::back_inserter(problem.matches), usable);
  if (!is_usable(camera)) return refuse("the camera's focal lengths are not positive numbers");
  if (problem.size() < 3) return refuse(fmt::format("at least 3 usable matches are needed, got {}", problem.size()));
  const auto best = ransac(problem, options.chi2_pixel, options.ransac);
  RelativePoseEstimate out;
  out.iterations = best.iterations;
  if (best.found) {
    std::vector<Eigen::Vector3d> points;
    std::vector<PointObservation> observations;
    for (std::size_t i = 0; i < problem.size(); ++i) {
      if (!best.inlier[i]) continue;
      points.push_back(problem.matches[i].in_b);
      observations.push_back(problem.matches[i].seen_by_a);
    }
    std::vector<std::uint8_t> ignored;
    const PoseEstimate refined =
        optimize_pose(camera, best.model.a_from_b, points, observations, options.refinement, ignored);
    out.a_from_b = refined.camera_from_world;
    out.information = refined.information;
    const RelativePoseProblem::Model model(out.a_from_b);
    for (const MatchedPoint& m : matches) {
      const bool fits = usable(m) && pixel_chi2(camera, model.a_from_b * m.in_b, m.seen_by_a) <= options.chi2_pixel &&
                        pixel_chi2(camera, model.b_from_a * m.in_a, m.seen_by_b) <= options.chi2_pixel;
      out.inlier.push_back(fits);
      out.inliers += fits;
    }
  }
  if (out.inliers < options.min_inliers)
    return refuse(fmt::format("only {} of {} matches agree on a motion, {} are needed", out.inliers, problem.size(),
                              options.min_inliers));
  return out;
}

}  // namespace semvslam
