#pragma once

#include <libdeflate.h>

#include <cstdint>
#include <cstdlib>
#include <string>
#include <vector>

namespace semvslam::testing_support {

using Bytes = std::vector<std::uint8_t>;

inline void put_32(Bytes& out, std::uint32_t v) {
  for (int shift : {24, 16, 8, 0}) out.push_back(static_cast<std::uint8_t>(v >> shift));
}

inline void put_chunk(Bytes& out, const std::string& type, const Bytes& data) {
  put_32(out, static_cast<std::uint32_t>(data.size()));
  const std::size_t begin = out.size();
  out.insert(out.end(), type.begin(), type.end());
  out.insert(out.end(), data.begin(), data.end());
  put_32(out, libdeflate_crc32(0, out.data() + begin, out.size() - begin));
}

inline Bytes zlib(const Bytes& data) {
  libdeflate_compressor* compressor = libdeflate_alloc_compressor(6);
  Bytes out(libdeflate_zlib_compress_bound(compressor, data.size()));
  out.resize(libdeflate_zlib_compress(compressor, data.data(), data.size(), out.data(), out.size()));
  libdeflate_free_compressor(compressor);
  return out;
}

struct PngRecipe {
  std::uint32_t width = 0, height = 0;
  int bits = 8, colour_type = 0, channels = 1;
  std::vector<int> filters = {0};      // of the rows, in turn
  std::size_t chunk_bytes = 1u << 30;  // of image data per chunk
  std::uint8_t interlace = 0;
};

/// The filters of the PNG specification in their plain wording, forwards.
inline Bytes filtered_rows(const PngRecipe& r, const Bytes& pixels) {
  const int bpp = r.channels * r.bits / 8;
  const std::size_t stride = static_cast<std::size_t>(bpp) * r.width;
  Bytes out;
  for (std::size_t y = 0; y < r.height; ++y) {
    const int filter = r.filters[y % r.filters.size()];
    out.push_back(static_cast<std::uint8_t>(filter));
    for (std::size_t i = 0; i < stride; ++i) {
      const bool has_left = i >= static_cast<std::size_t>(bpp);
      const int x = pixels[y * stride + i];
      const int a = has_left ? pixels[y * stride + i - bpp] : 0;
      const int b = y > 0 ? pixels[(y - 1) * stride + i] : 0;
      const int c = has_left && y > 0 ? pixels[(y - 1) * stride + i - bpp] : 0;
      const int p = a + b - c, pa = std::abs(p - a), pb = std::abs(p - b), pc = std::abs(p - c);
      const int paeth = pa <= pb && pa <= pc ? a : pb <= pc ? b : c;
      const int predictions[] = {0, a, b, (a + b) / 2, paeth};
      out.push_back(static_cast<std::uint8_t>(x - (filter < 5 ? predictions[filter] : 0)));
    }
  }
  return out;
}

inline Bytes make_png(const PngRecipe& r, const Bytes& pixels) {
  Bytes png = {0x89, 'P', 'N', 'G', '\r', '\n', 0x1A, '\n'};
  Bytes header;
  put_32(header, r.width);
  put_32(header, r.height);
  header.insert(header.end(),
                {static_cast<std::uint8_t>(r.bits), static_cast<std::uint8_t>(r.colour_type), 0, 0, r.interlace});
  put_chunk(png, "IHDR", header);
  if (r.colour_type == 3) put_chunk(png, "PLTE", Bytes(3 * 256, 77));
  const Bytes data = zlib(filtered_rows(r, pixels));
  for (std::size_t at = 0; at < data.size(); at += r.chunk_bytes)
    put_chunk(png, "IDAT", Bytes(data.begin() + at, data.begin() + std::min(data.size(), at + r.chunk_bytes)));
  put_chunk(png, "IEND", {});
  return png;
}

}  // namespace semvslam::testing_support
