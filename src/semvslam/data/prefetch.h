#pragma once

#include <cstddef>
#include <memory>

#include "semvslam/data/frame.h"

namespace semvslam {

/// Reads `source` ahead in a thread of its own, at most `capacity` frames (at least one) beside the one being read, so
/// that disk and decompression never stand in the time of who calls next(). Frames and errors come in the source's
/// order; a fatal error or the end is the last thing that comes. An exception of the source becomes a fatal Error.
/// Destruction at any time stops after the frame being read. One thread may call next() at a time.
std::unique_ptr<FrameSource> prefetch(std::unique_ptr<FrameSource> source, std::size_t capacity);

}  // namespace semvslam
