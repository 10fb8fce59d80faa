#include "semvslam/render/implicit.h"

#include <algorithm>
#include <cmath>

namespace semvslam::render {
namespace {

constexpr float kRim_m = 0.010f;  // rounding of cut edges

float smooth_min(float a, float b, float k) {
  const float h = std::max(k - std::abs(a - b), 0.f) / k;
  return std::min(a, b) - h * h * k * 0.25f;
}

}  // namespace

ImplicitShape& ImplicitShape::cone(const Eigen::Vector3f& a, float radius_a, const Eigen::Vector3f& b, float radius_b,
                                   float blend_m, const Eigen::Vector3f& flat, float flatness) {
  Part part{Kind::kCone, false,    std::max(blend_m, 1e-4f),       a,           b, {radius_a, radius_b, 0},
            flat,        flatness, Eigen::Quaternionf::Identity(), (a + b) / 2, 0};
  part.reach_m = (a - b).norm() / 2 + std::max(radius_a, radius_b) / std::min(1.f, flatness);
  parts_.push_back(part);
  return *this;
}

ImplicitShape& ImplicitShape::ellipsoid(const Eigen::Vector3f& centre, const Eigen::Vector3f& radii, float blend_m,
                                        const Eigen::Quaternionf& turn) {
  parts_.push_back({Kind::kEllipsoid, false, std::max(blend_m, 1e-4f), centre, centre, radii, Eigen::Vector3f::Zero(),
                    1, turn, centre, radii.maxCoeff()});
  return *this;
}

ImplicitShape& ImplicitShape::carve(const Eigen::Vector3f& centre, const Eigen::Vector3f& radii, float blend_m) {
  ellipsoid(centre, radii, blend_m);
  parts_.back().carved = true;
  return *this;
}

ImplicitShape& ImplicitShape::cut(const Eigen::Vector3f& point, const Eigen::Vector3f& normal) {
  planes_.push_back({point, normal.normalized()});
  return *this;
}

ImplicitShape& ImplicitShape::displace(std::function<float(const Eigen::Vector3f&)> displacement) {
  displacement_ = std::move(displacement);
  return *this;
}

float ImplicitShape::distance(const Part& part, const Eigen::Vector3f& p) {
  if (part.kind == Kind::kCone) {
    const Eigen::Vector3f along = part.b - part.a, from = p - part.a;
    const float h = std::clamp(from.dot(along) / std::max(along.squaredNorm(), 1e-12f), 0.f, 1.f);
    Eigen::Vector3f away = from - h * along;
    if (part.flatness != 1.f) away += part.flat * (away.dot(part.flat) * (part.flatness - 1.f));
    return away.norm() - (part.radii.x() + (part.radii.y() - part.radii.x()) * h);
  }
  const Eigen::Vector3f q = part.turn.conjugate() * (p - part.a);
  const float k0 = q.cwiseQuotient(part.radii).norm();
  const float k1 = q.cwiseQuotient(part.radii.cwiseProduct(part.radii)).norm();
  return k1 > 1e-6f ? k0 * (k0 - 1.f) / k1 : -part.radii.minCoeff();
}

float ImplicitShape::value(const Eigen::Vector3f& p) const {
  float sum = 1.f;
  for (const Part& part : parts_) {
    // A sphere around the part is a cheap lower bound: far parts cannot touch the value.
    const float bound = (p - part.middle).norm() - part.reach_m;
    if (part.carved) {
      if (bound > -sum + part.blend_m + 0.05f) continue;
      sum = -smooth_min(-sum, distance(part, p), part.blend_m);
    } else {
      if (bound > sum + part.blend_m) continue;
      sum = smooth_min(sum, distance(part, p), part.blend_m);
    }
  }
  if (displacement_ && std::abs(sum) < 0.08f) sum -= displacement_(p);
  for (const Plane& plane : planes_) sum = -smooth_min(-sum, -(p - plane.point).dot(plane.normal), kRim_m);
  return sum;
}

Eigen::Vector3f ImplicitShape::normal(const Eigen::Vector3f& p, float step_m) const {
  Eigen::Vector3f g;
  for (int i = 0; i < 3; ++i) {
    const Eigen::Vector3f d = step_m * Eigen::Vector3f::Unit(i);
    g[i] = value(p + d) - value(p - d);
  }
  const float norm = g.norm();
  return norm > 1e-12f ? Eigen::Vector3f(g / norm) : Eigen::Vector3f::UnitZ();
}

Eigen::AlignedBox3f ImplicitShape::bounds() const {
  Eigen::AlignedBox3f box;
  for (const Part& part : parts_) {
    if (part.carved) continue;
    Eigen::Vector3f reach = part.radii;
    if (part.kind == Kind::kCone)
      reach = Eigen::Vector3f::Constant(std::max(part.radii.x(), part.radii.y()) / std::min(1.f, part.flatness));
    if (part.kind == Kind::kEllipsoid && part.turn.w() < 0.9999f)
      reach = Eigen::Vector3f::Constant(part.radii.maxCoeff());
    for (const Eigen::Vector3f& p : {part.a, part.b}) {
      box.extend(Eigen::Vector3f(p - reach));
      box.extend(Eigen::Vector3f(p + reach));
    }
  }
  return box;
}

namespace {

/// Values on a lattice; blocks far from the surface get one value for all their nodes.
struct Lattice {
  Eigen::Vector3f origin;
  float cell_m;
  int nx, ny, nz;
  std::vector<float> values;

