#pragma once

#include <cstdint>
#include <string>

namespace semvslam {

/// What measurements of speed depend on. What the system does not tell is empty or zero.
struct Machine {
  std::string processor;  // name of the processor's model
  int usable_cores = 0;   // that this process may run on
  std::int64_t memory_bytes = 0;
  double load = 0;       // processes that ran or waited for a core, mean of the last minute
  std::string compiler;  // that built this program, with its version
};

Machine this_machine();

}  // namespace semvslam
