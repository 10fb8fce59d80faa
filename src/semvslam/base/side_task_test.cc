#include "semvslam/base/side_task.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <atomic>
#include <stdexcept>
#include <thread>
#include <vector>

namespace semvslam {
namespace {

TEST(SideTask, RunsBesideTheCallerAndIsWaitedFor) {
  SideTask task;
  task.wait();  // nothing was started
  std::atomic<bool> go = false;
  int done = 0;
  std::thread::id where;
  task.start([&] {
    go.wait(false);  // only the caller can let it go on
    where = std::this_thread::get_id();
    ++done;
  });
  go = true;
  go.notify_all();
  task.wait();
  EXPECT_EQ(done, 1);
  EXPECT_NE(where, std::this_thread::get_id());
}

TEST(SideTask, TakesOneAfterTheOtherOnTheSameThread) {
  SideTask task;
  std::vector<int> order;
  std::vector<std::thread::id> where;
  for (int i = 0; i < 100; ++i)
    task.start([&, i] {
      order.push_back(i);
      where.push_back(std::this_thread::get_id());
    });
  task.wait();
  ASSERT_EQ(order.size(), 100u);
  for (int i = 0; i < 100; ++i) EXPECT_EQ(order[static_cast<std::size_t>(i)], i);
  EXPECT_TRUE(std::all_of(where.begin(), where.end(), [&](std::thread::id id) { return id == where.front(); }));
}

TEST(SideTask, WhatItThrowsComesOutOnceAndItGoesOn) {
  SideTask task;
  task.start([] { throw std::runtime_error("no"); });
  EXPECT_THROW(task.wait(), std::runtime_error);
  task.wait();
  bool done = false;
  task.start([&] { done = true; });
  task.wait();
  EXPECT_TRUE(done);
}

TEST(SideTask, ItsEndWaits) {
  std::atomic<bool> done = false;
  {
    SideTask task;
    task.start([&] { done = true; });
  }
  EXPECT_TRUE(done);
}

TEST(SideTask, AGuardedScopeDoesNotEndBefore) {
  SideTask task;
  std::atomic<bool> left = false, done = false;
  const auto scope = [&] {
    const SideTaskGuard guard(task);
    task.start([&] {
      left.wait(false);
      done = true;
      throw std::runtime_error("nobody asks");
    });
    left = true;
    left.notify_all();
    throw std::logic_error("the scope's own");
  };
  EXPECT_THROW(scope(), std::logic_error);
  EXPECT_TRUE(done);
  task.wait();  // the guard has taken what it threw
}

}  // namespace
}  // namespace semvslam
