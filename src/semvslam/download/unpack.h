#pragma once

#include <cstdint>
#include <filesystem>
#include <functional>
#include <string>

#include "semvslam/base/result.h"

namespace semvslam {

/// Told how many bytes of the archive have been read; false stops it.
using UnpackProgress = std::function<bool(std::uint64_t read_bytes)>;

/// Unpacks an archive (tar, compressed or not, or zip) that holds one folder, which appears as `parent`/`folder` in one
/// step, when all of it is there. Nothing is written outside of it, whatever the archive says. Errors: kInvalidInput
/// for an archive that is none, breaks off, is damaged, holds something else than that folder or names a place outside;
/// kIo for a disk that refuses and where `progress` stopped it. What was unpacked until then is removed.
Status unpack(const std::filesystem::path& archive, const std::filesystem::path& parent, const std::string& folder,
              const UnpackProgress& progress);

/// SHA-256 in 64 hexadecimal digits. Errors: unreadable, or `progress` stopped it.
Result<std::string> sha256_of_file(const std::filesystem::path& file, const UnpackProgress& progress);

}  // namespace semvslam
