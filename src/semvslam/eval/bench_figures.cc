#include "semvslam/eval/bench_figures.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <functional>
#include <utility>

#include "semvslam/eval/bar_chart.h"
#include "semvslam/eval/published.h"
#include "semvslam/eval/svg_axes.h"
#include "semvslam/eval/svg_chart.h"
#include "semvslam/eval/table.h"
#include "semvslam/eval/timed_series.h"

namespace semvslam {
namespace {

constexpr double kWidth_px = 960, kTimeChartHeight_px = 210;
constexpr std::size_t kFewestColumns = 2, kMostColumns = 3;  // of trajectories
constexpr std::size_t kDifferences = 200;                    // lines between truth and estimate at most

/// The two axes along which the true positions extend most, the first letters first.
std::array<int, 2> widest_plane(const std::vector<Eigen::Vector3d>& positions) {
  Eigen::Vector3d low = positions.front(), high = low;
  for (const Eigen::Vector3d& p : positions) low = low.cwiseMin(p), high = high.cwiseMax(p);
  int least = 2;
  for (int axis : {1, 0})
    if ((high - low)[axis] < (high - low)[least]) least = axis;
  return {least == 0 ? 1 : 0, least == 2 ? 1 : 2};
}

/// Lines from the true positions to the estimated ones, evenly spread over the run.
ChartSeries differences(const AbsoluteError& e, std::array<int, 2> plane) {
  ChartSeries out{"", kDrawnDifferenceColour, {}, {}, false, 0.8};
  const std::size_t step = std::max<std::size_t>(1, e.reference.size() / kDifferences);
  for (std::size_t i = 0; i < e.reference.size(); i += step) {
    out.x.insert(out.x.end(), {e.reference[i][plane[0]], e.estimate[i][plane[0]], kNoValue});
    out.y.insert(out.y.end(), {e.reference[i][plane[1]], e.estimate[i][plane[1]], kNoValue});
  }
  return out;
}

Chart trajectory_panel(const DrawnRun& run, std::array<int, 2> plane) {
  const AbsoluteError& e = run.evaluation.absolute;
  constexpr const char* kAxes[] = {"x (m)", "y (m)", "z (m)"};
  Chart chart;
  chart.title = fmt::format("{}: ATE RMSE {} mm", run.mode, three_digits(kMmPerM * e.statistics_m.rmse));
  chart.x_label = kAxes[plane[0]];
  chart.y_label = kAxes[plane[1]];
  chart.equal_aspect = true;
  const auto line = [&](const std::vector<Eigen::Vector3d>& positions, ChartSeries style) {
    return timed_series(
        std::move(style), e.stamps, [&](std::size_t i) { return positions[i][plane[0]]; },
        [&](std::size_t i) { return positions[i][plane[1]]; });
  };
  chart.series = {differences(e, plane), line(e.reference, {"", kTruthColour, {}, {}, true}),
                  line(e.estimate, {"", mode_colour(run.mode), {}, {}, false})};
  return chart;
}

/// One kind of error over time.
struct TimedError {
  const char *title, *unit;
  double scale;
  const ErrorStatistics& (*statistics)(const Evaluation&);
  const std::vector<double>& (*values)(const Evaluation&);
  bool of_steps;  // a value per step of the relative error, not per pose
};

const TimedError kTimedErrors[] = {
    {"absolute trajectory error", "mm", kMmPerM,
     [](const Evaluation& e) -> const ErrorStatistics& { return e.absolute.statistics_m; },
     [](const Evaluation& e) -> const std::vector<double>& { return e.absolute.errors_m; }, false},
    {"relative translation, by the start of the step", "mm", kMmPerM,
     [](const Evaluation& e) -> const ErrorStatistics& { return e.relative.translation_m; },
     [](const Evaluation& e) -> const std::vector<double>& { return e.relative.translation_errors_m; }, true},
    {"relative rotation, by the start of the step", "degrees", 1,
     [](const Evaluation& e) -> const ErrorStatistics& { return e.relative.rotation_deg; },
     [](const Evaluation& e) -> const std::vector<double>& { return e.relative.rotation_errors_deg; }, true},
};

std::vector<TimeStamp> moments(const Evaluation& e, bool of_steps) {
  if (!of_steps) return e.absolute.stamps;
  std::vector<TimeStamp> out;
  for (const RelativeError::Step& step : e.relative.steps) out.push_back(e.absolute.stamps[step.from]);
  return out;
}

bool differ_much(const DrawnSequence& drawn, const TimedError& kind) {
  double low = INFINITY, high = 0;
  for (const DrawnRun& run : drawn.runs) {
    const double rmse = kind.statistics(run.evaluation).rmse;
    low = std::min(low, rmse), high = std::max(high, rmse);
  }
  return low > 0 && wants_logarithmic(low, high);
}

Chart time_chart(const DrawnSequence& drawn, const TimedError& kind) {
  Chart chart;
  chart.title = kind.title;
  chart.x_label = "time (s)";
  chart.y_logarithmic = differ_much(drawn, kind);
  chart.y_label = kind.unit + std::string(chart.y_logarithmic ? ", logarithmic" : "");
  chart.y_from_zero = true;
  std::int64_t start_ns = drawn.runs.front().evaluation.absolute.stamps.front().ns;
  for (const DrawnRun& run : drawn.runs) start_ns = std::min(start_ns, run.evaluation.absolute.stamps.front().ns);
  for (const DrawnRun& run : drawn.runs) {
    const std::vector<TimeStamp> stamps = moments(run.evaluation, kind.of_steps);
    const std::vector<double>& values = kind.values(run.evaluation);
    chart.series.push_back(timed_series(
        {run.mode, mode_colour(run.mode), {}, {}, false, 1.2}, stamps,
        [&](std::size_t i) { return static_cast<double>(stamps[i].ns - start_ns) * 1e-9; },
        [&](std::size_t i) { return kind.scale * values[i]; }));
  }
  return chart;
}

void place(Chart& chart, double left_px, double top_px, double width_px, double height_px) {
  chart.left_px = left_px;
  chart.top_px = top_px;
  chart.width_px = width_px;
  chart.height_px = height_px;
}

BarChart error_bars(const BenchResults& results, const std::vector<BenchCell>& cells, const char* number,
                    const char* title, const char* unit, double scale) {
  BarChart chart{title, unit, results.sequences, {}};
  for (const std::string& mode : results.modes) {
    BarSeries series{mode, mode_colour(mode), {}};
    for (const std::string& sequence : results.sequences) {
      const BenchCell* cell = find_cell(cells, sequence, mode);
      const Spread s = cell == nullptr ? Spread{} : cell->over(number);
      series.values.push_back(s.count == 0 ? kNoValue : scale * s.median);
    }
    chart.series.push_back(std::move(series));
  }
  return chart;
}

/// What a reader knows best, and the paper's own.
constexpr DrawnSystem kDrawnSystems[] = {
    {"DS-SLAM", "#d0d0d0"}, {"DynaSLAM", "#a8a8a8"}, {"NGD-SLAM", "#808080"}, {"Sem-VSLAM", "#505050"}};

void add_published(std::span<const DrawnSystem> systems, BarChart& chart) {
  for (const auto& [name, colour] : systems)
    for (const PublishedSystem& system : published_systems()) {
      if (system.system != name) continue;
      BarSeries series{std::string(name), colour, {}};
      for (const std::string& sequence : chart.groups) {
        const auto error = system.ate_rmse_m(sequence);
        series.values.push_back(error ? kMmPerM * *error : kNoValue);
      }
      chart.series.push_back(std::move(series));
    }
}

bool has_bar(const BarChart& chart) {
  for (const BarSeries& series : chart.series)
    for (double v : series.values)
      if (std::isfinite(v)) return true;
  return false;
}

}  // namespace

std::string mode_colour(std::string_view mode) {
  constexpr std::pair<std::string_view, const char*> kColours[] = {
      {"orb", kAgainstColour},     {"boxes", "#b59a00"},  {"masks", "#8d5fd3"},     {"masks+repair", "#d0428f"},
      {"masks+motion", "#1f9e89"}, {"motion", "#4c9a2a"}, {"full", kEstimateColour}};
  for (const auto& [name, colour] : kColours)
    if (name == mode) return colour;
  return "#000000";
}

std::span<const DrawnSystem> drawn_systems(const BenchResults& results) {
  if (std::none_of(results.sequences.begin(), results.sequences.end(), paper_sequence)) return {};
  return kDrawnSystems;
}

std::string draw_trajectories(const DrawnSequence& drawn) {
  const std::array<int, 2> plane = widest_plane(drawn.runs.front().evaluation.absolute.reference);
  const std::size_t columns = std::clamp(drawn.runs.size(), kFewestColumns, kMostColumns);
  const std::size_t rows = (drawn.runs.size() + columns - 1) / columns;
  const double width_px = kWidth_px / static_cast<double>(columns), height_px = 0.8 * width_px + 50;
  std::vector<Chart> charts;
  for (std::size_t i = 0; i < drawn.runs.size(); ++i) {
    charts.push_back(trajectory_panel(drawn.runs[i], plane));
    place(charts.back(), width_px * static_cast<double>(i % columns), height_px * static_cast<double>(i / columns),
          width_px, height_px);
  }
  return draw_svg(kWidth_px, height_px * static_cast<double>(rows), "", {}, charts);
}

std::string draw_errors_over_time(const DrawnSequence& drawn) {
  std::vector<Chart> charts;
  for (const TimedError& kind : kTimedErrors) {
    charts.push_back(time_chart(drawn, kind));
    place(charts.back(), 0, kTimeChartHeight_px * static_cast<double>(charts.size() - 1), kWidth_px,
          kTimeChartHeight_px);
  }
  return draw_svg(kWidth_px, kTimeChartHeight_px * static_cast<double>(charts.size()), "", {}, charts);
}

std::vector<std::string> draw_error_bars(const BenchResults& results) {
  const std::vector<BenchCell> cells = cells_of(results);
  const std::string step = fmt::format(" over {}, ", results.rpe_delta);
  constexpr double kHeight_px = 300;
  std::vector<BarChart> charts;
  const auto add = [&](const char* number, const std::string& title, const char* unit, double scale) {
    charts.push_back(error_bars(results, cells, number, title.c_str(), unit, scale));
  };
  add("ate_rmse_m", "absolute trajectory error, RMSE", "mm", kMmPerM);
  add("ate_sd_m", "absolute trajectory error, SD", "mm", kMmPerM);
  add("rpe_translation_rmse_m", "relative translation" + step + "RMSE", "mm", kMmPerM);
  add("rpe_translation_sd_m", "relative translation" + step + "SD", "mm", kMmPerM);
  add("rpe_rotation_rmse_deg", "relative rotation" + step + "RMSE", "degrees", 1);
  add("rpe_rotation_sd_deg", "relative rotation" + step + "SD", "degrees", 1);
  if (const auto systems = drawn_systems(results); !systems.empty()) {
    add("ate_rmse_m", "absolute trajectory error, RMSE; grey: published, other machines", "mm", kMmPerM);
    add_published(systems, charts.back());
  }
  std::vector<std::string> out;
  for (const BarChart& chart : charts)
    if (has_bar(chart)) out.push_back(draw_bars(chart, kHeight_px));
  return out;
}

}  // namespace semvslam
