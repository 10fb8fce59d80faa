#include "semvslam/data/png_decode.h"

#include <libdeflate.h>

#include <algorithm>
#include <optional>
#include <string_view>

#include "semvslam/data/png_unfilter.h"

namespace semvslam {
namespace {

constexpr std::uint8_t kSignature[8] = {0x89, 'P', 'N', 'G', '\r', '\n', 0x1A, '\n'};
constexpr std::size_t kHeaderBytes = 13, kChunkOverhead = 12;  // length, type, checksum
constexpr std::size_t kMaxDeflateRatio = 1032;                 // 258 bytes from 2 bits

Error truncated() { return invalid_input("the PNG is truncated"); }

std::uint32_t big_endian_32(const std::uint8_t* p) {
  return std::uint32_t{p[0]} << 24 | std::uint32_t{p[1]} << 16 | std::uint32_t{p[2]} << 8 | p[3];
}

struct Chunk {
  std::string_view type;
  ByteSpan data;
  std::size_t next = 0;  // where the next chunk begins
  bool critical() const { return type[0] >= 'A' && type[0] <= 'Z'; }
};

/// The chunk at `at`, its checksum verified when it is a critical one; nothing when the file ends before it does.
Result<std::optional<Chunk>> read_chunk(ByteSpan file, std::size_t at) {
  if (at > file.size() || file.size() - at < kChunkOverhead) return std::optional<Chunk>();
  const std::size_t length = big_endian_32(&file[at]);
  if (length > file.size() - at - kChunkOverhead) return std::optional<Chunk>();
  Chunk chunk{
      {reinterpret_cast<const char*>(&file[at + 4]), 4}, file.subspan(at + 8, length), at + kChunkOverhead + length};
  if (chunk.critical() && libdeflate_crc32(0, &file[at + 4], length + 4) != big_endian_32(&file[at + 8 + length]))
    return invalid_input("the PNG is corrupt (checksum)");
  return std::optional<Chunk>(chunk);
}

std::optional<PngColour> colour_of_type(int type) {
  switch (type) {
    case 0:
      return PngColour::kGray;
    case 2:
      return PngColour::kRgb;
    case 3:
      return PngColour::kPalette;
    case 4:
      return PngColour::kGrayAlpha;
    case 6:
      return PngColour::kRgba;
    default:
      return std::nullopt;
  }
}

bool is_plain(const PngHeader& h) {
  if (h.interlaced || h.colour == PngColour::kGrayAlpha) return false;
  return h.bits == 8 || (h.bits == 16 && h.colour == PngColour::kGray);
}

}  // namespace

int PngHeader::channels() const {
  switch (colour) {
    case PngColour::kGray:
    case PngColour::kPalette:
      return 1;
    case PngColour::kGrayAlpha:
      return 2;
    case PngColour::kRgb:
      return 3;
    case PngColour::kRgba:
      return 4;
  }
  return 0;
}

bool is_png(ByteSpan file) { return file.size() >= 8 && std::equal(kSignature, kSignature + 8, file.begin()); }

bool png_is_whole(ByteSpan file) {
  for (std::size_t at = 8;;) {
    const Result<std::optional<Chunk>> chunk = read_chunk(file, at);
    if (!chunk || !chunk->has_value()) return false;
    if ((*chunk)->type == "IEND") return true;
    at = (*chunk)->next;
  }
}

Result<PngHeader> read_png_header(ByteSpan file) {
  if (!is_png(file)) return invalid_input("not a PNG file");
  const Result<std::optional<Chunk>> chunk = read_chunk(file, 8);
  if (!chunk) return chunk.error();
  if (!chunk->has_value()) return truncated();
  const Chunk& c = **chunk;
  if (c.type != "IHDR" || c.data.size() != kHeaderBytes) return invalid_input("the PNG is corrupt (header)");
  PngHeader header;
  header.width_px = big_endian_32(&c.data[0]);
  header.height_px = big_endian_32(&c.data[4]);
  header.bits = c.data[8];
  const std::optional<PngColour> colour = colour_of_type(c.data[9]);
  header.interlaced = c.data[12] == 1;
  const bool known_bits =
      header.bits == 1 || header.bits == 2 || header.bits == 4 || header.bits == 8 || header.bits == 16;
  if (!colour || !known_bits || header.width_px - 1 > 0x7ffffffeu || header.height_px - 1 > 0x7ffffffeu ||
      c.data[10] != 0 || c.data[11] != 0 || c.data[12] > 1)
    return invalid_input("the PNG is corrupt (header)");
  header.colour = *colour;
  return header;
}

struct PngDecoder::Inflater {
  struct Free {
    void operator()(libdeflate_decompressor* d) const { libdeflate_free_decompressor(d); }
  };
  std::unique_ptr<libdeflate_decompressor, Free> decompressor{libdeflate_alloc_decompressor()};
};

PngDecoder::PngDecoder() : inflater_(std::make_unique<Inflater>()) {}
PngDecoder::~PngDecoder() = default;
PngDecoder::PngDecoder(PngDecoder&&) noexcept = default;
PngDecoder& PngDecoder::operator=(PngDecoder&&) noexcept = default;

Status PngDecoder::join_data(ByteSpan file) {
  joined_.clear();
  data_ = {};
  std::size_t pieces = 0;
  for (std::size_t at = 8;;) {
    const Result<std::optional<Chunk>> chunk = read_chunk(file, at);
    if (!chunk) return chunk.error();
    if (!chunk->has_value()) return truncated();
    const Chunk& c = **chunk;
    at = c.next;
    if (c.type == "IEND") break;
    if (c.type == "tRNS") return Error{ErrorCode::kUnsupported, "PNG with a transparency chunk"};
    if (c.type == "IDAT") {
      if (++pieces == 1) {
        data_ = c.data;
        continue;
      }
      if (pieces == 2) {
        joined_.reserve(file.size());
        joined_.assign(data_.begin(), data_.end());
      }
      joined_.insert(joined_.end(), c.data.begin(), c.data.end());
    } else if (c.critical() && c.type != "IHDR" && c.type != "PLTE") {
      return invalid_input("the PNG is corrupt (unknown critical chunk)");
    }
  }
  if (pieces > 1) data_ = joined_;
  return pieces == 0 ? Status(invalid_input("the PNG is corrupt (no image data)")) : Status::success();
}

Result<PngPixels> PngDecoder::decode(ByteSpan file) {
  const Result<PngHeader> header = read_png_header(file);
  if (!header) return header.error();
  if (!is_plain(*header)) return Error{ErrorCode::kUnsupported, "PNG of an unusual kind"};
  if (Status s = join_data(file); !s) return s.error();
  const std::size_t pixel_bytes = static_cast<std::size_t>(header->channels()) * header->bits / 8;
  const std::size_t stride = 1 + pixel_bytes * header->width_px;  // at most 2^33: no overflow
  if (stride > data_.size() * kMaxDeflateRatio / header->height_px) return truncated();
  rows_.resize(stride * header->height_px);
  // Without the size that came out, libdeflate demands that it be exactly this one.
  if (libdeflate_zlib_decompress(inflater_->decompressor.get(), data_.data(), data_.size(), rows_.data(), rows_.size(),
                                 nullptr) != LIBDEFLATE_SUCCESS)
    return invalid_input("the PNG is corrupt (compressed data)");
  zeros_.resize(std::max(zeros_.size(), stride));
  const std::uint8_t* above = zeros_.data();
  for (std::uint32_t y = 0; y < header->height_px; ++y) {
    std::uint8_t* row = rows_.data() + y * stride;
    if (!png_unfilter_row(row[0], row + 1, above, stride - 1, static_cast<int>(pixel_bytes)))
      return invalid_input("the PNG is corrupt (row filter)");
    above = row + 1;
  }
  return PngPixels{*header, rows_.data() + 1, stride};
}

}  // namespace semvslam
