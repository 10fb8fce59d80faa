#include "semvslam/web/plan_view.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "semvslam/eval/association.h"
#include "semvslam/eval/svg_chart.h"
#include "semvslam/eval/table.h"
#include "semvslam/eval/timed_series.h"

namespace semvslam {
namespace {

constexpr double kWidth_px = 900, kPlanHeight_px = 560, kErrorHeight_px = 220, kLegendRow_px = 18, kTitle_px = 46;
constexpr std::size_t kMostDrawnPoses = 2000;  // per line: a drawing has no more pixels

/// Two horizontal directions of the world; seen from above the second lies a quarter turn to the left of the first.
struct Horizon {
  Eigen::Vector3d right, forward;

  explicit Horizon(const Eigen::Vector3d& up) {
    // The axis of the world that is least like up stays what it is, as nearly as can be.
    Eigen::Index axis = 0;
    up.cwiseAbs().minCoeff(&axis);
    right = (Eigen::Vector3d::Unit(axis) - up[axis] * up).normalized();
    forward = up.cross(right);
  }
};

ChartSeries seen_from_above(const Trajectory& all, const Horizon& horizon, ChartSeries style) {
  Trajectory shown;
  for (const std::size_t i : evenly(all.size(), kMostDrawnPoses)) shown.push_back(all[i]);
  const auto along = [&](const Eigen::Vector3d& direction) {
    return [&shown, direction](std::size_t i) { return direction.dot(shown[i].world_from_camera.translation()); };
  };
  return timed_series(std::move(style), stamps_of(shown), along(horizon.right), along(horizon.forward));
}

ChartSeries errors_over_time(const AbsoluteError& error, const std::string& colour) {
  const std::vector<std::size_t> shown = evenly(error.stamps.size(), kMostDrawnPoses);
  std::vector<TimeStamp> stamps;
  for (const std::size_t i : shown) stamps.push_back(error.stamps[i]);
  return timed_series(
      {"", colour, {}, {}}, stamps,
      [&](std::size_t i) { return static_cast<double>(stamps[i].ns - error.stamps.front().ns) * 1e-9; },
      [&](std::size_t i) { return kMmPerM * error.errors_m[shown[i]]; });
}

}  // namespace

std::string run_colour(std::size_t i) {
  constexpr std::array kColours = {kEstimateColour, kAgainstColour, "#1f9e89", "#d0428f",
                                   "#8d5fd3",       "#4c9a2a",      "#b59a00"};
  return kColours[i % kColours.size()];
}

std::string draw_plan(const Scene& scene) {
  const Horizon horizon(up_of(scene.runs));
  std::vector<LegendEntry> legend;
  Chart plan{"from above", "m", "m", 0, 0, kWidth_px, kPlanHeight_px, true, false, {}};
  Chart errors{"absolute error", "time (s)", "mm", 0, 0, kWidth_px, kErrorHeight_px, false, true, {}};
  for (std::size_t i = 0; i < scene.runs.size(); ++i) {
    const ViewedRun& run = scene.runs[i];
    if (!run.truth.empty())
      plan.series.push_back(seen_from_above(run.truth, horizon, {"", kTruthColour, {}, {}, true}));
    if (!run.trajectory.empty())
      plan.series.push_back(seen_from_above(run.trajectory, horizon, {"", run_colour(i), {}, {}}));
    if (run.evaluation) errors.series.push_back(errors_over_time(run.evaluation->absolute, run_colour(i)));
    legend.push_back({run.name, run_colour(i)});
  }
  if (plan.series.empty()) return "";
  if (!errors.series.empty()) legend.push_back({"ground truth", kTruthColour, true});
  plan.top_px = kTitle_px + kLegendRow_px * static_cast<double>(legend.size());
  errors.top_px = plan.top_px + plan.height_px;
  std::vector<Chart> charts{plan};
  if (!errors.series.empty()) charts.push_back(errors);
  return draw_svg(kWidth_px, charts.back().top_px + charts.back().height_px + 5, "", legend, charts);
}

}  // namespace semvslam
