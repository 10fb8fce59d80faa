// Scores of trajectories.
#include "semvslam/eval/evaluation.h"
#include "semvslam/python/arrays.h"
#include "semvslam/python/pose_list.h"

namespace py = pybind11;
using namespace py::literals;

namespace semvslam {
namespace {

py::object evaluate_poses(const PoseList& reference, const PoseList& estimate, const std::string& delta,
                          bool consecutive, bool scale, double max_gap_s) {
  EvaluationReport report;
  report.reference_name = "reference";
  report.options.max_gap_s = max_gap_s;
  report.options.with_scale = scale;
  report.options.relative.delta = value_or_raise(Delta::parse(delta));
  report.options.relative.overlapping = !consecutive;
  report.estimate = {"estimate", value_or_raise(evaluate(reference.poses, estimate.poses, report.options))};
  return py::module_::import("json").attr("loads")(format_json(report))["estimate"];
}

}  // namespace

void bind_eval(py::module_& m) {
  m.def("evaluate", &evaluate_poses, "reference"_a, "estimate"_a, py::kw_only(), "delta"_a = "1s",
        "consecutive"_a = false, "scale"_a = false, "max_gap_s"_a = EvaluationOptions().max_gap_s,
        "ATE and RPE of two Trajectories as `semvslam eval` has them: a dict with tracked_share and, each with rmse, "
        "mean, median, sd, min and max, ate_m, rpe_translation_m and rpe_rotation_deg.");
}

}  // namespace semvslam
