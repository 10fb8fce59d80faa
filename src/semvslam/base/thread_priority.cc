#include "semvslam/base/thread_priority.h"

#ifdef __linux__
#include <sys/resource.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#endif

namespace semvslam {

void lower_thread_priority() {
#ifdef __linux__
  constexpr int kSteps = 10, kLowest = 19;  // ten steps down: about a tenth of another thread's share of a core
  const auto thread = static_cast<id_t>(gettid());
  errno = 0;
  const int now = getpriority(PRIO_PROCESS, thread);
  if (errno == 0) setpriority(PRIO_PROCESS, thread, std::min(now + kSteps, kLowest));
#endif
}

}  // namespace semvslam
