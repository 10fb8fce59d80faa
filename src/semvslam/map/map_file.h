#pragma once

#include <cstdint>
#include <filesystem>
#include <span>
#include <string>

#include "semvslam/base/result.h"
#include "semvslam/map/map.h"

namespace semvslam {

/// Of the files that write_map() writes; read_map() reads no other.
inline constexpr std::uint32_t kMapFileVersion = 1;

/// A map file: a mark, the version, a checksum and the length of what follows, then format_map_content(). All numbers
/// are little-endian.
std::string format_map(const Map& map);

/// @param name of the file, for messages. Errors (kInvalidInput): no map file, one of another version, one that breaks
/// off, one whose checksum differs; as parse_map_content().
Result<Map> parse_map(std::span<const std::uint8_t> file, const std::string& name);

/// Reads a map file. A file of another kind is refused by its beginning, however large it is. Errors: missing,
/// unreadable; as parse_map().
Result<Map> read_map(const std::filesystem::path& path);

/// Replaces `path` in one step (see write_file_atomically).
Status write_map(const std::filesystem::path& path, const Map& map);

}  // namespace semvslam
