#pragma once

#include <cstdint>
#include <filesystem>
#include <limits>
#include <string>
#include <string_view>
#include <vector>

#include "semvslam/base/result.h"

namespace semvslam {

/// A whole file as text. Errors: missing, a folder, unreadable, larger than `max_bytes` (a wrong file, not a list).
Result<std::string> read_text_file(const std::filesystem::path& path, std::size_t max_bytes = std::size_t{1} << 30);

/// A whole file as bytes into `bytes` (its memory is reused), or its first `at_most`. Errors as above; an empty file is
/// an Error too.
Status read_binary_file(const std::filesystem::path& path, std::vector<std::uint8_t>& bytes,
                        std::size_t at_most = std::numeric_limits<std::size_t>::max());

/// Replaces `path` by `content` in one step: readers see the old file or the new one, never a part, also after a crash
/// (a neighbouring temporary file is written, flushed to the disk, renamed). Errors: folder missing or not writable,
/// disk full; the old file is then untouched and the temporary one removed. A device or a pipe is written to, not
/// replaced.
Status write_file_atomically(const std::filesystem::path& path, std::string_view content);

/// Makes a folder and those above it; one that is there already is fine. Errors: not possible, a file of that name.
Status make_folder(const std::filesystem::path& path);

/// An open file descriptor for writing; closes on destruction. Every write reaches the operating system at once.
class OutputFile {
 public:
  OutputFile() = default;
  OutputFile(OutputFile&& other) noexcept;
  OutputFile& operator=(OutputFile&& other) noexcept;
  ~OutputFile();

  /// Creates or empties the file.
  static Result<OutputFile> create(const std::filesystem::path& path);
  bool is_open() const { return descriptor_ >= 0; }
  /// All of it or an Error; after an Error (disk full) the file is cut back to its length before the call, so that it
  /// never ends inside a record.
  Status write(std::string_view content);
  /// Waits until the content is on the disk.
  Status sync();
  Status close();
  const std::filesystem::path& path() const { return path_; }

 private:
  std::filesystem::path path_;
  int descriptor_ = -1;
  std::int64_t length_ = 0;
};

}  // namespace semvslam
