#include "semvslam/render/light_bake.h"

#include <algorithm>
#include <cmath>

#include "semvslam/render/parallel.h"

namespace semvslam::render {
namespace {

constexpr int kLeafFaces = 4;
constexpr float kLift_m = 0.012f;  // rays start above the surface: rugs and skirting do not blacken what they lie on
constexpr float kAmbientReach_m = 0.7f;
constexpr float kAmbient = 0.56f, kBounce = 0.14f;
constexpr int kAmbientRays = 8;

float brightness(const Colour4& c) { return 0.11f * c[0] + 0.59f * c[1] + 0.30f * c[2]; }

}  // namespace

ShadowTester::ShadowTester(const std::vector<Mesh>& meshes) {
  for (const Mesh& mesh : meshes) {
    for (const Triangle& t : mesh.triangles) {
      if (t.lighting == Lighting::kEmissive) continue;  // lamps do not shade themselves
      const Eigen::Vector3f a = mesh.vertices[t.corners[0].vertex].cast<float>();
      faces_.push_back({a, mesh.vertices[t.corners[1].vertex].cast<float>() - a,
                        mesh.vertices[t.corners[2].vertex].cast<float>() - a});
    }
  }
  nodes_.reserve(faces_.size());
  nodes_.emplace_back();
  nodes_.back().count = static_cast<std::int32_t>(faces_.size());
  if (!faces_.empty()) build(0, 0);
}

void ShadowTester::build(std::int32_t index, int depth) {
  const std::int32_t first = nodes_[index].first, count = nodes_[index].count;
  Eigen::Vector3f low = Eigen::Vector3f::Constant(1e9f), high = -low, centre_low = low, centre_high = high;
  for (std::int32_t i = first; i < first + count; ++i) {
    const Face& f = faces_[i];
    const Eigen::Vector3f b = f.corner + f.edge_1, c = f.corner + f.edge_2,
                          centre = f.corner + (f.edge_1 + f.edge_2) / 3;
    low = low.cwiseMin(f.corner).cwiseMin(b).cwiseMin(c);
    high = high.cwiseMax(f.corner).cwiseMax(b).cwiseMax(c);
    centre_low = centre_low.cwiseMin(centre);
    centre_high = centre_high.cwiseMax(centre);
  }
  nodes_[index].low = low;
  nodes_[index].high = high;
  if (count <= kLeafFaces || depth > 40) return;
  int axis = 0;
  (centre_high - centre_low).maxCoeff(&axis);
  auto key = [axis](const Face& f) { return f.corner[axis] + (f.edge_1[axis] + f.edge_2[axis]) / 3; };
  const std::int32_t half = count / 2;
  std::nth_element(faces_.begin() + first, faces_.begin() + first + half, faces_.begin() + first + count,
                   [&](const Face& a, const Face& b) { return key(a) < key(b); });
  const auto left = static_cast<std::int32_t>(nodes_.size());
  nodes_[index].left = left;
  nodes_.resize(nodes_.size() + 2);
  nodes_[left].first = first;
  nodes_[left].count = half;
  nodes_[left + 1].first = first + half;
  nodes_[left + 1].count = count - half;
  build(left, depth + 1);
  build(left + 1, depth + 1);
}

/// Moeller and Trumbore 1997; both sides count.
bool ShadowTester::hit(const Face& face, const Eigen::Vector3f& from, const Eigen::Vector3f& direction,
                       float reach_m) const {
  const Eigen::Vector3f p = direction.cross(face.edge_2);
  const float determinant = face.edge_1.dot(p);
  if (std::abs(determinant) < 1e-9f) return false;
  const float inverse = 1.f / determinant;
  const Eigen::Vector3f s = from - face.corner;
  const float u = s.dot(p) * inverse;
  if (u < 0.f || u > 1.f) return false;
  const Eigen::Vector3f q = s.cross(face.edge_1);
  const float v = direction.dot(q) * inverse;
  if (v < 0.f || u + v > 1.f) return false;
  const float t = face.edge_2.dot(q) * inverse;
  return t > 1e-4f && t < reach_m;
}

bool ShadowTester::blocked(const Eigen::Vector3f& from, const Eigen::Vector3f& direction, float reach_m) const {
  if (faces_.empty()) return false;
  const Eigen::Array3f inverse =
      direction.array().cwiseAbs().max(1e-9f).inverse() *
      (direction.array() < 0.f).select(Eigen::Array3f::Constant(-1.f), Eigen::Array3f::Constant(1.f));
  std::int32_t stack[64];
  int size = 0;
  stack[size++] = 0;
  while (size > 0) {
    const Node& node = nodes_[stack[--size]];
    const Eigen::Array3f a = (node.low - from).array() * inverse, b = (node.high - from).array() * inverse;
    const float enter = std::max(a.min(b).maxCoeff(), 0.f), leave = std::min(a.max(b).minCoeff(), reach_m);
    if (enter > leave) continue;
    if (node.left >= 0) {
      stack[size++] = node.left;
      stack[size++] = node.left + 1;
      continue;
    }
    for (std::int32_t i = node.first; i < node.first + node.count; ++i) {
      if (hit(faces_[i], from, direction, reach_m)) return true;
    }
  }
  return false;
}

LightModel::LightModel(const std::vector<AreaLight>& lights) {
  for (int i = 0; i < kAmbientRays; ++i) {  // a spiral
    const float r2 = (static_cast<float>(i) + 0.5f) / kAmbientRays, angle = 2.399963f * static_cast<float>(i);
    hemisphere_.emplace_back(std::sqrt(r2) * std::cos(angle), std::sqrt(r2) * std::sin(angle), std::sqrt(1 - r2));
  }
  for (const AreaLight& l : lights) {
    sources_.push_back({l.centre.cast<float>(), l.half_u.cast<float>(), l.half_v.cast<float>(), l.normal.cast<float>(),
                        l.radiance.cast<float>(), static_cast<float>(4 * l.half_u.norm() * l.half_v.norm())});
  }
}

Colour4 LightModel::at(const Eigen::Vector3d& position, const Eigen::Vector3d& normal_d,
                       const ShadowTester* tester) const {
  const Eigen::Vector3f normal = normal_d.cast<float>(), lifted = position.cast<float>() + normal * kLift_m;
  Eigen::Vector3f sum = Eigen::Vector3f::Zero();
  constexpr float kPlaces[4][2] = {{-0.6f, -0.3f}, {0.6f, 0.4f}, {0.3f, -0.7f}, {-0.3f, 0.6f}};
  for (const Source& light : sources_) {
    const Eigen::Vector3f to_middle = light.centre - lifted;
    const float middle = to_middle.squaredNorm();
    const int places = middle < 5 ? 4 : middle < 16 ? 2 : 1;  // far lamps are nearly points: fewer rays
    for (int i = 0; i < places; ++i) {
      Eigen::Vector3f to = to_middle;
      if (places > 1) to += kPlaces[i][0] * light.half_u + kPlaces[i][1] * light.half_v;
      const float distance = to.norm();
      const Eigen::Vector3f direction = to / distance;
      const float facing = normal.dot(direction), leaving = -light.normal.dot(direction);
      if (facing <= 0 || leaving <= 0) continue;
      const float strength =
          facing * leaving * light.area_m2 / (static_cast<float>(places * M_PI) * (distance * distance + 0.2f));
      if (strength * static_cast<float>(places) < 2e-3f) continue;
      if (tester && tester->blocked(lifted, direction, distance - 0.02f)) continue;
      sum += strength * light.radiance;
    }
  }
  float open = 1.f;
  if (tester) {
    const Eigen::Vector3f side = normal.unitOrthogonal(), other = normal.cross(side);
    int free = 0;
    for (const Eigen::Vector3f& d : hemisphere_) {
      free += !tester->blocked(lifted, d.x() * side + d.y() * other + d.z() * normal, kAmbientReach_m);
    }
    open = static_cast<float>(free) / kAmbientRays;
  }
  const float ambient = kBounce + kAmbient * open;
  Colour4 out{};
  const float tint[3] = {0.97f, 1.0f, 1.02f};
  for (int c = 0; c < 3; ++c) out[c] = std::sqrt(tint[c] * ambient + sum[c]);
  return out;
}

std::array<float, 6> LightModel::cube(const Eigen::Vector3d& position) const {
  std::array<float, 6> out;
  for (int i = 0; i < 6; ++i) {
    Eigen::Vector3d normal = Eigen::Vector3d::Zero();
    normal[i / 2] = i % 2 ? -1 : 1;
    out[i] = brightness(at(position, normal, nullptr));
  }
  return out;
}

void bake_light(StaticScene& scene, const LightModel& model, int threads) {
  const ShadowTester tester(scene.meshes);
  parallel_for(static_cast<int>(scene.patches.size()), threads, [&](int i, int) {
    const LightPatch& patch = scene.patches[i];
    for (int r = 0; r < patch.rows; ++r) {
      for (int c = 0; c < patch.columns; ++c) {
        // Values at the rim are taken a little inside, where neighbours do not touch.
        const double inset_c = std::clamp(static_cast<double>(c), 0.1, patch.columns - 1.1);
        const double inset_r = std::clamp(static_cast<double>(r), 0.1, patch.rows - 1.1);
        const Eigen::Vector3d p = patch.origin + inset_c * patch.column_step + inset_r * patch.row_step;
        scene.light.at(patch.column + c, patch.row + r) = model.at(p, patch.normal, &tester);
      }
    }
  });
  parallel_for(static_cast<int>(scene.vertex_normals.size()), threads, [&](int i, int) {
    const VertexNormals& part = scene.vertex_normals[i];
    Mesh& mesh = scene.meshes[part.mesh];
    std::vector<float> light(part.normals.size());
    for (std::size_t v = 0; v < light.size(); ++v) {
      light[v] = brightness(model.at(mesh.vertices[part.first_vertex + v], part.normals[v], &tester));
    }
    for (Triangle& t : mesh.triangles) {
      for (Corner& corner : t.corners) {
        if (corner.vertex < part.first_vertex || corner.vertex >= part.first_vertex + light.size()) continue;
        corner.light.x() = light[corner.vertex - part.first_vertex];
      }
    }
  });
}

}  // namespace semvslam::render
