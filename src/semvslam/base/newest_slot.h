#pragma once

#include <condition_variable>
#include <mutex>
#include <optional>

namespace semvslam {

/// Holds one element. put() never blocks: it DROPS the element that nobody has taken yet, so that the reader, however
/// slow, always works on the newest. The end of a stream is a closed slot: put() is refused, take() gives the element
/// left and then nothing. Any number of threads.
template <typename T>
class NewestSlot {
 public:
  /// @return false when the slot is closed (the element is dropped).
  bool put(T element) {
    {
      std::lock_guard lock(mutex_);
      if (closed_) return false;
      if (element_) ++dropped_;
      element_ = std::move(element);
    }
    filled_.notify_one();
    return true;
  }

  /// Waits for an element; nothing when the slot is closed and empty.
  std::optional<T> take() {
    std::unique_lock lock(mutex_);
    filled_.wait(lock, [&] { return closed_ || element_; });
    return take_locked();
  }

  /// Does not wait.
  std::optional<T> try_take() {
    std::lock_guard lock(mutex_);
    return take_locked();
  }

  void close() {
    {
      std::lock_guard lock(mutex_);
      closed_ = true;
    }
    filled_.notify_all();
  }

  /// Elements that were replaced before anybody took them.
  std::size_t dropped() const {
    std::lock_guard lock(mutex_);
    return dropped_;
  }

 private:
  std::optional<T> take_locked() {
    std::optional<T> element = std::move(element_);
    element_.reset();
    return element;
  }

  mutable std::mutex mutex_;
  std::condition_variable filled_;
  std::optional<T> element_;
  std::size_t dropped_ = 0;
  bool closed_ = false;
};

}  // namespace semvslam
