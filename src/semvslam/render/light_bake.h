#pragma once

#include <Eigen/Core>
#include <array>
#include <cstdint>
#include <vector>

#include "semvslam/render/room.h"
#include "semvslam/render/scene_builder.h"

namespace semvslam::render {

/// Answers whether something stands between two points: a bounding-volume tree over all triangles of the room.
class ShadowTester {
 public:
  explicit ShadowTester(const std::vector<Mesh>& meshes);
  /// @param direction unit length. True where a triangle lies in (0, reach_m) along it.
  bool blocked(const Eigen::Vector3f& from, const Eigen::Vector3f& direction, float reach_m) const;

 private:
  struct Node {
    Eigen::Vector3f low = Eigen::Vector3f::Zero(), high = Eigen::Vector3f::Zero();
    std::int32_t left = -1;  // the right child follows it; -1 = leaf
    std::int32_t first = 0, count = 0;
  };
  struct Face {
    Eigen::Vector3f corner, edge_1, edge_2;
  };
  void build(std::int32_t node, int depth);
  bool hit(const Face& face, const Eigen::Vector3f& from, const Eigen::Vector3f& direction, float reach_m) const;

  std::vector<Node> nodes_;
  std::vector<Face> faces_;
};

/// Light in a room: direct from lamps and windows, plus light from everywhere that near things keep away (ambient
/// occlusion).
class LightModel {
 public:
  explicit LightModel(const std::vector<AreaLight>& lights);

  /// Display-gamma factor per channel for a surface. @param tester nullptr = nothing throws shadows.
  Colour4 at(const Eigen::Vector3d& position, const Eigen::Vector3d& normal, const ShadowTester* tester) const;
  /// Brightness from the six directions +x, -x, +y, -y, +z, -z at a place in the open.
  std::array<float, 6> cube(const Eigen::Vector3d& position) const;

 private:
  struct Source {
    Eigen::Vector3f centre, half_u, half_v, normal, radiance;
    float area_m2;
  };
  std::vector<Source> sources_;
  std::vector<Eigen::Vector3f> hemisphere_;  // cosine-weighted directions, z = the normal
};

/// Fills the atlas and the vertices' brightness.
void bake_light(StaticScene& scene, const LightModel& model, int threads);

}  // namespace semvslam::render
