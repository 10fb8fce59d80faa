#pragma once

#include <sys/types.h>

#include <cstdint>
#include <filesystem>

#include "semvslam/data/frame.h"

namespace semvslam {

/// Follows a trajectory file that grows. Reads only what was appended, whole lines of it.
class TrajectoryTail {
 public:
  explicit TrajectoryTail(std::filesystem::path file) : file_(std::move(file)) {}

  /// Takes over what was appended. Where the file is another one than before (replaced, cut, removed) or holds what is
  /// no pose, poses() begins anew with what there is. @return whether it did
  bool update();
  const Trajectory& poses() const { return poses_; }

 private:
  void begin_anew();
  std::filesystem::path file_;
  Trajectory poses_;
  ino_t inode_ = 0;
  std::int64_t read_bytes_ = 0;  // all of them whole lines
};

}  // namespace semvslam
