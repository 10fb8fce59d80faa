#pragma once

#include <cstdint>

namespace semvslam {

/// CPU time that all threads of this process have used, user and system, in seconds.
double process_cpu_seconds();
/// Largest resident memory of this process so far, bytes; 0 where the system does not tell.
std::int64_t peak_memory_bytes();
/// Resident memory of this process now, bytes; 0 where the system does not tell.
std::int64_t resident_memory_bytes();

/// Seconds since this process started (to the system's clock tick, usually 10 ms); 0 where the system does not tell.
double process_age_seconds();

}  // namespace semvslam
