#pragma once

#include <cstdint>
#include <memory>
#include <span>
#include <vector>

#include "semvslam/base/result.h"

namespace semvslam {

using ByteSpan = std::span<const std::uint8_t>;

enum class PngColour { kGray, kRgb, kPalette, kGrayAlpha, kRgba };

struct PngHeader {
  std::uint32_t width_px = 0, height_px = 0;
  int bits = 0;  // per channel
  PngColour colour = PngColour::kGray;
  bool interlaced = false;
  int channels() const;
};

/// Whether the bytes begin like a PNG file.
bool is_png(ByteSpan file);

/// Whether the chunks of a PNG file follow one another, undamaged, up to its end mark. Libraries such as libpng behind
/// OpenCV return what they have of a file that breaks off.
bool png_is_whole(ByteSpan file);

/// The header of a PNG file. Errors: truncated, a wrong checksum, values that the format does not allow.
Result<PngHeader> read_png_header(ByteSpan file);

/// The pixels of a decoded PNG, in the file's channel order; 16-bit values are big endian. A view: see PngDecoder.
struct PngPixels {
  PngHeader header;
  const std::uint8_t* first = nullptr;
  std::size_t stride = 0;  // bytes from row to row
};

/// Decodes the plain PNG files of which recordings consist: 8-bit grey, RGB, RGBA and palette (as indices), 16-bit
/// grey, not interlaced, no transparency chunk; the rest is kUnsupported. Every checksum of the image data is looked
/// at, so that a truncated or damaged file is always an Error (kIo). Nothing is allocated before the file is long
/// enough to hold that much. Inflates the whole picture at once with libdeflate. Not thread-safe; keeps its memory.
class PngDecoder {
 public:
  PngDecoder();
  ~PngDecoder();
  PngDecoder(PngDecoder&&) noexcept;
  PngDecoder& operator=(PngDecoder&&) noexcept;

  /// The view is valid until the next call.
  Result<PngPixels> decode(ByteSpan file);

 private:
  struct Inflater;
  Status join_data(ByteSpan file);
  std::unique_ptr<Inflater> inflater_;
  std::vector<std::uint8_t> joined_;  // the data chunks in one piece, where there are several
  ByteSpan data_;
  std::vector<std::uint8_t> rows_;  // filter byte and pixels of every row
  std::vector<std::uint8_t> zeros_;
};

}  // namespace semvslam
