#include "semvslam/apps/interrupt.h"

#include <gtest/gtest.h>

#include <csignal>

namespace semvslam {
namespace {

TEST(InterruptGuard, RemembersTheFirstSignalAndStartsFresh) {
  {
    const InterruptGuard guard;
    EXPECT_EQ(InterruptGuard::received(), 0);
    std::raise(SIGTERM);
    EXPECT_EQ(InterruptGuard::received(), SIGTERM);
  }
  const InterruptGuard guard;
  EXPECT_EQ(InterruptGuard::received(), 0);
}

TEST(InterruptGuardDeathTest, TheSecondSignalEndsTheProcess) {
  EXPECT_EXIT(
      {
        const InterruptGuard guard;
        std::raise(SIGINT);
        std::raise(SIGINT);
      },
      ::testing::KilledBySignal(SIGINT), "");
}

TEST(InterruptGuard, GivesTheOldHandlersBack) {
  static int calls = 0;
  const auto old = std::signal(SIGINT, [](int) { ++calls; });
  { const InterruptGuard guard; }
  std::raise(SIGINT);
  std::signal(SIGINT, old);
  EXPECT_EQ(calls, 1);
}

TEST(InterruptDescriptor, HoldsASignalBackAndTellsIt) {
  const InterruptDescriptor descriptor;
  EXPECT_EQ(descriptor.received(), 0);
  std::raise(SIGTERM);
  EXPECT_EQ(descriptor.received(), SIGTERM);
  EXPECT_EQ(descriptor.received(), 0);
}

TEST(InterruptDescriptorDeathTest, AfterItSignalsEndTheProcessAgain) {
  EXPECT_EXIT(
      {
        { const InterruptDescriptor descriptor; }
        std::raise(SIGINT);
      },
      ::testing::KilledBySignal(SIGINT), "");
}

}  // namespace
}  // namespace semvslam
