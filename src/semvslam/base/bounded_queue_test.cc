#include "semvslam/base/bounded_queue.h"

#include <gtest/gtest.h>

#include <atomic>
#include <future>
#include <memory>
#include <numeric>
#include <thread>
#include <vector>

namespace semvslam {
namespace {

TEST(BoundedQueue, FirstInFirstOut) {
  BoundedQueue<int> queue(3);
  for (int i = 0; i < 3; ++i) ASSERT_TRUE(queue.push(i));
  for (int i = 0; i < 3; ++i) EXPECT_EQ(queue.pop(), i);
}

TEST(BoundedQueue, TryPushRefusesWhenFullAndLeavesTheElement) {
  BoundedQueue<std::unique_ptr<int>> queue(1);
  auto a = std::make_unique<int>(1), b = std::make_unique<int>(2);
  EXPECT_TRUE(queue.try_push(a));
  EXPECT_FALSE(queue.try_push(b));
  ASSERT_NE(b, nullptr);
  EXPECT_EQ(**queue.pop(), 1);
  EXPECT_TRUE(queue.try_push(b));
}

TEST(BoundedQueue, CapacityZeroBecomesOne) {
  BoundedQueue<int> queue(0);
  EXPECT_TRUE(queue.push(1));
  int second = 2;
  EXPECT_FALSE(queue.try_push(second));
}

TEST(BoundedQueue, ClosedQueueRefusesPushesAndDrains) {
  BoundedQueue<int> queue(4);
  ASSERT_TRUE(queue.push(1));
  ASSERT_TRUE(queue.push(2));
  queue.close();
  int third = 3;
  EXPECT_FALSE(queue.push(3));
  EXPECT_FALSE(queue.try_push(third));
  EXPECT_EQ(queue.pop(), 1);
  EXPECT_EQ(queue.pop(), 2);
  EXPECT_EQ(queue.pop(), std::nullopt);
  EXPECT_EQ(queue.size(), 0u);
}

TEST(BoundedQueue, PushBlocksUntilThereIsRoom) {
  BoundedQueue<int> queue(1);
  ASSERT_TRUE(queue.push(1));
  std::atomic<bool> pushed = false;
  std::jthread producer([&] {
    EXPECT_TRUE(queue.push(2));
    pushed = true;
  });
  EXPECT_EQ(queue.size(), 1u);
  EXPECT_FALSE(pushed);  // the queue is full: nothing but pop() can let the producer go on
  EXPECT_EQ(queue.pop(), 1);
  EXPECT_EQ(queue.pop(), 2);
}

TEST(BoundedQueue, CloseWakesBlockedProducersAndConsumers) {
  BoundedQueue<int> full(1), empty(1);
  ASSERT_TRUE(full.push(1));
  auto blocked_push = std::async(std::launch::async, [&] { return full.push(2); });
  auto blocked_pop = std::async(std::launch::async, [&] { return empty.pop(); });
  full.close();
  empty.close();
  EXPECT_FALSE(blocked_push.get());
  EXPECT_EQ(blocked_pop.get(), std::nullopt);
}

TEST(BoundedQueue, ManyProducersAndConsumersLoseAndDoubleNothing) {
  constexpr int kProducers = 3, kConsumers = 3, kEach = 2000;
  BoundedQueue<int> queue(5);
  std::vector<std::vector<int>> received(kConsumers);
  {
    std::vector<std::jthread> consumers;
    for (auto& mine : received)
      consumers.emplace_back([&queue, &mine] {
        while (const auto element = queue.pop()) mine.push_back(*element);
      });
    {
      std::vector<std::jthread> producers;
      for (int p = 0; p < kProducers; ++p)
        producers.emplace_back([&queue, p] {
          for (int i = 0; i < kEach; ++i) ASSERT_TRUE(queue.push(p * kEach + i));
        });
    }
    queue.close();
  }
  std::vector<int> seen(kProducers * kEach, 0);
  for (const auto& mine : received)
    for (int value : mine) ++seen.at(static_cast<std::size_t>(value));
  EXPECT_EQ(seen, std::vector<int>(kProducers * kEach, 1));
}

}  // namespace
}  // namespace semvslam
