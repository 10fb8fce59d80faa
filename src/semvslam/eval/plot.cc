#include <fmt/format.h>

#include <functional>

#include "semvslam/eval/evaluation.h"
#include "semvslam/eval/svg_chart.h"
#include "semvslam/eval/timed_series.h"

namespace semvslam {
namespace {

struct Curve {
  std::string label, colour;
  std::vector<TimeStamp> stamps;
  std::vector<Eigen::Vector3d> positions;
  std::vector<double> errors_m;  // empty for the truth
  bool dashed = false;
};

Curve curve_of(const NamedEvaluation& named, const char* colour) {
  const AbsoluteError& e = named.evaluation.absolute;
  std::string label = fmt::format("{}: ATE RMSE {:.4f} m, max {:.4f} m, tracked {:.1f} %", named.name,
                                  e.statistics_m.rmse, e.statistics_m.max, 100 * named.evaluation.tracked_share);
  return {std::move(label), colour, e.stamps, e.estimate, e.errors_m};
}

/// @param x, y what is drawn of the curve's i-th moment.
ChartSeries series_of(const Curve& curve, const std::function<double(std::size_t)>& x,
                      const std::function<double(std::size_t)>& y) {
  return timed_series({curve.label, curve.colour, {}, {}, curve.dashed}, curve.stamps, x, y);
}

}  // namespace

std::string format_svg(const EvaluationReport& report) {
  const AbsoluteError& main = report.estimate.evaluation.absolute;
  std::vector<Curve> curves = {
      {"ground truth " + report.reference_name, kTruthColour, main.stamps, main.reference, {}, true}};
  if (report.against) curves.push_back(curve_of(*report.against, kAgainstColour));
  curves.push_back(curve_of(report.estimate, kEstimateColour));

  const double top = 46 + 18 * static_cast<double>(curves.size());
  Chart above{"x-y", "x (m)", "y (m)", 0, top, 480, 400, true, false, {}};
  Chart side{"x-z", "x (m)", "z (m)", 480, top, 480, 400, true, false, {}};
  Chart error{"absolute error over time", "time (s)", "error (m)", 0, top + 400, 960, 250, false, true, {}};
  const std::int64_t start_ns = main.stamps.front().ns;
  std::vector<LegendEntry> legend;
  for (const Curve& curve : curves) {
    const auto along = [&](int axis) { return [&curve, axis](std::size_t i) { return curve.positions[i][axis]; }; };
    above.series.push_back(series_of(curve, along(0), along(1)));
    side.series.push_back(series_of(curve, along(0), along(2)));
    const auto seconds = [&](std::size_t i) { return static_cast<double>(curve.stamps[i].ns - start_ns) * 1e-9; };
    if (!curve.errors_m.empty())
      error.series.push_back(series_of(curve, seconds, [&](std::size_t i) { return curve.errors_m[i]; }));
    legend.push_back({curve.label, curve.colour, curve.dashed});
  }
  return draw_svg(960, top + 655, "Trajectories " + alignment_text(report), legend, {above, side, error});
}

}  // namespace semvslam
