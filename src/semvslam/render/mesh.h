#pragma once

#include <Eigen/Core>
#include <array>
#include <cstdint>
#include <vector>

namespace semvslam::render {

/// Where the light of a triangle comes from.
enum class Lighting : std::uint8_t {
  kLightmap,  // corner.light = column and row in the atlas of baked light
  kVertex,    // corner.light[0] = brightness
  kEmissive,  // shines by itself: the texture as it is
};

struct Corner {
  std::uint32_t vertex = 0;
  Eigen::Vector2f uv = Eigen::Vector2f::Zero();     // texture coordinate, 1 = the whole image
  Eigen::Vector2f light = Eigen::Vector2f::Zero();  // see Lighting
};

/// Counter-clockwise seen from the front.
struct Triangle {
  std::array<Corner, 3> corners;
  std::uint16_t texture = 0;
  Lighting lighting = Lighting::kVertex;
  bool two_sided = false;
  bool continues = false;  // the same plane, texture and light as the triangle before: no edge between them
};

/// Triangles that move (or stand) together and belong to one role.
struct Mesh {
  std::vector<Eigen::Vector3d> vertices;  // world frame, metres
  std::vector<Triangle> triangles;
  std::uint8_t role = 0;  // 0 = room, else 1 + index of the role
  Eigen::Vector3d centre = Eigen::Vector3d::Zero();
  double radius_m = 0;  // of a sphere around `centre` that holds everything

  void update_bounds() {
    Eigen::Vector3d low = Eigen::Vector3d::Constant(1e9), high = -low;
    for (const auto& v : vertices) {
      low = low.cwiseMin(v);
      high = high.cwiseMax(v);
    }
    if (vertices.empty()) low = high = Eigen::Vector3d::Zero();
    centre = (low + high) / 2;
    radius_m = (high - low).norm() / 2;
  }
};

}  // namespace semvslam::render
