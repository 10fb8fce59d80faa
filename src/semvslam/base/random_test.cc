#include "semvslam/base/random.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <numeric>
#include <stdexcept>

namespace semvslam {
namespace {

TEST(Random, SameSeedAndStreamGiveTheSameNumbers) {
  Random a(7, "pnp"), b(7, "pnp"), other_stream(7, "ba"), other_seed(8, "pnp");
  const std::uint64_t first = a();
  EXPECT_EQ(first, b());
  EXPECT_NE(first, other_stream());
  EXPECT_NE(first, other_seed());
}

// Fixed once: another platform, compiler or a later edit must not change them, or recorded experiments lose their
// meaning.
TEST(Random, NumbersNeverChange) {
  Random r(1, "fixed");
  EXPECT_EQ(r(), 0x87a52b91d8190afcull);
  EXPECT_EQ(r.index(1000), 532u);
  EXPECT_EQ(r.uniform(), 0x1.6219ba411efaap-2);
  EXPECT_EQ(r.normal(), -0x1.70c8097a6f018p-1);
}

TEST(Random, UniformIsInRangeWithTheRightMoments) {
  Random r(3);
  double sum = 0, squares = 0;
  constexpr int kCount = 200'000;
  for (int i = 0; i < kCount; ++i) {
    const double x = r.uniform(2, 4);
    ASSERT_GE(x, 2.0);
    ASSERT_LT(x, 4.0);
    sum += x, squares += x * x;
  }
  const double mean = sum / kCount;
  EXPECT_NEAR(mean, 3.0, 0.006);  // 5 sigma of the mean is 0.0065
  EXPECT_NEAR(squares / kCount - mean * mean, 4.0 / 12, 0.006);
}

TEST(Random, NormalHasTheRightMomentsAndTails) {
  Random r(4);
  constexpr int kCount = 200'000;
  double m1 = 0, m2 = 0, m4 = 0;
  int beyond_2_sigma = 0;
  for (int i = 0; i < kCount; ++i) {
    const double z = (r.normal(5, 3) - 5) / 3;
    m1 += z, m2 += z * z, m4 += z * z * z * z;
    beyond_2_sigma += std::abs(z) > 2;
  }
  EXPECT_NEAR(m1 / kCount, 0.0, 0.012);
  EXPECT_NEAR(m2 / kCount, 1.0, 0.016);
  EXPECT_NEAR(m4 / kCount, 3.0, 0.12);
  EXPECT_NEAR(static_cast<double>(beyond_2_sigma) / kCount, 0.0455, 0.0025);
}

TEST(Random, IndexIsUnbiasedAndRefusesZero) {
  Random r(5);
  std::vector<int> seen(7, 0);
  for (int i = 0; i < 70'000; ++i) ++seen.at(r.index(7));
  for (int n : seen) EXPECT_NEAR(n, 10'000, 500);
  EXPECT_EQ(r.index(1), 0u);
  EXPECT_THROW(r.index(0), std::logic_error);
}

TEST(Random, ShuffleIsAPermutation) {
  std::vector<int> items(50);
  std::iota(items.begin(), items.end(), 0);
  const std::vector<int> before = items;
  Random(6).shuffle(items);
  EXPECT_NE(items, before);
  EXPECT_THAT(items, ::testing::UnorderedElementsAreArray(before));
}

}  // namespace
}  // namespace semvslam
