#include "semvslam/base/newest_slot.h"

#include <gtest/gtest.h>

#include <memory>
#include <thread>
#include <vector>

namespace semvslam {
namespace {

TEST(NewestSlot, KeepsTheNewestAndCountsWhatItDropped) {
  NewestSlot<int> slot;
  EXPECT_FALSE(slot.try_take());
  EXPECT_TRUE(slot.put(1));
  EXPECT_TRUE(slot.put(2));
  EXPECT_TRUE(slot.put(3));
  EXPECT_EQ(slot.dropped(), 2u);
  EXPECT_EQ(slot.take(), 3);
  EXPECT_FALSE(slot.try_take());
}

TEST(NewestSlot, ClosedRefusesButGivesWhatIsLeft) {
  NewestSlot<std::unique_ptr<int>> slot;
  EXPECT_TRUE(slot.put(std::make_unique<int>(7)));
  slot.close();
  EXPECT_FALSE(slot.put(std::make_unique<int>(8)));
  const auto left = slot.take();
  ASSERT_TRUE(left);
  EXPECT_EQ(**left, 7);
  EXPECT_FALSE(slot.take());
}

TEST(NewestSlot, CloseWakesAWaitingReader) {
  NewestSlot<int> slot;
  std::optional<int> seen = 5;
  {
    std::jthread reader([&] { seen = slot.take(); });
    slot.close();
  }
  EXPECT_FALSE(seen);
}

TEST(NewestSlot, AReaderSeesRisingNumbersAndTheLastOne) {
  NewestSlot<int> slot;
  std::vector<int> seen;
  constexpr int kLast = 20000;
  {
    std::jthread reader([&] {
      while (const std::optional<int> n = slot.take()) seen.push_back(*n);
    });
    for (int n = 1; n <= kLast; ++n) slot.put(n);
    slot.close();
  }
  ASSERT_FALSE(seen.empty());
  EXPECT_EQ(seen.back(), kLast);
  for (std::size_t i = 1; i < seen.size(); ++i) ASSERT_LT(seen[i - 1], seen[i]);
  EXPECT_EQ(seen.size() + slot.dropped(), static_cast<std::size_t>(kLast));
}

}  // namespace
}  // namespace semvslam
