#include "semvslam/dense/point_cloud.h"

#include <fmt/core.h>

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstring>

#include "semvslam/base/foreign_text.h"

namespace semvslam {
namespace {

static_assert(std::endian::native == std::endian::little, "clouds are written in the machine's byte order");

/// Of full saturation. Steps of the golden ratio along the circle of hues keep labels that are few far apart.
std::array<std::uint8_t, 3> colour_of(std::uint8_t label) {
  const float hue = std::fmod(static_cast<float>(label) * .618034f, 1.f);
  std::array<std::uint8_t, 3> rgb{};
  for (std::size_t k = 0; k < 3; ++k) {
    const float from_peak = std::abs(std::remainder(hue - static_cast<float>(k) / 3, 1.f));
    rgb[k] = static_cast<std::uint8_t>(std::lround(255 * std::clamp(2 - 6 * from_peak, 0.f, 1.f)));
  }
  return rgb;
}

/// The header, and after it what `pack` writes of each point to its record, at `to`.
template <typename Pack>
std::string records(std::string header, std::span<const CloudPoint> points, std::size_t record_bytes,
                    const Pack& pack) {
  const std::size_t begin = header.size();
  header.resize(begin + points.size() * record_bytes);
  char* to = header.data() + begin;
  for (const CloudPoint& p : points) {
    std::memcpy(to, p.position_m.data(), 3 * sizeof(float));
    pack(p, to + 3 * sizeof(float));
    to += record_bytes;
  }
  return header;
}

/// A line per label.
std::string comments(const std::string& begin, const std::optional<LabelNames>& names) {
  std::string out;
  for (const auto& [label, name] : names.value_or(LabelNames()))
    out += fmt::format("{} label {} {}\n", begin, label, in_quotes(name));
  return out;
}

}  // namespace

std::string format_ply(std::span<const CloudPoint> points, const std::optional<LabelNames>& names) {
  return records(fmt::format("ply\nformat binary_little_endian 1.0\ncomment dense map, metres\n{}element vertex {}\n"
                             "property float x\nproperty float y\nproperty float z\nproperty uchar red\n"
                             "property uchar green\nproperty uchar blue\n{}end_header\n",
                             comments("comment", names), points.size(), names ? "property uchar label\n" : ""),
                 points, 3 * sizeof(float) + (names ? 4 : 3), [&](const CloudPoint& p, char* to) {
                   std::memcpy(to, p.rgb.data(), p.rgb.size());
                   if (names) std::memcpy(to + p.rgb.size(), &p.label, 1);
                 });
}

std::string format_pcd(std::span<const CloudPoint> points, const std::optional<LabelNames>& names) {
  const auto with_label = [&](const char* fields, const char* of_label) {
    return names ? fmt::format("{} {}", fields, of_label) : std::string(fields);
  };
  return records(
      fmt::format("# .PCD v0.7 - dense map, metres\n{0}VERSION 0.7\nFIELDS {1}\nSIZE {2}\nTYPE {3}\nCOUNT {4}\n"
                  "WIDTH {5}\nHEIGHT 1\nVIEWPOINT 0 0 0 1 0 0 0\nPOINTS {5}\nDATA binary\n",
                  comments("#", names), with_label("x y z rgb", "label"), with_label("4 4 4 4", "4"),
                  with_label("F F F F", "U"), with_label("1 1 1 1", "1"), points.size()),
      points, (names ? 5 : 4) * sizeof(float), [&](const CloudPoint& p, char* to) {
        const std::uint32_t packed =
            static_cast<std::uint32_t>(p.rgb[0]) << 16 | static_cast<std::uint32_t>(p.rgb[1]) << 8 | p.rgb[2];
        const std::uint32_t label = p.label;
        std::memcpy(to, &packed, sizeof packed);
        if (names) std::memcpy(to + sizeof packed, &label, sizeof label);
      });
}

std::vector<CloudPoint> coloured_by_label(std::span<const CloudPoint> points) {
  std::vector<CloudPoint> out(points.begin(), points.end());
  for (CloudPoint& p : out) {
    if (p.label == 0)
      p.rgb.fill(static_cast<std::uint8_t>((p.rgb[0] + 2 * p.rgb[1] + p.rgb[2]) / 4));
    else
      p.rgb = colour_of(p.label);
  }
  return out;
}

}  // namespace semvslam
