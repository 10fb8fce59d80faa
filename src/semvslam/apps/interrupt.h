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

}  // namespace semvslam
