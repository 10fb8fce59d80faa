#include "semvslam/web/ply_reader.h"

#include <fmt/core.h>

#include <algorithm>
#include <bit>
#include <charconv>
#include <cstring>
#include <fstream>
#include <optional>
#include <string_view>
#include <vector>

#include "semvslam/base/foreign_text.h"
#include "semvslam/data/text_scan.h"

namespace semvslam {
namespace {

static_assert(std::endian::native == std::endian::little, "PLY files are read in the machine's byte order");

constexpr std::size_t kMostHeaderLines = 200, kMostLineBytes = 1000;
constexpr std::size_t kChunkBytes = 1 << 16;

struct Property {
  std::string name;
  std::size_t bytes = 0, offset = 0;
  bool real = false;
};

struct VertexLayout {
  std::size_t count = 0, bytes = 0;
  std::vector<Property> properties;

  const Property* find(std::string_view name) const {
    const auto at =
        std::find_if(properties.begin(), properties.end(), [&](const Property& p) { return p.name == name; });
    return at == properties.end() ? nullptr : &*at;
  }
};

struct ScalarType {
  std::string_view name, other_name;
  std::size_t bytes;
  bool real;
};
constexpr ScalarType kScalarTypes[] = {{"char", "int8", 1, false},    {"uchar", "uint8", 1, false},
                                       {"short", "int16", 2, false},  {"ushort", "uint16", 2, false},
                                       {"int", "int32", 4, false},    {"uint", "uint32", 4, false},
                                       {"float", "float32", 4, true}, {"double", "float64", 8, true}};

Error bad(const std::string& name, const std::string& what) {
  return {ErrorCode::kInvalidInput, fmt::format("{}: {}", name, what)};
}

std::optional<std::string> next_line(std::istream& in) {
  std::string line;
  for (char c = 0; line.size() <= kMostLineBytes && in.get(c);) {
    if (c == '\n') return line;
    if (c != '\r') line += c;
  }
  return std::nullopt;
}

Status add_property(const std::vector<std::string_view>& words, const std::string& name, VertexLayout& layout) {
  if (words.size() != 3) return bad(name, "only vertices of single numbers can be read, not lists");
  for (const ScalarType& type : kScalarTypes) {
    if (words[1] != type.name && words[1] != type.other_name) continue;
    layout.properties.push_back({std::string(words[2]), type.bytes, layout.bytes, type.real});
    layout.bytes += type.bytes;
    return Status::success();
  }
  return bad(name, fmt::format("unknown type of a property, {}", in_quotes(words[1])));
}

Status check(const VertexLayout& layout, const std::string& name) {
  for (const char* axis : {"x", "y", "z"})
    if (const Property* p = layout.find(axis); p == nullptr || !p->real)
      return bad(name, fmt::format("its vertices have no '{}' of type float or double", axis));
  return Status::success();
}

/// Reads up to and with end_header.
Result<VertexLayout> read_header(std::istream& in, const std::string& name) {
  if (next_line(in) != "ply") return bad(name, "is no PLY file");
  VertexLayout layout;
  bool in_vertices = false, seen_vertices = false, seen_format = false;
  for (std::size_t number = 0; number < kMostHeaderLines; ++number) {
    const std::optional<std::string> line = next_line(in);
    if (!line) break;
    const std::vector<std::string_view> words = split_words(*line);
    if (words.empty() || words[0] == "comment" || words[0] == "obj_info") continue;
    if (words[0] == "end_header") {
      if (!seen_format || !seen_vertices) return bad(name, "its header names no format or no vertices");
      if (Status status = check(layout, name); !status) return status.error();
      return layout;
    }
    if (words[0] == "format") {
      seen_format = words.size() > 1 && words[1] == "binary_little_endian";
      if (!seen_format) return bad(name, "only binary little-endian PLY files can be read");
    } else if (words[0] == "element") {
      in_vertices = words.size() == 3 && words[1] == "vertex";
      if (!in_vertices && !seen_vertices) return bad(name, "only files that begin with their vertices can be read");
      if (!in_vertices) continue;
      const auto [end, error] = std::from_chars(words[2].data(), words[2].data() + words[2].size(), layout.count);
      if (seen_vertices || error != std::errc() || end != words[2].data() + words[2].size())
        return bad(name, "its number of vertices cannot be understood");
      seen_vertices = true;
    } else if (words[0] == "property" && in_vertices) {
      if (Status status = add_property(words, name, layout); !status) return status.error();
    }
  }
  return bad(name, "its header has no end");
}

/// The bytes from here to the end of the file.
std::size_t bytes_left(std::istream& in) {
  const std::istream::pos_type here = in.tellg();
  in.seekg(0, std::ios::end);
  const std::istream::pos_type end = in.tellg();
  in.seekg(here);
  return in && end > here ? static_cast<std::size_t>(end - here) : 0;
}

float number_at(const char* record, const Property& property) {
  if (property.bytes == sizeof(float)) {
    float value;
    std::memcpy(&value, record + property.offset, sizeof value);
    return value;
  }
  double value;
  std::memcpy(&value, record + property.offset, sizeof value);
  return static_cast<float>(value);
}

/// How a record becomes a vertex.
struct VertexReader {
  std::array<const Property*, 3> axes{}, colours{};
  bool has_colours = true;

