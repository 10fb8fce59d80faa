#include "semvslam/base/side_task.h"

#include <utility>

namespace semvslam {

SideTask::~SideTask() {
  if (!thread_.joinable()) return;
  {
    std::lock_guard lock(mutex_);
    stop_ = true;
  }
  changed_.notify_all();
  thread_.join();
}

void SideTask::start(std::function<void()> work) {
  wait();
  {
    std::lock_guard lock(mutex_);
    work_ = std::move(work);
  }
  if (thread_.joinable())
    changed_.notify_all();
  else
    thread_ = std::thread([this] { run(); });
}

void SideTask::wait() {
  std::unique_lock lock(mutex_);
  changed_.wait(lock, [&] { return !work_; });
  if (failure_) std::rethrow_exception(std::exchange(failure_, nullptr));
}

void SideTask::run() {
  std::unique_lock lock(mutex_);
  for (;;) {
    changed_.wait(lock, [&] { return stop_ || work_; });
    if (!work_) return;
    lock.unlock();
    std::exception_ptr failure;
    try {
      work_();
    } catch (...) {
      failure = std::current_exception();
    }
    lock.lock();
    failure_ = failure;
    work_ = nullptr;
    changed_.notify_all();
  }
}

SideTaskGuard::~SideTaskGuard() {
  try {
    task_.wait();
  } catch (...) {  // the scope is being left for another reason
  }
}

}  // namespace semvslam
