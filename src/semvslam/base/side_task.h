#pragma once

#include <condition_variable>
#include <exception>
#include <functional>
#include <mutex>
#include <thread>

namespace semvslam {

/// A second thread for a part of a step that the rest of it needs only later: runs one function at a time beside the
/// caller. start() and wait() belong to one thread. The thread begins with the first function and lives as long as
/// this object.
class SideTask {
 public:
  SideTask() = default;
  ~SideTask();  // waits for what was started
  SideTask(const SideTask&) = delete;
  SideTask& operator=(const SideTask&) = delete;

  /// Waits for what was started before.
  void start(std::function<void()> work);
  /// Until what was started is done; at once where nothing was. Throws what the function threw.
  void wait();

 private:
  void run();

  std::mutex mutex_;
  std::condition_variable changed_;
  std::function<void()> work_;  // empty = idle
  std::exception_ptr failure_;
  bool stop_ = false;
  std::thread thread_;
};

/// Holds the end of a scope until a task is done, also when an exception leaves it: for work on the scope's variables.
/// What the task threw is told by its wait() alone; where that was not called it is lost.
class SideTaskGuard {
 public:
  explicit SideTaskGuard(SideTask& task) : task_(task) {}
  ~SideTaskGuard();
  SideTaskGuard(const SideTaskGuard&) = delete;
  SideTaskGuard& operator=(const SideTaskGuard&) = delete;

 private:
  SideTask& task_;
};

}  // namespace semvslam
