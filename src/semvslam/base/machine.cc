#include "semvslam/base/machine.h"

#include <sched.h>
#include <unistd.h>

#include <cstdlib>
#include <fstream>

namespace semvslam {
namespace {

std::string processor_name() {
  std::ifstream file("/proc/cpuinfo");
  for (std::string line; std::getline(file, line);) {
    const auto colon = line.find(':');
    // ARM has no model name in it.
    if (line.starts_with("model name") && colon != std::string::npos && colon + 2 <= line.size())
      return line.substr(colon + 2);
  }
  return {};
}

}  // namespace

Machine this_machine() {
  Machine out;
  out.processor = processor_name();
  cpu_set_t cores;
  if (sched_getaffinity(0, sizeof(cores), &cores) == 0) out.usable_cores = CPU_COUNT(&cores);
  const long pages = sysconf(_SC_PHYS_PAGES), page_bytes = sysconf(_SC_PAGESIZE);
  if (pages > 0 && page_bytes > 0) out.memory_bytes = static_cast<std::int64_t>(pages) * page_bytes;
  if (getloadavg(&out.load, 1) != 1) out.load = 0;
#if defined(__clang__)
  out.compiler = __VERSION__;
#else
  out.compiler = "GCC " __VERSION__;
#endif
  return out;
}

}  // namespace semvslam
