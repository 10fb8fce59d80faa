#include "semvslam/map/map_file.h"

#include <fmt/format.h>
#include <libdeflate.h>

#include <algorithm>
#include <array>
#include <system_error>
#include <vector>

#include "semvslam/data/file_io.h"
#include "semvslam/map/byte_stream.h"
#include "semvslam/map/map_content.h"

namespace semvslam {
namespace {

// The first byte is no text; the line ends and the 0x1A show a file that was transferred as text.
constexpr std::array<std::uint8_t, 8> kMark = {0x8D, 'S', 'V', 'M', 'A', 'P', '\n', 0x1A};
constexpr std::size_t kHeaderBytes = kMark.size() + 2 * sizeof(std::uint32_t) + sizeof(std::uint64_t);

std::uint32_t checksum(const void* bytes, std::size_t size) { return libdeflate_crc32(0, bytes, size); }

/// What the first bytes of a file say. @param file_bytes the length of the whole file.
struct Header {
  std::uint32_t checksum = 0;

  static Result<Header> parse(std::span<const std::uint8_t> beginning, std::uint64_t file_bytes,
                              const std::string& name) {
    const auto invalid = [&](const std::string& what) { return Error{ErrorCode::kInvalidInput, name + ": " + what}; };
    if (!std::ranges::equal(beginning.first(std::min(beginning.size(), kMark.size())),
                            std::span(kMark).first(std::min(beginning.size(), kMark.size()))))
      return invalid("is no map file (run --save-map writes them)");
    ByteReader reader(beginning.subspan(std::min(beginning.size(), kMark.size())));
    const auto version = reader.get<std::uint32_t>();
    Header header{reader.get<std::uint32_t>()};
    const auto content_bytes = reader.get<std::uint64_t>();
    if (reader.ended()) return invalid("the map file breaks off in its first bytes");
    if (version != kMapFileVersion)
      return invalid(fmt::format("is a map file of version {}, this program reads version {}{}", version,
                                 kMapFileVersion, version > kMapFileVersion ? ": a newer program wrote it" : ""));
    const std::uint64_t there = file_bytes - kHeaderBytes;
    if (there < content_bytes)
      return invalid(fmt::format("the map file is truncated: {} of {} bytes are there", there, content_bytes));
    if (there > content_bytes)
      return invalid(fmt::format("the map file is damaged: {} bytes follow its end", there - content_bytes));
    return header;
  }
};

}  // namespace

std::string format_map(const Map& map) {
  const std::string content = format_map_content(map);
  ByteWriter header;
  for (const std::uint8_t byte : kMark) header.put(byte);
  header.put(kMapFileVersion);
  header.put(checksum(content.data(), content.size()));
  header.put(std::uint64_t{content.size()});
  return header.take() + content;
}

Result<Map> parse_map(std::span<const std::uint8_t> file, const std::string& name) {
  const Result<Header> header = Header::parse(file.first(std::min(file.size(), kHeaderBytes)), file.size(), name);
  if (!header) return header.error();
  const std::span<const std::uint8_t> content = file.subspan(kHeaderBytes);
  if (checksum(content.data(), content.size()) != header->checksum)
    return Error{ErrorCode::kInvalidInput, name + ": the map file is damaged (checksum); save the map again"};
  return parse_map_content(content, name);
}

Result<Map> read_map(const std::filesystem::path& path) {
  std::vector<std::uint8_t> bytes;
  if (Status s = read_binary_file(path, bytes, kHeaderBytes); !s) return s.error();
  std::error_code code;
  const std::uintmax_t size = std::filesystem::file_size(path, code);
  if (code) return Error{ErrorCode::kIo, fmt::format("{}: cannot read: {}", path.string(), code.message())};
  if (const Result<Header> header = Header::parse(bytes, size, path.string()); !header) return header.error();
  if (Status s = read_binary_file(path, bytes); !s) return s.error();
  return parse_map(bytes, path.string());
}

Status write_map(const std::filesystem::path& path, const Map& map) {
  return write_file_atomically(path, format_map(map));
}

}  // namespace semvslam
