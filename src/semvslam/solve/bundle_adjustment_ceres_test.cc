#include "semvslam/solve/bundle_adjustment_ceres.h"

#include <gtest/gtest.h>

#include <algorithm>

#include "semvslam/solve/bundle_adjustment.h"
#include "semvslam/solve/synthetic_test_scenes.h"

namespace semvslam {
namespace {

// The own solver and Ceres must end in the same minimum, whatever the kind of problem.
struct Kind {
  const char* name;
  double outlier_share, depth_outlier_share, depth_share;
  int fixed;
};
void PrintTo(const Kind& k, std::ostream* out) { *out << k.name; }

class AgainstCeres : public testing::TestWithParam<Kind> {
 protected:
  AgainstCeres() {
    synthetic::BundleOptions o;
    o.poses = 10;
    o.points = 250;
    o.edges_per_point = 5;
    o.fixed = GetParam().fixed;
    o.outlier_share = GetParam().outlier_share;
    o.depth_outlier_share = GetParam().depth_outlier_share;
    o.depth_share = GetParam().depth_share;
    own_ = ceres_ = synthetic::make_bundle(o).problem;
    options_.robust_iterations = options_.final_iterations = 60;
    options_.relative_cost_tolerance = 0;  // to the last digit
  }
  BaProblem own_, ceres_;
  BaOptions options_;
  std::vector<std::uint8_t> own_inlier_, ceres_inlier_;
};

TEST_P(AgainstCeres, SameMinimum) {
  const BaSummary own = adjust_bundle(own_, options_, own_inlier_);
  const BaSummary reference = adjust_bundle_ceres(ceres_, options_, ceres_inlier_);
  ASSERT_TRUE(own.usable);
  ASSERT_TRUE(reference.usable);
  EXPECT_NEAR(own.initial_cost, reference.initial_cost, 1e-9 * reference.initial_cost);
  EXPECT_NEAR(own.final_cost, reference.final_cost, 1e-6 * reference.final_cost);
  EXPECT_EQ(own_inlier_, ceres_inlier_);
  // A hundredth of the standard deviations, which are about 1e-3 for poses and 1e-2 m for points.
  for (std::size_t i = 0; i < own_.poses.size(); ++i)
    EXPECT_LT((own_.poses[i] * ceres_.poses[i].inverse()).log().norm(), 1e-5) << "pose " << i;
  for (std::size_t i = 0; i < own_.points.size(); ++i)
    EXPECT_LT((own_.points[i] - ceres_.points[i]).norm(), 1e-4) << "point " << i;
}

INSTANTIATE_TEST_SUITE_P(Kinds, AgainstCeres,
                         testing::Values(Kind{"clean", 0, 0, 0.8, 2}, Kind{"outliers", 0.05, 0.1, 0.8, 2},
                                         Kind{"without_depth", 0, 0, 0, 2}, Kind{"one_fixed", 0, 0.05, 1, 1},
                                         Kind{"all_but_one_fixed", 0.05, 0, 0.5, 9}),
                         [](const auto& kind) { return std::string(kind.param.name); });

}  // namespace
}  // namespace semvslam
