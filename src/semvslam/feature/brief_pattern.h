#pragma once

#include <array>
#include <cstdint>

namespace semvslam {

/// Every test point lies within this distance of the corner, in pixels of its level, before and after rotation.
constexpr int kBriefRadius = 15;

/// One binary test: is the blurred patch darker at a than at b? Offsets from the corner in pixels, y down, angle 0.
struct BriefTest {
  std::int8_t ax, ay, bx, by;
};

/// The 256 tests. Learned by learn_brief_pattern.cc on generated images; says there how. A change makes descriptors of
/// before and after incomparable, and with them every stored map and vocabulary.
const std::array<BriefTest, 256>& brief_pattern();

}  // namespace semvslam
