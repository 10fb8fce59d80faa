#include "semvslam/web/packing.h"

#include <algorithm>
#include <bit>
#include <cmath>

namespace semvslam {
namespace {

static_assert(std::endian::native == std::endian::little, "typed arrays are packed in the machine's byte order");

constexpr char kDigits[] = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
constexpr double kSteps = 65535;

template <typename T>
std::string packed_bytes(std::span<const T> numbers) {
  return base64({reinterpret_cast<const std::uint8_t*>(numbers.data()), numbers.size_bytes()});
}

}  // namespace

std::string base64(std::span<const std::uint8_t> bytes) {
  std::string out;
  out.reserve((bytes.size() + 2) / 3 * 4);
  for (std::size_t i = 0; i < bytes.size(); i += 3) {
    const std::size_t n = std::min<std::size_t>(3, bytes.size() - i);
    std::uint32_t group = 0;
    for (std::size_t k = 0; k < 3; ++k) group = group << 8 | (k < n ? bytes[i + k] : 0u);
    for (std::size_t k = 0; k < 4; ++k) out += k <= n ? kDigits[group >> (18 - 6 * k) & 63] : '=';
  }
  return out;
}

std::string packed(std::span<const float> numbers) { return packed_bytes(numbers); }
std::string packed(std::span<const std::uint16_t> numbers) { return packed_bytes(numbers); }

QuantisedPoints quantised(std::span<const Eigen::Vector3f> points_m) {
  QuantisedPoints out;
  if (points_m.empty()) return out;
  Eigen::Vector3f low = points_m.front(), high = low;
  for (const Eigen::Vector3f& p : points_m) low = low.cwiseMin(p), high = high.cwiseMax(p);
  out.origin_m = low.cast<double>();
  out.step_m = (high.cast<double>() - out.origin_m) / kSteps;
  out.grid.reserve(3 * points_m.size());
  for (const Eigen::Vector3f& p : points_m)
    for (int axis = 0; axis < 3; ++axis) {
      const double above = static_cast<double>(p[axis]) - out.origin_m[axis];
      out.grid.push_back(static_cast<std::uint16_t>(out.step_m[axis] > 0 ? std::round(above / out.step_m[axis]) : 0));
    }
  return out;
}

}  // namespace semvslam
