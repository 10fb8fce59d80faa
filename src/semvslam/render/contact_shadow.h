#pragma once

#include <Eigen/Core>
#include <vector>

#include "semvslam/render/scene_builder.h"

namespace semvslam::render {

/// A ball that keeps light away from what is near.
struct Occluder {
  Eigen::Vector3d centre;
  double radius_m;
};

/// Darkens baked light around moving things: each ball takes away the share of the hemisphere that it covers, weighted
/// by the cosine (n . d) r^2 / d^2.
class ContactShadow {
 public:
  /// @param light the baked atlas; `current()` starts as its copy.
  explicit ContactShadow(const LightAtlas& light) : baked_(light), current_(light) {}
  void update(const std::vector<LightPatch>& patches, const std::vector<Occluder>& occluders);
  const LightAtlas& current() const { return current_; }

 private:
  LightAtlas baked_, current_;
  std::vector<std::size_t> touched_;  // patches that differ from the baked light
};

}  // namespace semvslam::render
