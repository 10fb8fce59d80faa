#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <array>
#include <cstdint>
#include <functional>
#include <vector>

namespace semvslam::render {

/// A smooth body as the zero set of a blended sum of simple solids (negative inside, about metres near the surface).
/// Solids and smooth minimum after I. Quilez, "Distance functions" (formulas).
class ImplicitShape {
 public:
  /// A round cone from `a` to `b`. @param flat, flatness distances along unit vector `flat` count `flatness` times: > 1
  /// makes the cross-section an ellipse that is thin there.
  ImplicitShape& cone(const Eigen::Vector3f& a, float radius_a, const Eigen::Vector3f& b, float radius_b, float blend_m,
                      const Eigen::Vector3f& flat = Eigen::Vector3f::Zero(), float flatness = 1.f);
  ImplicitShape& ellipsoid(const Eigen::Vector3f& centre, const Eigen::Vector3f& radii, float blend_m,
                           const Eigen::Quaternionf& turn = Eigen::Quaternionf::Identity());
  /// Takes an ellipsoid away.
  ImplicitShape& carve(const Eigen::Vector3f& centre, const Eigen::Vector3f& radii, float blend_m);
  /// Keeps only what lies on the side of the plane that `normal` points away from.
  ImplicitShape& cut(const Eigen::Vector3f& point, const Eigen::Vector3f& normal);
  /// Folds: `displacement(p)` metres outwards.
  ImplicitShape& displace(std::function<float(const Eigen::Vector3f&)> displacement);

  float value(const Eigen::Vector3f& p) const;
  /// Unit outward normal by central differences.
  Eigen::Vector3f normal(const Eigen::Vector3f& p, float step_m = 0.002f) const;
  /// A box that holds the solid parts.
  Eigen::AlignedBox3f bounds() const;

 private:
  enum class Kind { kCone, kEllipsoid };
  struct Part {
    Kind kind;
    bool carved = false;
    float blend_m = 0;
    Eigen::Vector3f a, b, radii, flat;  // ellipsoid: a = centre
    float flatness = 1;
    Eigen::Quaternionf turn = Eigen::Quaternionf::Identity();
    Eigen::Vector3f middle;
    float reach_m = 0;  // of a sphere around `middle`
  };
  struct Plane {
    Eigen::Vector3f point, normal;
  };
  static float distance(const Part& part, const Eigen::Vector3f& p);

  std::vector<Part> parts_;
  std::vector<Plane> planes_;
  std::function<float(const Eigen::Vector3f&)> displacement_;
};

/// Triangles of a shape's surface.
struct ShapeMesh {
  std::vector<Eigen::Vector3f> vertices, normals;
  std::vector<std::array<std::uint32_t, 3>> triangles;  // counter-clockwise from outside
};

/// Naive surface nets (Gibson 1998) with the vertices pulled onto the surface. @param cell_m distance of the lattice.
ShapeMesh polygonise(const ImplicitShape& shape, float cell_m);

}  // namespace semvslam::render
