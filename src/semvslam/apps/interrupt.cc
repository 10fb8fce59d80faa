#include "semvslam/apps/interrupt.h"

#include <atomic>

namespace semvslam {
namespace {

// A signal handler can reach nothing but static storage; a lock-free atomic is safe there.
std::atomic<int> received_signal = 0;
static_assert(std::atomic<int>::is_always_lock_free);

void remember(int signal) { received_signal = signal; }

}  // namespace

InterruptGuard::InterruptGuard() {
  received_signal = 0;
  struct sigaction action {};
  action.sa_handler = remember;
  action.sa_flags = SA_RESETHAND | SA_RESTART;  // the second one of its kind has the default effect
  sigemptyset(&action.sa_mask);
  sigaction(SIGINT, &action, &old_interrupt_);
  sigaction(SIGTERM, &action, &old_terminate_);
}

InterruptGuard::~InterruptGuard() {
  sigaction(SIGINT, &old_interrupt_, nullptr);
  sigaction(SIGTERM, &old_terminate_, nullptr);
}

int InterruptGuard::received() { return received_signal; }

}  // namespace semvslam
