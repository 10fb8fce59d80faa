#pragma once

namespace semvslam {

/// Lets the calling thread give way to the others of this process, for work that others must not wait for. Where the
/// system knows no priority of single threads (only Linux does) nothing happens.
void lower_thread_priority();

}  // namespace semvslam
