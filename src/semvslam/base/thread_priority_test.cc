#include "semvslam/base/thread_priority.h"

#include <gtest/gtest.h>

#ifdef __linux__
#include <sys/resource.h>
#include <unistd.h>
#endif

#include <thread>

namespace semvslam {
namespace {

#ifdef __linux__
int own_priority() { return getpriority(PRIO_PROCESS, static_cast<id_t>(gettid())); }

TEST(ThreadPriority, OnlyTheCallingThreadGivesWay) {
  const int before = own_priority();
  if (before > 9) GTEST_SKIP() << "this process has a low priority already";
  int lowered = 0;
  std::jthread([&] {
    lower_thread_priority();
    lowered = own_priority();
  }).join();
  EXPECT_EQ(lowered, before + 10);
  EXPECT_EQ(own_priority(), before);
}
#endif

}  // namespace
}  // namespace semvslam
