#pragma once

#include <cstdint>
#include <filesystem>
#include <functional>
#include <optional>
#include <string>

#include "semvslam/base/result.h"

namespace semvslam {

/// Told how far a transfer is; false stops it. @param total_bytes none where the server does not say
using FetchProgress = std::function<bool(std::uint64_t done_bytes, std::optional<std::uint64_t> total_bytes)>;

struct FetchLimits {
  long connect_s = 30;  // to reach the server
  long silence_s = 60;  // without a byte
  int attempts = 3;     // each goes on where the one before broke off
};

/// Fetches a URL (http, https, file) to `path`. Until it is complete it is called `path`.part; where one is there
/// already the transfer goes on behind it, from the beginning if the server cannot do that. Redirections are followed;
/// proxies are taken from the environment, as curl does. Errors: kNotFound where the server has no such file, kIo for a
/// server that is not reached or breaks off, for a disk that refuses, and where `progress` stopped it; what has come
/// stays.
Status fetch(const std::string& url, const std::filesystem::path& path, const FetchProgress& progress,
             const FetchLimits& limits = {});

}  // namespace semvslam
