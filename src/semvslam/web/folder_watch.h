#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "semvslam/base/result.h"

namespace semvslam {

/// Tells which files of a folder change (inotify). Waiting is the caller's: descriptor() is readable when there is
/// news.
class FolderWatch {
 public:
  /// Errors: no such folder, the system has no watches left.
  static Result<FolderWatch> create(const std::filesystem::path& folder);
  FolderWatch(FolderWatch&& other) noexcept;
  FolderWatch& operator=(FolderWatch&& other) noexcept;
  ~FolderWatch();

  int descriptor() const { return descriptor_; }
  /// Names of the files that were written to, made, replaced or removed since the last call, each once. An empty name:
  /// there were more changes than the system could keep, any file may have changed. Does not wait.
  std::vector<std::string> changed();

 private:
  explicit FolderWatch(int descriptor) : descriptor_(descriptor) {}
  int descriptor_ = -1;
};

}  // namespace semvslam