  explicit VertexReader(const VertexLayout& layout) {
    constexpr const char* kAxes[] = {"x", "y", "z"};
    constexpr const char* kColours[] = {"red", "green", "blue"};
    for (std::size_t i = 0; i < 3; ++i) {
      axes[i] = layout.find(kAxes[i]);
      colours[i] = layout.find(kColours[i]);
      has_colours = has_colours && colours[i] != nullptr && colours[i]->bytes == 1;
    }
  }
  PlyVertex operator()(const char* record) const {
    PlyVertex vertex;
    for (std::size_t i = 0; i < 3; ++i) {
      vertex.position_m[static_cast<Eigen::Index>(i)] = number_at(record, *axes[i]);
      if (has_colours) vertex.rgb[i] = static_cast<std::uint8_t>(record[colours[i]->offset]);
    }
    return vertex;
  }
};

}  // namespace

Result<PlyHeader> read_ply(std::istream& in, const std::string& name, const PlyVisitor& visit) {
  const Result<VertexLayout> layout = read_header(in, name);
  if (!layout) return layout.error();
  if (const std::size_t there = bytes_left(in) / layout->bytes; there < layout->count)
    return bad(name, fmt::format("the file is cut off: it holds {} of the {} vertices that its header promises", there,
                                 layout->count));
  const VertexReader vertex_of(*layout);
  const std::size_t records_at_once = std::max<std::size_t>(1, kChunkBytes / layout->bytes);
  std::vector<char> chunk(records_at_once * layout->bytes);
  for (std::size_t done = 0; done < layout->count;) {
    const std::size_t n = std::min(records_at_once, layout->count - done);
    if (!in.read(chunk.data(), static_cast<std::streamsize>(n * layout->bytes)))
      return Error{ErrorCode::kIo, name + ": cannot read"};
    for (std::size_t i = 0; i < n; ++i) visit(vertex_of(chunk.data() + i * layout->bytes));
    done += n;
  }
  return PlyHeader{layout->count, vertex_of.has_colours};
}

Result<PlyHeader> read_ply(const std::filesystem::path& file, const PlyVisitor& visit) {
  std::error_code unseen;  // what cannot be looked at cannot be opened either
  if (!std::filesystem::exists(file, unseen)) return Error{ErrorCode::kNotFound, file.string() + ": no such file"};
  if (!std::filesystem::is_regular_file(file, unseen)) return bad(file.string(), "is not a file");
  std::ifstream in(file, std::ios::binary);
  if (!in) return Error{ErrorCode::kIo, file.string() + ": cannot open"};
  return read_ply(in, file.string(), visit);
}

}  // namespace semvslam
