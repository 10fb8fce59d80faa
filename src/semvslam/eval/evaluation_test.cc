#include "semvslam/eval/evaluation.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <filesystem>
#include <fstream>
#include <nlohmann/json.hpp>

#include "semvslam/data/trajectory_io.h"

namespace semvslam {
namespace {

using ::testing::HasSubstr;
using Json = nlohmann::json;

Trajectory circle(int count, double start_s = 100) {
  Trajectory out;
  for (int k = 0; k < count; ++k) {
    const double a = 0.05 * k;
    out.push_back({TimeStamp::from_seconds(start_s + k / 30.0),
                   SE3(Eigen::Quaterniond::Identity(), {std::cos(a), std::sin(a), 0.1 * std::sin(3 * a)})});
  }
  return out;
}

std::string error_of(const Trajectory& reference, const Trajectory& estimate) {
  const auto e = evaluate(reference, estimate, {});
  return e ? "" : e.error().message;
}

TEST(Evaluate, RefusesWhatCannotBeCompared) {
  EXPECT_EQ(error_of(circle(1), circle(60)), "the ground truth has 1 pose; 3 are needed");
  EXPECT_EQ(error_of(circle(60), circle(2)), "the estimate has 2 poses; 3 are needed");
  EXPECT_EQ(
      error_of(circle(60), circle(60, 500)),
      "no pose of the estimate (500.000..501.967 s) is within 20 ms of one of the ground truth (100.000..101.967 s)");
  EXPECT_THAT(error_of(circle(20), circle(20)), HasSubstr("choose a smaller delta"));
}

TEST(Evaluate, SharesAreOfTheGroundTruthOrOfTheFramesGiven) {
  const Trajectory truth = circle(100);
  const Trajectory estimate(truth.begin(), truth.begin() + 50);
  EvaluationOptions options;
  EXPECT_DOUBLE_EQ(evaluate(truth, estimate, options)->tracked_share, 0.5);
  options.frames = stamps_of(estimate);
  EXPECT_DOUBLE_EQ(evaluate(truth, estimate, options)->tracked_share, 1.0);
}

TEST(Evaluate, AnAlignmentThatIsGivenKeepsWhatTheBestOneWouldTakeAway) {
  const Trajectory truth = circle(100);
  const SE3 estimate_from_truth(Eigen::Quaterniond(Eigen::AngleAxisd(0.4, Eigen::Vector3d::UnitZ())), {3, -1, 2});
  const auto moved = [&](const SE3& by) {
    Trajectory out = truth;
    for (StampedPose& pose : out) pose.world_from_camera = by * pose.world_from_camera;
    return out;
  };
  EvaluationOptions options;
  options.reference_from_estimate = evaluate(truth, moved(estimate_from_truth), {})->absolute.reference_from_estimate;
  const SE3 off(Eigen::Quaterniond::Identity(), {0, 0, 0.02});
  const Trajectory localised = moved(estimate_from_truth * off);
  EXPECT_NEAR(evaluate(truth, localised, {})->absolute.statistics_m.rmse, 0, 1e-9);
  EXPECT_NEAR(evaluate(truth, localised, options)->absolute.statistics_m.rmse, 0.02, 1e-9);
  EXPECT_NEAR(evaluate(truth, localised, options)->absolute.statistics_m.min, 0.02, 1e-9);
}

EvaluationReport report_of(const Trajectory& truth, const Trajectory& estimate, const Trajectory& against) {
  EvaluationReport report;
  report.reference_name = "truth.txt";
  report.estimate = {"a<b>&.txt", *evaluate(truth, estimate, report.options)};
  report.against = {"other.txt", *evaluate(truth, against, report.options)};
  return report;
}

Trajectory shaken(Trajectory in, double size_m) {
  for (std::size_t i = 0; i < in.size(); ++i)
    in[i].world_from_camera = SE3(Eigen::Quaterniond::Identity(), in[i].world_from_camera.translation() +
                                                                      Eigen::Vector3d(0, 0, i % 2 ? size_m : -size_m));
  return in;
}

TEST(Report, JsonHoldsTheNumbersAndTheImprovement) {
  const Trajectory truth = circle(90);
  const EvaluationReport report = report_of(truth, shaken(truth, 0.01), shaken(truth, 0.04));
  const Json json = Json::parse(format_json(report));
  EXPECT_NEAR(json["estimate"]["ate_m"]["rmse"].get<double>(), 0.01, 1e-5);
  EXPECT_EQ(json["estimate"]["paired"], 90);
  EXPECT_NEAR(json["improvement_percent"]["ate"]["rmse"].get<double>(), 75, 0.05);
  EXPECT_THAT(format_text(report), HasSubstr("tracked 100.00 % of the ground truth's poses"));
  EXPECT_THAT(format_text(report), HasSubstr("75.0"));
}

TEST(Report, JsonSurvivesAFileNameThatIsNoText) {
  const Trajectory truth = circle(90);
  EvaluationReport report = report_of(truth, truth, truth);
  report.estimate.name = "bad\xff.txt";
  EXPECT_FALSE(Json::parse(format_json(report)).empty());
}

TEST(Report, SvgEscapesNamesAndBreaksLinesAtGaps) {
  const Trajectory truth = circle(300);
  Trajectory broken = shaken(truth, 0.01);
  broken.erase(broken.begin() + 100, broken.begin() + 200);
  const std::string svg = format_svg(report_of(truth, broken, shaken(truth, 0.02)));
  EXPECT_THAT(svg, HasSubstr("a&lt;b&gt;&amp;.txt"));
  EXPECT_THAT(svg, ::testing::Not(HasSubstr("nan")));
  // Per chart one path and one pen-down per piece: the truth (x-y and x-z; drawn where the estimate is) and the
  // estimate in two pieces, the other one whole.
  std::size_t moves = 0;
  for (std::size_t at = svg.find('M'); at != std::string::npos; at = svg.find('M', at + 1))
    moves += std::isdigit(static_cast<unsigned char>(svg[at + 1])) != 0;
  EXPECT_EQ(moves, 2u * (2 + 2 + 1) + (2 + 1));
}

/// The numbers that evo computed for the same files (tools/compare_with_evo.py --write).
void expect_evo_numbers(const std::filesystem::path& cases_file) {
  const std::filesystem::path root = SEMVSLAM_SOURCE_DIR;
  std::ifstream stream(root / cases_file);
  const Json content = Json::parse(stream);
  const std::filesystem::path folder = root / content["folder"].get<std::string>();
  if (!std::filesystem::is_directory(folder)) GTEST_SKIP() << "the trajectories are not here: " << content["folder"];
  for (const Json& c : content["cases"]) {
    SCOPED_TRACE(c.dump());
    const auto truth = read_trajectory(folder / c["truth"].get<std::string>());
    const auto estimate = read_trajectory(folder / c["estimate"].get<std::string>());
    ASSERT_TRUE(truth && estimate);
    EvaluationOptions options;
    options.with_scale = c["scale"].get<bool>();
    options.relative.delta = {c["delta_frames"].get<double>(), Delta::Unit::kFrames};
    options.relative.overlapping = c["overlapping"].get<bool>();
    const auto e = evaluate(*truth, *estimate, options);
    ASSERT_TRUE(e) << e.error().message;
    const Json& expected = c["expected"];
    EXPECT_EQ(e->pairs, expected["paired"].get<std::size_t>());
    const auto expect_equal = [&](const ErrorStatistics& s, const Json& wanted) {
      EXPECT_NEAR(s.rmse, wanted["rmse"].get<double>(), 1e-6);
      EXPECT_NEAR(s.mean, wanted["mean"].get<double>(), 1e-6);
      EXPECT_NEAR(s.median, wanted["median"].get<double>(), 1e-6);
      EXPECT_NEAR(s.sd, wanted["sd"].get<double>(), 1e-6);
      EXPECT_NEAR(s.min, wanted["min"].get<double>(), 1e-6);
      EXPECT_NEAR(s.max, wanted["max"].get<double>(), 1e-6);
    };
    expect_equal(e->absolute.statistics_m, expected["ate_m"]);
    expect_equal(e->relative.translation_m, expected["rpe_translation_m"]);
    expect_equal(e->relative.rotation_deg, expected["rpe_rotation_deg"]);
  }
}

TEST(EvoAgreement, OnSyntheticTrajectories) { expect_evo_numbers("tests/data/eval/synthetic_cases.json"); }
TEST(EvoAgreement, OnPublicTrajectories) { expect_evo_numbers("tests/data/eval/public_cases.json"); }

}  // namespace
}  // namespace semvslam
