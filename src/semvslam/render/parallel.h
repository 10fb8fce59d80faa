#pragma once

#include <algorithm>
#include <atomic>
#include <exception>
#include <functional>
#include <mutex>
#include <thread>
#include <vector>

namespace semvslam::render {

/// Calls body(i, worker) for i in [0, count) on `threads` threads; worker in [0, threads). The calls must not depend on
/// each other, so the result does not depend on the number of threads. The first exception is rethrown here.
template <typename Body>
void parallel_for(int count, int threads, Body&& body) {
  threads = std::clamp(threads, 1, std::max(count, 1));
  if (threads == 1) {
    for (int i = 0; i < count; ++i) body(i, 0);
    return;
  }
  std::atomic<int> next{0};
  std::exception_ptr failure;
  std::mutex failure_mutex;
  auto work = [&](int worker) {
    try {
      for (int i = next++; i < count; i = next++) body(i, worker);
    } catch (...) {
      std::lock_guard lock(failure_mutex);
      if (!failure) failure = std::current_exception();
    }
  };
  {
    std::vector<std::jthread> helpers;
    helpers.reserve(threads - 1);
    for (int worker = 1; worker < threads; ++worker) helpers.emplace_back(work, worker);
    work(0);
  }
  if (failure) std::rethrow_exception(failure);
}

}  // namespace semvslam::render
