#pragma once

#include <condition_variable>
#include <deque>
#include <mutex>
#include <optional>

namespace semvslam {

/// First in, first out, at most `capacity` elements. push() BLOCKS while full; try_push() refuses. The end of a stream
/// is a closed queue: after close() pushes are refused and pops drain what is left, then return nothing. Any number of
/// threads.
template <typename T>
class BoundedQueue {
 public:
  explicit BoundedQueue(std::size_t capacity) : capacity_(capacity == 0 ? 1 : capacity) {}

  /// @return false when the queue is closed (the element is dropped).
  bool push(T element) {
    std::unique_lock lock(mutex_);
    not_full_.wait(lock, [&] { return closed_ || elements_.size() < capacity_; });
    if (closed_) return false;
    elements_.push_back(std::move(element));
    lock.unlock();
    not_empty_.notify_one();
    return true;
  }

  /// @return false when the queue is closed or full; `element` is then untouched.
  bool try_push(T& element) {
    {
      std::lock_guard lock(mutex_);
      if (closed_ || elements_.size() >= capacity_) return false;
      elements_.push_back(std::move(element));
    }
    not_empty_.notify_one();
    return true;
  }

  /// Waits for an element; nothing when the queue is closed and empty.
  std::optional<T> pop() {
    std::unique_lock lock(mutex_);
    not_empty_.wait(lock, [&] { return closed_ || !elements_.empty(); });
    if (elements_.empty()) return std::nullopt;
    std::optional<T> element(std::move(elements_.front()));
    elements_.pop_front();
    lock.unlock();
    not_full_.notify_one();
    return element;
  }

  /// Refuses further pushes and wakes every waiter. Elements inside can still be popped.
  void close() {
    {
      std::lock_guard lock(mutex_);
      closed_ = true;
    }
    not_empty_.notify_all();
    not_full_.notify_all();
  }

  std::size_t size() const {
    std::lock_guard lock(mutex_);
    return elements_.size();
  }

 private:
  const std::size_t capacity_;
  mutable std::mutex mutex_;
  std::condition_variable not_empty_, not_full_;
  std::deque<T> elements_;
  bool closed_ = false;
};

}  // namespace semvslam
