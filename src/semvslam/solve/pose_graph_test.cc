#include "semvslam/solve/pose_graph.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <stdexcept>

#include "semvslam/base/random.h"

namespace semvslam {
namespace {

using Tangent = SE3::Tangent;

Tangent noise(Random& random, double sigma) {
  Tangent xi;
  for (int i = 0; i < 6; ++i) xi[i] = random.normal(0, sigma);
  return xi;
}

struct Ring {
  PoseGraphProblem problem;
  std::vector<SE3> truth;
};

// A walk around a circle with drifting odometry and, at the end, the measurement that closes it.
Ring ring(int n, double sigma, bool close = true) {
  Ring out;
  Random random(3, "ring");
  const double step = 2 * 3.14159265 / n;
  for (int i = 0; i < n; ++i) {
    const double a = step * i;
    out.truth.emplace_back(Eigen::Quaterniond(Eigen::AngleAxisd(a, Eigen::Vector3d::UnitY())),
                           Eigen::Vector3d(3 * std::cos(a), 0.2 * std::sin(3 * a), 3 * std::sin(a)));
  }
  PoseGraphProblem& p = out.problem;
  p.fixed.assign(static_cast<std::size_t>(n), 0);
  p.fixed[0] = 1;
  p.world_from_pose.push_back(out.truth[0]);
  const auto add = [&](std::uint32_t a, std::uint32_t b, double s) {
    PoseGraphProblem::Edge e;
    e.a = a;
    e.b = b;
    e.a_from_b = out.truth[a].inverse() * out.truth[b] * SE3::exp(noise(random, s));
    e.information /= std::max(s * s, 1e-8);
    p.edges.push_back(e);
    return e.a_from_b;
  };
  for (std::uint32_t i = 1; i < static_cast<std::uint32_t>(n); ++i)
    p.world_from_pose.push_back(p.world_from_pose.back() * add(i - 1, i, sigma));
  if (close) add(static_cast<std::uint32_t>(n - 1), 0, sigma * 0.1);
  return out;
}

double worst(const std::vector<SE3>& a, const std::vector<SE3>& b) {
  double w = 0;
  for (std::size_t i = 0; i < a.size(); ++i) w = std::max(w, (a[i].inverse() * b[i]).log().norm());
  return w;
}

TEST(PoseGraph, DerivativesMatchNumericOnes) {
  Random random(9, "pose graph");
  for (const double error : {0.0, 1e-6, 0.1, 1.0, 2.5}) {
    const SE3 a = SE3::exp(noise(random, 1)), measured = SE3::exp(noise(random, 1));
    Tangent xi = noise(random, 1);
    xi.tail<3>() *= error / xi.tail<3>().norm();
    const SE3 b = a * measured * SE3::exp(xi);
    const PoseGraphResidual r = pose_graph_residual(measured, a, b);
    EXPECT_LT((r.value - xi).norm(), 1e-9);
    const double h = 1e-6;
    for (int i = 0; i < 6; ++i) {
      const Tangent d = Tangent::Unit(i) * h;
      const Tangent by_b = (pose_graph_residual(measured, a, SE3::exp(d) * b).value -
                            pose_graph_residual(measured, a, SE3::exp(-d) * b).value) /
                           (2 * h);
      const Tangent by_a = (pose_graph_residual(measured, SE3::exp(d) * a, b).value -
                            pose_graph_residual(measured, SE3::exp(-d) * a, b).value) /
                           (2 * h);
      EXPECT_LT((by_b - r.by_b.col(i)).norm(), 1e-6 * (1 + r.by_b.norm())) << error << " " << i;
      EXPECT_LT((by_a + r.by_b.col(i)).norm(), 1e-6 * (1 + r.by_b.norm())) << error << " " << i;
    }
  }
}

TEST(PoseGraph, ExactMeasurementsGiveTheTruthFromAFarStart) {
  Ring r = ring(30, 0);
  Random random(4, "start");
  for (std::size_t i = 1; i < r.truth.size(); ++i)
    r.problem.world_from_pose[i] = SE3::exp(noise(random, 0.3)) * r.problem.world_from_pose[i];
  const PoseGraphSummary s = optimize_pose_graph(r.problem);
  EXPECT_TRUE(s.usable);
  EXPECT_LT(s.final_cost, 1e-12 * s.initial_cost);
  EXPECT_LT(worst(r.problem.world_from_pose, r.truth), 1e-5);
}

TEST(PoseGraph, ClosingTheLoopTakesOutTheDrift) {
  Ring r = ring(200, 0.01);
  const double before = worst(r.problem.world_from_pose, r.truth);
  const PoseGraphSummary s = optimize_pose_graph(r.problem);
  EXPECT_LT(worst(r.problem.world_from_pose, r.truth), 0.7 * before);
  const SE3 gap = r.problem.world_from_pose.back().inverse() * r.problem.world_from_pose.front();
  EXPECT_LT((gap.inverse() * (r.truth.back().inverse() * r.truth.front())).log().norm(), 0.01);
  EXPECT_LT(s.final_cost, 0.01 * s.initial_cost);
}

TEST(PoseGraph, EndsInAMinimum) {
  Ring r = ring(20, 0.05);
  const PoseGraphSummary s = optimize_pose_graph(r.problem);
  const auto cost = [&](const PoseGraphProblem& p) {
    double sum = 0;
    for (const auto& e : p.edges) {
      const Tangent v = pose_graph_residual(e.a_from_b, p.world_from_pose[e.a], p.world_from_pose[e.b]).value;
      sum += v.dot(e.information * v);
    }
    return sum;
  };
  EXPECT_NEAR(cost(r.problem), s.final_cost, 1e-9 * s.final_cost);
  for (std::size_t i = 1; i < 20; ++i) {
    for (int d = 0; d < 12; ++d) {
      PoseGraphProblem moved = r.problem;
      moved.world_from_pose[i] = SE3::exp((d % 2 ? 1e-4 : -1e-4) * Tangent::Unit(d / 2)) * moved.world_from_pose[i];
      EXPECT_GT(cost(moved), s.final_cost);
    }
  }
}

// Huber's loss bounds the pull of an edge: about 3.5 / 0.01 m here, against some metres / 0.01 m without it.
TEST(PoseGraph, TheRobustLossBoundsThePullOfAWrongLoop) {
  Ring r = ring(60, 0.005);
  PoseGraphProblem::Edge wrong;
  wrong.a = 10;
  wrong.b = 40;
  wrong.information *= 1e4;  // claims 1 cm, is metres off
  r.problem.edges.push_back(wrong);
  PoseGraphProblem plain = r.problem;
  optimize_pose_graph(plain);
  PoseGraphOptions robust;
  robust.huber_chi2 = 12.6;  // 95 % of chi^2 with 6 degrees of freedom
  robust.max_iterations = 200;
  optimize_pose_graph(r.problem, robust);
  EXPECT_GT(worst(plain.world_from_pose, r.truth), 1.0);
  EXPECT_LT(worst(r.problem.world_from_pose, r.truth), 0.33 * worst(plain.world_from_pose, r.truth));
}

TEST(PoseGraph, WhatIsNotConnectedToAFixedPoseStays) {
  Ring r = ring(10, 0.02);
  const std::size_t n = r.truth.size();
  r.problem.world_from_pose.push_back(SE3());
  r.problem.world_from_pose.emplace_back(Eigen::Quaterniond::Identity(), Eigen::Vector3d(1, 0, 0));
  r.problem.fixed.resize(n + 2, 0);
  PoseGraphProblem::Edge e;
  e.a = static_cast<std::uint32_t>(n);
  e.b = static_cast<std::uint32_t>(n + 1);
  r.problem.edges.push_back(e);
  EXPECT_TRUE(optimize_pose_graph(r.problem).usable);
  EXPECT_EQ(r.problem.world_from_pose[n + 1].translation(), Eigen::Vector3d(1, 0, 0));
}

TEST(PoseGraph, SameBytesTwice) {
  Ring a = ring(50, 0.02), b = ring(50, 0.02);
  optimize_pose_graph(a.problem);
  optimize_pose_graph(b.problem);
  for (std::size_t i = 0; i < a.truth.size(); ++i) {
    EXPECT_EQ(a.problem.world_from_pose[i].translation(), b.problem.world_from_pose[i].translation());
    EXPECT_EQ(a.problem.world_from_pose[i].rotation().coeffs(), b.problem.world_from_pose[i].rotation().coeffs());
  }
}

TEST(PoseGraph, RefusesAndThrows) {
  const Ring good = ring(10, 0.02);
  PoseGraphProblem floating = good.problem;
  floating.fixed.assign(10, 0);
  EXPECT_FALSE(optimize_pose_graph(floating).usable);
  PoseGraphProblem nan = good.problem;
  nan.edges[2].a_from_b = SE3(Eigen::Quaterniond::Identity(), Eigen::Vector3d(std::nan(""), 0, 0));
  EXPECT_FALSE(optimize_pose_graph(nan).usable);
  for (std::size_t i = 0; i < 10; ++i) EXPECT_TRUE(nan.world_from_pose[i].is_finite());
  PoseGraphProblem empty;
  EXPECT_FALSE(optimize_pose_graph(empty).usable);
  PoseGraphProblem outside = good.problem;
  outside.edges[0].b = 77;
  EXPECT_THROW(optimize_pose_graph(outside), std::invalid_argument);
  std::stop_source source;
  source.request_stop();
  PoseGraphProblem stopped = good.problem;
  EXPECT_TRUE(optimize_pose_graph(stopped, {}, source.get_token()).stopped);
}

}  // namespace
}  // namespace semvslam
