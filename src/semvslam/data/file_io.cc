#include "semvslam/data/file_io.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <utility>

namespace semvslam {
namespace {

Error io_error(const std::filesystem::path& path, const char* doing, int code) {
  const ErrorCode kind = code == ENOENT || code == ENOTDIR ? ErrorCode::kNotFound : ErrorCode::kIo;
  return {kind, fmt::format("{}: {}: {}", path.string(), doing, std::strerror(code))};
}

/// Opens for reading and tells the size; a folder or a device is an Error.
struct InputFile {
  int descriptor = -1;
  std::size_t size = 0;
  InputFile() = default;
  InputFile(const InputFile&) = delete;
  InputFile& operator=(const InputFile&) = delete;
  ~InputFile() {
    if (descriptor >= 0) ::close(descriptor);
  }

  Status open(const std::filesystem::path& path) {
    descriptor = ::open(path.c_str(), O_RDONLY | O_CLOEXEC);
    if (descriptor < 0) return io_error(path, "cannot open", errno);
    struct stat info {};
    if (::fstat(descriptor, &info) != 0) return io_error(path, "cannot read", errno);
    if (!S_ISREG(info.st_mode)) return Error{ErrorCode::kInvalidInput, path.string() + ": is not a file"};
    size = static_cast<std::size_t>(info.st_size);
    return Status::success();
  }

  Status read(const std::filesystem::path& path, char* into, std::size_t bytes) const {
    std::size_t done = 0;
    while (done < bytes) {
      const ssize_t n = ::read(descriptor, into + done, bytes - done);
      if (n < 0 && errno == EINTR) continue;
      if (n < 0) return io_error(path, "cannot read", errno);
      if (n == 0) return Error{ErrorCode::kIo, path.string() + ": the file became shorter while it was read"};
      done += static_cast<std::size_t>(n);
    }
    return Status::success();
  }
};

}  // namespace

Result<std::string> read_text_file(const std::filesystem::path& path, std::size_t max_bytes) {
  InputFile file;
  if (Status s = file.open(path); !s) return s.error();
  if (file.size > max_bytes)
    return Error{ErrorCode::kInvalidInput,
                 fmt::format("{}: {} bytes are too many for a text file of this kind (at most {})", path.string(),
                             file.size, max_bytes)};
  std::string text(file.size, '\0');
  if (Status s = file.read(path, text.data(), text.size()); !s) return s.error();
  return text;
}

Status read_binary_file(const std::filesystem::path& path, std::vector<std::uint8_t>& bytes, std::size_t at_most) {
  InputFile file;
  if (Status s = file.open(path); !s) return s;
  if (file.size == 0) return Error{ErrorCode::kInvalidInput, path.string() + ": the file is empty"};
  bytes.resize(std::min(file.size, at_most));
  return file.read(path, reinterpret_cast<char*>(bytes.data()), bytes.size());
}

namespace {

Status write_through(const std::filesystem::path& path, std::string_view content) {
  Result<OutputFile> file = OutputFile::create(path);
  if (!file) return file.error();
  if (Status s = file->write(content); !s) return s;
  return file->close();
}

}  // namespace

Status write_file_atomically(const std::filesystem::path& path, std::string_view content) {
  std::error_code unseen;  // what cannot be looked at cannot be replaced either: said below
  const std::filesystem::file_status there = std::filesystem::status(path, unseen);
  if (std::filesystem::is_character_file(there) || std::filesystem::is_fifo(there)) return write_through(path, content);
  // The process id keeps two programs that write the same file apart.
  const std::filesystem::path temporary = fmt::format("{}.{}.part", path.string(), ::getpid());
  const auto fail = [&](const Error& error) {
    ::unlink(temporary.c_str());
    return Status(error);
  };
  Result<OutputFile> file = OutputFile::create(temporary);
  if (!file) return file.error();
  if (Status s = file->write(content); !s) return fail(s.error());
  if (Status s = file->sync(); !s) return fail(s.error());
  if (Status s = file->close(); !s) return fail(s.error());
  if (::rename(temporary.c_str(), path.c_str()) != 0) return fail(io_error(path, "cannot replace", errno));
  return Status::success();
}

Status make_folder(const std::filesystem::path& path) {
  std::error_code code;
  std::filesystem::create_directories(path, code);
  std::error_code unseen;  // a folder that may not be looked at is none: `code` says why
  if (std::filesystem::is_directory(path, unseen)) return Status::success();
  return Error{ErrorCode::kIo, fmt::format("{}: cannot make the folder: {}", path.string(),
                                           code ? code.message() : "there is a file of that name")};
}

OutputFile::OutputFile(OutputFile&& other) noexcept
    : path_(std::move(other.path_)), descriptor_(std::exchange(other.descriptor_, -1)), length_(other.length_) {}

OutputFile& OutputFile::operator=(OutputFile&& other) noexcept {
  std::swap(path_, other.path_);
  std::swap(descriptor_, other.descriptor_);
  std::swap(length_, other.length_);
  return *this;
}

OutputFile::~OutputFile() {
  if (descriptor_ >= 0) ::close(descriptor_);
}

Result<OutputFile> OutputFile::create(const std::filesystem::path& path) {
  OutputFile file;
  file.path_ = path;
  file.descriptor_ = ::open(path.c_str(), O_WRONLY | O_CREAT | O_TRUNC | O_CLOEXEC, 0666);
  if (file.descriptor_ < 0) return io_error(path, "cannot write", errno);
  return file;
}

Status OutputFile::write(std::string_view content) {
  std::size_t done = 0;
  while (done < content.size()) {
    const ssize_t n = ::write(descriptor_, content.data() + done, content.size() - done);
    if (n < 0 && errno == EINTR) continue;
    if (n < 0) {
      const Error error = io_error(path_, "cannot write", errno);
      // Devices cannot be cut; then there is no file to keep whole either.
      if (done > 0 && ::ftruncate(descriptor_, length_) == 0) ::lseek(descriptor_, length_, SEEK_SET);
      return error;
    }
    done += static_cast<std::size_t>(n);
  }
  length_ += static_cast<std::int64_t>(content.size());
  return Status::success();
}

Status OutputFile::sync() {
  // EINVAL: a pipe or a device, which has nothing to sync.
  if (::fsync(descriptor_) != 0 && errno != EINVAL && errno != EROFS) return io_error(path_, "cannot write", errno);
  return Status::success();
}

Status OutputFile::close() {
  const int descriptor = std::exchange(descriptor_, -1);
  if (descriptor >= 0 && ::close(descriptor) != 0) return io_error(path_, "cannot write", errno);
  return Status::success();
}

}  // namespace semvslam
