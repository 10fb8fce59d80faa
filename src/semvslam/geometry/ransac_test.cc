#include "semvslam/geometry/ransac.h"

#include <gtest/gtest.h>

#include <Eigen/Core>
#include <limits>

namespace semvslam {
namespace {

// y = m x + c through points of a plane.
struct LineProblem {
  struct Model {
    double m = 0, c = 0;
  };
  static constexpr int kSampleSize = 2;
  std::vector<Eigen::Vector2d> points;

  std::size_t size() const { return points.size(); }
  void hypotheses(const std::array<std::size_t, 2>& s, std::vector<Model>& out) const {
    const Eigen::Vector2d a = points[s[0]], d = points[s[1]] - a;
    if (d.x() == 0) return;
    out.push_back({d.y() / d.x(), a.y() - d.y() / d.x() * a.x()});
  }
  double squared_residual(const Model& l, std::size_t i) const {
    const double e = points[i].y() - l.m * points[i].x() - l.c;
    return e * e;
  }
};

LineProblem line(int inliers, int outliers) {
  LineProblem p;
  Random random(5, "line");
  for (int i = 0; i < inliers; ++i) p.points.emplace_back(i, 2.0 * i + 1 + random.normal(0, 0.01));
  for (int i = 0; i < outliers; ++i) p.points.emplace_back(random.uniform(0, 50), random.uniform(-200, 200));
  return p;
}

TEST(Ransac, FindsTheLineAmongMostlyOutliers) {
  const auto r = ransac(line(40, 60), 0.05 * 0.05, {});
  ASSERT_TRUE(r.found);
  EXPECT_NEAR(r.model.m, 2, 0.01);
  EXPECT_NEAR(r.model.c, 1, 0.1);
  EXPECT_GE(r.inliers, 38);
  EXPECT_EQ(r.inliers, std::count(r.inlier.begin(), r.inlier.end(), 1));
}

TEST(Ransac, SameSeedSameAnswer) {
  const LineProblem p = line(30, 60);
  RansacOptions options;
  options.seed = 77;
  const auto a = ransac(p, 0.01, options), b = ransac(p, 0.01, options);
  EXPECT_EQ(a.model.m, b.model.m);
  EXPECT_EQ(a.iterations, b.iterations);
  EXPECT_EQ(a.inlier, b.inlier);
}

TEST(Ransac, StopsEarlyOnCleanDataAndLateOnBad) {
  EXPECT_EQ(ransac(line(50, 0), 0.01, {}).iterations, 10);
  EXPECT_EQ(ransac_iterations(0.5, 3, 0.99, 1000), 35);  // log(0.01) / log(1 - 0.125), rounded up
  EXPECT_EQ(ransac_iterations(0.0, 3, 0.99, 1000), 1000);
  EXPECT_EQ(ransac_iterations(1.0, 3, 0.99, 1000), 1);
}

TEST(Ransac, NothingToFind) {
  EXPECT_FALSE(ransac(line(1, 0), 0.01, {}).found);
  LineProblem same;
  same.points.assign(10, Eigen::Vector2d(1, 1));
  EXPECT_FALSE(ransac(same, 0.01, {}).found);
  LineProblem nan;
  nan.points.assign(10, Eigen::Vector2d::Constant(std::numeric_limits<double>::quiet_NaN()));
  EXPECT_FALSE(ransac(nan, 0.01, {}).found);
}

}  // namespace
}  // namespace semvslam
