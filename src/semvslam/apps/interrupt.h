#pragma once

#include <csignal>

namespace semvslam {

/// While it lives, the first SIGINT or SIGTERM only asks to stop, so that everything computed can be written; a second
/// one ends the process at once. One object at a time.
class InterruptGuard {
 public:
  InterruptGuard();
  ~InterruptGuard();
  InterruptGuard(const InterruptGuard&) = delete;
  InterruptGuard& operator=(const InterruptGuard&) = delete;

  /// The signal that arrived; 0 = none.
  static int received();

 private:
  struct sigaction old_interrupt_ {
  }, old_terminate_{};
};

/// While it lives, SIGINT and SIGTERM do nothing but make a descriptor readable: for threads that wait for other
/// descriptors too. To be made before other threads are, which must not receive them.
class InterruptDescriptor {
 public:
  InterruptDescriptor();
  ~InterruptDescriptor();
  InterruptDescriptor(const InterruptDescriptor&) = delete;
  InterruptDescriptor& operator=(const InterruptDescriptor&) = delete;

  int descriptor() const { return descriptor_; }
  /// The signal that arrived; 0 = none. Does not wait.
  int received() const;

 private:
  sigset_t old_mask_{};
  int descriptor_ = -1;
};

}  // namespace semvslam
