#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "semvslam/feature/features.h"

namespace semvslam {

/// Radius of the patch that orientation and descriptor see, in pixels of the corner's level.
constexpr int kPatchRadius = 15;

/// Direction from the patch's centre to its intensity centroid (Rosin, CVIU 1999; Rublee et al., ICCV 2011), in [0, 2
/// pi). A patch without direction has 0.
/// @param centre pixel of an unsmoothed level, at least kPatchRadius + 1 pixels from its border.
float patch_angle_rad(const std::uint8_t* centre, std::ptrdiff_t stride);

/// Rotated BRIEF: the tests of brief_pattern(), turned into the patch's direction in steps of 360 / kAngles degrees.
class OrientedBrief {
 public:
  /// 128 against 64 steps: 2 % more right matches on recordings; against exact angles: 1 % less, at a fraction of the
  /// time.
  static constexpr int kAngles = 128;

  OrientedBrief();
  /// Must be called before describe(): row stride of the smoothed image in bytes. Cheap when it did not change.
  void set_stride(std::ptrdiff_t stride);
  /// @param centre pixel of the smoothed level, at least kPatchRadius pixels from what is valid.
  Descriptor describe(const std::uint8_t* centre, float angle_rad) const;

 private:
  struct Point {
    std::int8_t x, y;
  };
  static constexpr std::size_t kPoints = 512;  // per angle: a0 b0 a1 b1 ...
  std::vector<Point> points_;
  std::vector<std::int32_t> offsets_;
  std::ptrdiff_t stride_ = 0;
};

}  // namespace semvslam