  std::size_t index(int x, int y, int z) const { return (static_cast<std::size_t>(z) * ny + y) * nx + x; }
  Eigen::Vector3f point(int x, int y, int z) const {
    return origin + cell_m * Eigen::Vector3f(static_cast<float>(x), static_cast<float>(y), static_cast<float>(z));
  }
};

Lattice sample(const ImplicitShape& shape, float cell_m) {
  constexpr int kBlock = 4;
  Eigen::AlignedBox3f box = shape.bounds();
  const Eigen::Vector3f margin = Eigen::Vector3f::Constant(2.5f * cell_m + 0.015f);
  Lattice lattice{box.min() - margin, cell_m, 0, 0, 0, {}};
  const Eigen::Vector3f size = (box.sizes() + 2 * margin) / cell_m;
  lattice.nx = static_cast<int>(size.x()) + 2;
  lattice.ny = static_cast<int>(size.y()) + 2;
  lattice.nz = static_cast<int>(size.z()) + 2;
  lattice.values.assign(static_cast<std::size_t>(lattice.nx) * lattice.ny * lattice.nz, 1.f);
  const float half = kBlock / 2.f * cell_m;
  for (int z = 0; z < lattice.nz; z += kBlock) {
    for (int y = 0; y < lattice.ny; y += kBlock) {
      for (int x = 0; x < lattice.nx; x += kBlock) {
        const float middle = shape.value(lattice.point(x, y, z) + Eigen::Vector3f::Constant(half));
        const bool far = std::abs(middle) > 2.2f * half * 1.7321f + 0.02f;
        for (int k = z; k < std::min(z + kBlock, lattice.nz); ++k) {
          for (int j = y; j < std::min(y + kBlock, lattice.ny); ++j) {
            for (int i = x; i < std::min(x + kBlock, lattice.nx); ++i) {
              lattice.values[lattice.index(i, j, k)] = far ? middle : shape.value(lattice.point(i, j, k));
            }
          }
        }
      }
    }
  }
  return lattice;
}

/// The mean of the points where the cell's edges cross the surface.
bool cell_vertex(const Lattice& lattice, int x, int y, int z, Eigen::Vector3f& out) {
  float v[8];
  int inside = 0;
  for (int c = 0; c < 8; ++c)
    inside += (v[c] = lattice.values[lattice.index(x + (c & 1), y + (c >> 1 & 1), z + (c >> 2))]) < 0;
  if (inside == 0 || inside == 8) return false;
  Eigen::Vector3f sum = Eigen::Vector3f::Zero();
  int count = 0;
  for (int c = 0; c < 8; ++c) {
    for (int axis = 0; axis < 3; ++axis) {
      const int d = c | 1 << axis;
      if (d == c || (v[c] < 0) == (v[d] < 0)) continue;
      Eigen::Vector3f p(static_cast<float>(c & 1), static_cast<float>(c >> 1 & 1), static_cast<float>(c >> 2));
      p[axis] += v[c] / (v[c] - v[d]);
      sum += p;
      ++count;
    }
  }
  out = lattice.point(x, y, z) + lattice.cell_m * sum / static_cast<float>(count);
  return true;
}

}  // namespace

ShapeMesh polygonise(const ImplicitShape& shape, float cell_m) {
  const Lattice lattice = sample(shape, cell_m);
  ShapeMesh mesh;
  std::vector<std::uint32_t> vertex_of(lattice.values.size(), 0xffffffffu);
  for (int z = 0; z + 1 < lattice.nz; ++z) {
    for (int y = 0; y + 1 < lattice.ny; ++y) {
      for (int x = 0; x + 1 < lattice.nx; ++x) {
        Eigen::Vector3f p;
        if (!cell_vertex(lattice, x, y, z, p)) continue;
        vertex_of[lattice.index(x, y, z)] = static_cast<std::uint32_t>(mesh.vertices.size());
        for (int i = 0; i < 2; ++i) {  // onto the surface, but not out of the cell's neighbourhood
          const float step = std::clamp(shape.value(p), -0.4f * cell_m, 0.4f * cell_m);
          p -= step * shape.normal(p, 0.25f * cell_m);
        }
        mesh.vertices.push_back(p);
        mesh.normals.push_back(shape.normal(p, 0.4f * cell_m));
      }
    }
  }
  auto quad = [&](std::uint32_t a, std::uint32_t b, std::uint32_t c, std::uint32_t d, bool flip) {
    if (std::max({a, b, c, d}) == 0xffffffffu) return;
    if (flip) std::swap(b, d);
    // The shorter diagonal follows creases better.
    if ((mesh.vertices[a] - mesh.vertices[c]).squaredNorm() < (mesh.vertices[b] - mesh.vertices[d]).squaredNorm()) {
      mesh.triangles.push_back({a, b, c});
      mesh.triangles.push_back({a, c, d});
    } else {
      mesh.triangles.push_back({a, b, d});
      mesh.triangles.push_back({b, c, d});
    }
  };
  for (int z = 1; z + 1 < lattice.nz; ++z) {
    for (int y = 1; y + 1 < lattice.ny; ++y) {
      for (int x = 1; x + 1 < lattice.nx; ++x) {
        const bool in = lattice.values[lattice.index(x, y, z)] < 0;
        auto at = [&](int i, int j, int k) { return vertex_of[lattice.index(i, j, k)]; };
        if (in != (lattice.values[lattice.index(x + 1, y, z)] < 0)) {
          quad(at(x, y - 1, z - 1), at(x, y, z - 1), at(x, y, z), at(x, y - 1, z), !in);
        }
        if (in != (lattice.values[lattice.index(x, y + 1, z)] < 0)) {
          quad(at(x - 1, y, z - 1), at(x - 1, y, z), at(x, y, z), at(x, y, z - 1), !in);
        }
        if (in != (lattice.values[lattice.index(x, y, z + 1)] < 0)) {
          quad(at(x - 1, y - 1, z), at(x, y - 1, z), at(x, y, z), at(x - 1, y, z), !in);
        }
      }
    }
  }
  return mesh;
}

}  // namespace semvslam::render
