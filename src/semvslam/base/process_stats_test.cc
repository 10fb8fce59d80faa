#include "semvslam/base/process_stats.h"

#include <gtest/gtest.h>

#include <cmath>
#include <vector>

namespace semvslam {
namespace {

TEST(ProcessStats, CpuTimeGrowsWithWork) {
  const double before = process_cpu_seconds();
  double sink = 0;
  for (int i = 1; process_cpu_seconds() - before < 0.02; ++i) {
    for (int k = 0; k < 10000; ++k) sink += std::sqrt(static_cast<double>(i + k));
    ASSERT_LT(i, 10'000'000) << "CPU time stands still";
  }
  EXPECT_GT(sink, 0);
}

TEST(ProcessStats, PeakMemoryCoversAnAllocationAndStays) {
  constexpr std::int64_t kSize = 64 << 20;
  const std::int64_t before = resident_memory_bytes();
  ASSERT_GT(before, 0);
  {
    std::vector<char> block(kSize);
    for (volatile char& c : block) c = 1;  // volatile: a compiler may leave out an allocation that nobody looks at
    EXPECT_GT(resident_memory_bytes(), before + kSize / 2);
  }
  EXPECT_GT(peak_memory_bytes(), before + kSize / 2);
}

TEST(ProcessStats, AgeIsSmallAndGrows) {
  const double first = process_age_seconds();
  EXPECT_GE(first, 0.0);
  EXPECT_LT(first, 3600.0);
  EXPECT_GE(process_age_seconds(), first);
}

}  // namespace
}  // namespace semvslam
