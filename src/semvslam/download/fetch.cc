#include "semvslam/download/fetch.h"

#include <curl/curl.h>
#include <fmt/format.h>

#include <cerrno>
#include <cstring>
#include <memory>
#include <system_error>

namespace semvslam {
namespace fs = std::filesystem;

namespace {

using File = std::unique_ptr<std::FILE, int (*)(std::FILE*)>;
using Handle = std::unique_ptr<CURL, void (*)(CURL*)>;

/// What the callbacks of one attempt share.
struct Attempt {
  std::FILE* file = nullptr;
  std::uint64_t begin = 0;  // bytes that were there before
  const FetchProgress* progress = nullptr;
  bool stopped = false;
  int disk_error = 0;
};

std::size_t take(char* data, std::size_t size, std::size_t count, void* attempt) {
  auto& a = *static_cast<Attempt*>(attempt);
  const std::size_t written = std::fwrite(data, 1, size * count, a.file);
  if (written != size * count) a.disk_error = errno;
  return written;
}

int tell(void* attempt, curl_off_t total, curl_off_t done, curl_off_t, curl_off_t) {
  auto& a = *static_cast<Attempt*>(attempt);
  std::optional<std::uint64_t> all;
  if (total > 0) all = a.begin + static_cast<std::uint64_t>(total);
  a.stopped = !(*a.progress)(a.begin + static_cast<std::uint64_t>(done), all);
  return a.stopped ? 1 : 0;
}

/// curl wants this once, before there are threads; it stays for the life of the process.
bool library_is_there() {
  static const bool ready = curl_global_init(CURL_GLOBAL_DEFAULT) == CURLE_OK;
  return ready;
}

enum class Outcome { kDone, kAgain, kAfresh, kFailed };

struct End {
  Outcome outcome = Outcome::kFailed;
  Error error{};
};

End judge(CURLcode code, long status, const Attempt& attempt, const std::string& url, const char* details) {
  const auto failed = [&](ErrorCode kind, const std::string& what) {
    return End{Outcome::kFailed, {kind, fmt::format("{}: {}", url, what)}};
  };
  if (code == CURLE_OK) return {Outcome::kDone};
  if (attempt.stopped) return failed(ErrorCode::kIo, "stopped");
  if (attempt.disk_error != 0) return failed(ErrorCode::kIo, std::strerror(attempt.disk_error));
  constexpr long kNothingBeyond = 416, kNoSuchFile = 404, kGone = 410;
  // Asked for what is behind all of it: nothing is missing. Whether it is what it should be, its checksum tells.
  if (code == CURLE_HTTP_RETURNED_ERROR && status == kNothingBeyond && attempt.begin > 0) return {Outcome::kDone};
  if (code == CURLE_RANGE_ERROR || code == CURLE_BAD_DOWNLOAD_RESUME) return {Outcome::kAfresh};
  if (code == CURLE_FILE_COULDNT_READ_FILE ||
      (code == CURLE_HTTP_RETURNED_ERROR && (status == kNoSuchFile || status == kGone)))
    return failed(ErrorCode::kNotFound, "there is no such file");
  if (code == CURLE_HTTP_RETURNED_ERROR) return failed(ErrorCode::kIo, fmt::format("the server answers {}", status));
  End end = failed(ErrorCode::kIo, *details != '\0' ? details : curl_easy_strerror(code));
  if (code == CURLE_PARTIAL_FILE || code == CURLE_OPERATION_TIMEDOUT || code == CURLE_RECV_ERROR ||
      code == CURLE_GOT_NOTHING || code == CURLE_COULDNT_CONNECT)
    end.outcome = Outcome::kAgain;
  return end;
}

End try_once(const std::string& url, const fs::path& part, const FetchProgress& progress, const FetchLimits& limits) {
  std::error_code ec;
  Attempt attempt{.progress = &progress};
  if (const std::uintmax_t size = fs::file_size(part, ec); !ec) attempt.begin = size;
  const File file(std::fopen(part.c_str(), "ab"), &std::fclose);
  if (!file) return {Outcome::kFailed, {ErrorCode::kIo, fmt::format("{}: {}", part.string(), std::strerror(errno))}};
  attempt.file = file.get();
  const Handle handle(curl_easy_init(), &curl_easy_cleanup);
  if (!handle || !library_is_there()) return {Outcome::kFailed, {ErrorCode::kInternal, "libcurl cannot be used"}};
  char details[CURL_ERROR_SIZE] = "";
  const auto set = [&](CURLoption option, auto value) { curl_easy_setopt(handle.get(), option, value); };
  set(CURLOPT_URL, url.c_str());
  set(CURLOPT_FOLLOWLOCATION, 1L);
  set(CURLOPT_MAXREDIRS, 10L);
  set(CURLOPT_FAILONERROR, 1L);
  set(CURLOPT_NOSIGNAL, 1L);
  set(CURLOPT_CONNECTTIMEOUT, limits.connect_s);
  set(CURLOPT_LOW_SPEED_LIMIT, 1L);
  set(CURLOPT_LOW_SPEED_TIME, limits.silence_s);
  set(CURLOPT_ERRORBUFFER, details);
  set(CURLOPT_USERAGENT, "semvslam");
  set(CURLOPT_RESUME_FROM_LARGE, static_cast<curl_off_t>(attempt.begin));
  set(CURLOPT_WRITEFUNCTION, &take);
  set(CURLOPT_WRITEDATA, &attempt);
  set(CURLOPT_NOPROGRESS, 0L);
  set(CURLOPT_XFERINFOFUNCTION, &tell);
  set(CURLOPT_XFERINFODATA, &attempt);
  const CURLcode code = curl_easy_perform(handle.get());
  if (code == CURLE_OK && std::fflush(file.get()) != 0) attempt.disk_error = errno;
  long status = 0;
  curl_easy_getinfo(handle.get(), CURLINFO_RESPONSE_CODE, &status);
  return judge(attempt.disk_error != 0 ? CURLE_WRITE_ERROR : code, status, attempt, url, details);
}

}  // namespace

Status fetch(const std::string& url, const fs::path& path, const FetchProgress& progress, const FetchLimits& limits) {
  fs::path part = path;
  part += ".part";
  std::error_code ec;
  End end;
  for (int attempt = 0; attempt < limits.attempts; ++attempt) {
    end = try_once(url, part, progress, limits);
    if (end.outcome == Outcome::kFailed) {
      if (fs::file_size(part, ec) == 0) fs::remove(part, ec);
      return end.error;
    }
    if (end.outcome == Outcome::kDone) {
      fs::rename(part, path, ec);
      if (ec) return Error{ErrorCode::kIo, fmt::format("{}: {}", path.string(), ec.message())};
      return Status::success();
    }
    if (end.outcome == Outcome::kAfresh) fs::resize_file(part, 0, ec);
  }
  if (end.outcome == Outcome::kAfresh) return Error{ErrorCode::kIo, fmt::format("{}: it cannot be gone on with", url)};
  return end.error;
}

}  // namespace semvslam
