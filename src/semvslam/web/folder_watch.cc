#include "semvslam/web/folder_watch.h"

#include <fmt/core.h>
#include <sys/inotify.h>
#include <unistd.h>

#include <array>
#include <cerrno>
#include <cstring>
#include <set>
#include <utility>

namespace semvslam {

Result<FolderWatch> FolderWatch::create(const std::filesystem::path& folder) {
  FolderWatch watch(::inotify_init1(IN_NONBLOCK | IN_CLOEXEC));
  constexpr std::uint32_t kEvents = IN_MODIFY | IN_CREATE | IN_MOVED_TO | IN_MOVED_FROM | IN_DELETE | IN_ONLYDIR;
  if (watch.descriptor_ >= 0 && ::inotify_add_watch(watch.descriptor_, folder.c_str(), kEvents) >= 0) return watch;
  const ErrorCode code = errno == ENOENT || errno == ENOTDIR ? ErrorCode::kNotFound : ErrorCode::kIo;
  return Error{code, fmt::format("{}: cannot watch this folder: {}", folder.string(), std::strerror(errno))};
}

FolderWatch::FolderWatch(FolderWatch&& other) noexcept : descriptor_(std::exchange(other.descriptor_, -1)) {}

FolderWatch& FolderWatch::operator=(FolderWatch&& other) noexcept {
  std::swap(descriptor_, other.descriptor_);
  return *this;
}

FolderWatch::~FolderWatch() {
  if (descriptor_ >= 0) ::close(descriptor_);
}

std::vector<std::string> FolderWatch::changed() {
  std::set<std::string> names;
  alignas(inotify_event) std::array<char, 4096> buffer;
  for (ssize_t bytes; (bytes = ::read(descriptor_, buffer.data(), buffer.size())) > 0;)
    for (const char* at = buffer.data(); at < buffer.data() + bytes;) {
      const auto* event = reinterpret_cast<const inotify_event*>(at);
      names.insert(event->len > 0 ? event->name : "");  // without a name: the queue overflowed, or the folder is gone
      at += sizeof(inotify_event) + event->len;
    }
  return {names.begin(), names.end()};
}

}  // namespace semvslam
