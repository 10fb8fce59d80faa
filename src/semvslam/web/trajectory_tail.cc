#include "semvslam/web/trajectory_tail.h"

#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

#include <memory>
#include <string>

#include "semvslam/data/trajectory_io.h"

namespace semvslam {
namespace {

constexpr std::int64_t kMostBytes = std::int64_t{1} << 30;  // of a trajectory; as read_text_file() has it

/// Closes a descriptor at the end of its scope.
struct OpenFile {
  int descriptor;
  explicit OpenFile(const std::filesystem::path& file) : descriptor(::open(file.c_str(), O_RDONLY | O_CLOEXEC)) {}
  OpenFile(const OpenFile&) = delete;
  OpenFile& operator=(const OpenFile&) = delete;
  ~OpenFile() {
    if (descriptor >= 0) ::close(descriptor);
  }
};

/// The whole lines from `offset` on.
std::string lines_from(int descriptor, std::int64_t offset, std::int64_t size) {
  std::string text(static_cast<std::size_t>(size - offset), '\0');
  const ssize_t bytes = ::pread(descriptor, text.data(), text.size(), offset);
  text.resize(bytes > 0 ? static_cast<std::size_t>(bytes) : 0);
  text.erase(text.find_last_of('\n') + 1);
  return text;
}

}  // namespace

void TrajectoryTail::begin_anew() {
  poses_.clear();
  read_bytes_ = 0;
}

bool TrajectoryTail::update() {
  const OpenFile file(file_);
  struct stat info {};
  const bool is_there = file.descriptor >= 0 && ::fstat(file.descriptor, &info) == 0 && S_ISREG(info.st_mode);
  const ino_t inode = is_there ? info.st_ino : 0;
  const std::int64_t size = is_there && info.st_size <= kMostBytes ? info.st_size : 0;
  bool anew = false;
  if (inode != inode_ || size < read_bytes_) {
    begin_anew();
    inode_ = inode;
    anew = true;
  }
  const std::string lines = size > read_bytes_ ? lines_from(file.descriptor, read_bytes_, size) : std::string();
  const Result<ParsedTrajectory> parsed = parse_trajectory(lines, file_.string());
  if (!parsed || (!parsed->poses.empty() && !poses_.empty() && parsed->poses.front().stamp <= poses_.back().stamp)) {
    begin_anew();  // what can be said of such a file is said where it is read as a whole
    read_bytes_ = size;
    return true;
  }
  poses_.insert(poses_.end(), parsed->poses.begin(), parsed->poses.end());
  read_bytes_ += static_cast<std::int64_t>(lines.size());
  return anew;
}

}  // namespace semvslam
