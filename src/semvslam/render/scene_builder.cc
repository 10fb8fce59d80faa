#include "semvslam/render/scene_builder.h"

#include <algorithm>
#include <cmath>
#include <optional>

#include "semvslam/render/parallel.h"

namespace semvslam::render {
namespace {

constexpr int kAtlasWidth = 1024;
constexpr int kMaxPatchSide = 160;

Eigen::Vector2f texture_coordinate(const Skin& skin, double along_u_m, double along_v_m, double u_size_m,
                                   double v_size_m) {
  double a = along_u_m, b = along_v_m, a_size = u_size_m, b_size = v_size_m;
  if (skin.turned) {
    std::swap(a, b);
    std::swap(a_size, b_size);
  }
  const double width = skin.image_size_m.x() > 0 ? skin.image_size_m.x() : a_size;
  const double height = skin.image_size_m.y() > 0 ? skin.image_size_m.y() : b_size;
  return {static_cast<float>((a + skin.offset_m.x()) / width),
          static_cast<float>(1.0 - (b + skin.offset_m.y()) / height)};
}

Triangle triangle_of(std::uint32_t a, std::uint32_t b, std::uint32_t c, std::uint16_t texture) {
  Triangle t;
  t.corners[0].vertex = a;
  t.corners[1].vertex = b;
  t.corners[2].vertex = c;
  t.texture = texture;
  return t;
}

}  // namespace

std::uint16_t SceneBuilder::add_texture(std::function<cv::Mat()> paint, bool repeat) {
  paintings_.push_back({std::move(paint), repeat});
  return static_cast<std::uint16_t>(paintings_.size() - 1);
}

void SceneBuilder::begin_mesh() { scene_.meshes.emplace_back(); }

void SceneBuilder::quad(const Eigen::Vector3d& corner, const Eigen::Vector3d& along_u, const Eigen::Vector3d& along_v,
                        const Skin& skin, double light_step_m, bool emissive) {
  const auto base = static_cast<std::uint32_t>(mesh().vertices.size());
  for (const Eigen::Vector3d& p : {corner, Eigen::Vector3d(corner + along_u),
                                   Eigen::Vector3d(corner + along_u + along_v), Eigen::Vector3d(corner + along_v)}) {
    mesh().vertices.push_back(p);
  }
  const double u_size = along_u.norm(), v_size = along_v.norm();
  const Eigen::Vector2f uv[4] = {
      texture_coordinate(skin, 0, 0, u_size, v_size), texture_coordinate(skin, u_size, 0, u_size, v_size),
      texture_coordinate(skin, u_size, v_size, u_size, v_size), texture_coordinate(skin, 0, v_size, u_size, v_size)};
  LightPatch patch;
  patch.columns = std::clamp(static_cast<int>(std::ceil(u_size / light_step_m)) + 1, 2, kMaxPatchSide);
  patch.rows = std::clamp(static_cast<int>(std::ceil(v_size / light_step_m)) + 1, 2, kMaxPatchSide);
  patch.origin = corner;
  patch.column_step = along_u / (patch.columns - 1);
  patch.row_step = along_v / (patch.rows - 1);
  patch.normal = along_u.cross(along_v).normalized();
  const std::size_t first = mesh().triangles.size();
  const int order[2][3] = {{0, 1, 2}, {0, 2, 3}};
  for (const auto& corners : order) {
    Triangle t = triangle_of(base + corners[0], base + corners[1], base + corners[2], skin.texture);
    t.lighting = emissive ? Lighting::kEmissive : Lighting::kLightmap;
    for (int i = 0; i < 3; ++i) t.corners[i].uv = uv[corners[i]];
    t.continues = &corners == &order[1];
    mesh().triangles.push_back(t);
  }
  if (emissive) return;
  pending_.push_back({scene_.meshes.size() - 1, first, scene_.patches.size()});
  scene_.patches.push_back(patch);
}

void SceneBuilder::box(const SE3& pose, const Eigen::Vector3d& size_m, const Skin& sides, const Skin& front,
                       const Skin& top, bool closed) {
  const double x = size_m.x() / 2, y = size_m.y() / 2, z = size_m.z();
  const Eigen::Matrix3d r = pose.rotation_matrix();
  const double longest = size_m.maxCoeff();
  const double step = longest < 0.5 ? 0.5 : std::clamp(longest / 9, 0.08, 0.14);  // small things: light at the corners
  auto face = [&](const Eigen::Vector3d& corner, const Eigen::Vector3d& u, const Eigen::Vector3d& v, const Skin& skin) {
    quad(pose * corner, r * u, r * v, skin, step);
  };
  const Eigen::Vector3d ex(2 * x, 0, 0), ey(0, 2 * y, 0), ez(0, 0, z);
  face({-x, -y, 0}, ex, ez, front);
  face({x, -y, 0}, ey, ez, sides);
  if (closed) face({x, y, 0}, -ex, ez, sides);
  face({-x, y, 0}, -ey, ez, sides);
  face({-x, -y, z}, ex, ey, top);
  const bool on_floor = (pose * Eigen::Vector3d::Zero()).z() < 0.02;
  if (closed && !on_floor) face({-x, y, 0}, ex, -ey, sides);
}

std::vector<Eigen::Vector3d>& SceneBuilder::normals_for_new_vertices() {
  scene_.vertex_normals.push_back({scene_.meshes.size() - 1, mesh().vertices.size(), {}});
  return scene_.vertex_normals.back().normals;
}

void SceneBuilder::lathe(const SE3& pose, const std::vector<Eigen::Vector2d>& profile, int segments, const Skin& skin) {
  auto& normals = normals_for_new_vertices();
  const auto base = static_cast<std::uint32_t>(mesh().vertices.size());
  const Eigen::Matrix3d r = pose.rotation_matrix();
  const int rings = static_cast<int>(profile.size());
  double length = 0;
  std::vector<float> along(rings, 0.f);
  for (int i = 1; i < rings; ++i) along[i] = static_cast<float>(length += (profile[i] - profile[i - 1]).norm());
  for (int i = 0; i < rings; ++i) {
    const Eigen::Vector2d tangent = profile[std::min(i + 1, rings - 1)] - profile[std::max(i - 1, 0)];
    for (int s = 0; s <= segments; ++s) {
      const double a = 2 * M_PI * s / segments, c = std::cos(a), d = std::sin(a);
      mesh().vertices.push_back(pose * Eigen::Vector3d(profile[i].x() * c, profile[i].x() * d, profile[i].y()));
      normals.push_back((r * Eigen::Vector3d(tangent.y() * c, tangent.y() * d, -tangent.x())).normalized());
    }
  }
  const double around_m = 2 * M_PI * std::max(profile.front().x(), profile.back().x());
  auto uv = [&](int ring, int s) -> Eigen::Vector2f {
    return texture_coordinate(skin, around_m * s / segments, along[ring], around_m, length);
  };
  for (int i = 0; i + 1 < rings; ++i) {
    for (int s = 0; s < segments; ++s) {
      const std::uint32_t a = base + i * (segments + 1) + s, b = a + 1, c = a + segments + 2, d = a + segments + 1;
      Triangle lower = triangle_of(a, b, c, skin.texture), upper = triangle_of(a, c, d, skin.texture);
      lower.corners[0].uv = upper.corners[0].uv = uv(i, s);
      lower.corners[1].uv = uv(i, s + 1);
      lower.corners[2].uv = upper.corners[1].uv = uv(i + 1, s + 1);
      upper.corners[2].uv = uv(i + 1, s);
      mesh().triangles.push_back(lower);
      mesh().triangles.push_back(upper);
    }
  }
}

void SceneBuilder::tube(const std::vector<Eigen::Vector3d>& points, const std::vector<double>& radii_m, int segments,
                        const Skin& skin) {
  auto& normals = normals_for_new_vertices();
  const auto base = static_cast<std::uint32_t>(mesh().vertices.size());
  const int rings = static_cast<int>(points.size());
  Eigen::Vector3d side = (points[1] - points[0]).unitOrthogonal();
  double length = 0;
  std::vector<double> along(rings, 0.0);
  for (int i = 0; i < rings; ++i) {
    if (i > 0) along[i] = length += (points[i] - points[i - 1]).norm();
    const Eigen::Vector3d t = (points[std::min(i + 1, rings - 1)] - points[std::max(i - 1, 0)]).normalized();
    side = (side - t * t.dot(side)).normalized();
    const Eigen::Vector3d other = t.cross(side);
    for (int s = 0; s <= segments; ++s) {
      const double a = 2 * M_PI * s / segments;
      const Eigen::Vector3d n = std::cos(a) * side + std::sin(a) * other;
      mesh().vertices.push_back(points[i] + radii_m[i] * n);
      normals.push_back(n);
    }
  }
  const double around_m = 2 * M_PI * radii_m[0];
  for (int i = 0; i + 1 < rings; ++i) {
    for (int s = 0; s < segments; ++s) {
      const std::uint32_t corner[4] = {base + i * (segments + 1) + s, base + i * (segments + 1) + s + 1,
                                       base + (i + 1) * (segments + 1) + s + 1, base + (i + 1) * (segments + 1) + s};
      auto uv = [&](int k) -> Eigen::Vector2f {
        const int ss = s + (k == 1 || k == 2), ii = i + (k >= 2);
        return texture_coordinate(skin, around_m * ss / segments, along[ii], around_m, std::max(length, 1e-3));
      };
      for (const auto& order : {std::array<int, 3>{0, 1, 2}, std::array<int, 3>{0, 2, 3}}) {
        Triangle t = triangle_of(corner[order[0]], corner[order[1]], corner[order[2]], skin.texture);
        for (int k = 0; k < 3; ++k) t.corners[k].uv = uv(order[k]);
        mesh().triangles.push_back(t);
      }
    }
  }
}

void SceneBuilder::leaf(const Eigen::Vector3d& root, const Eigen::Vector3d& direction, double length_m, double width_m,
                        double droop, const Skin& skin) {
  auto& normals = normals_for_new_vertices();
  const auto base = static_cast<std::uint32_t>(mesh().vertices.size());
  const Eigen::Vector3d up = Eigen::Vector3d::UnitZ();
  const Eigen::Vector3d side = direction.cross(up).normalized();
  constexpr int kParts = 5;
  Eigen::Vector3d p = root, d = direction.normalized();
  for (int i = 0; i <= kParts; ++i) {
    const double s = static_cast<double>(i) / kParts;
    const double half = width_m / 2 * std::sqrt(std::max(0.0, std::sin(M_PI * (0.06 + 0.94 * s))));
    const Eigen::Vector3d n = side.cross(d).normalized();
    mesh().vertices.push_back(p - side * half + n * half * 0.3);
    mesh().vertices.push_back(p + side * half + n * half * 0.3);
    normals.insert(normals.end(), 2, n);
    p += d * (length_m / kParts);
    d = (d - up * (droop / kParts)).normalized();
  }
  for (int i = 0; i < kParts; ++i) {
    const std::uint32_t a = base + 2 * i;
    const float low = 1.f - static_cast<float>(i) / kParts, high = 1.f - static_cast<float>(i + 1) / kParts;
    Triangle t = triangle_of(a, a + 1, a + 3, skin.texture), w = triangle_of(a, a + 3, a + 2, skin.texture);
    t.two_sided = w.two_sided = true;
    t.corners[0].uv = w.corners[0].uv = {0.f, low};
    t.corners[1].uv = {1.f, low};
    t.corners[2].uv = w.corners[1].uv = {1.f, high};
    w.corners[2].uv = {0.f, high};
    mesh().triangles.push_back(t);
    mesh().triangles.push_back(w);
  }
}

StaticScene SceneBuilder::finish(int threads) {
  std::vector<std::optional<Texture>> painted(paintings_.size());
  parallel_for(static_cast<int>(painted.size()), threads,
               [&](int i, int) { painted[i].emplace(paintings_[i].paint(), paintings_[i].repeat); });
  for (auto& texture : painted) scene_.textures.push_back(std::move(*texture));
  std::vector<std::size_t> order(scene_.patches.size());  // by height: little waste on shelves
  for (std::size_t i = 0; i < order.size(); ++i) order[i] = i;
  std::stable_sort(order.begin(), order.end(),
                   [&](std::size_t a, std::size_t b) { return scene_.patches[a].rows > scene_.patches[b].rows; });
  int column = 0, row = 0, shelf = 0;
  for (const std::size_t i : order) {
    LightPatch& patch = scene_.patches[i];
    if (column + patch.columns > kAtlasWidth) {
      column = 0;
      row += shelf;
      shelf = 0;
    }
    patch.column = column;
    patch.row = row;
    column += patch.columns;
    shelf = std::max(shelf, patch.rows);
  }
  scene_.light.width = kAtlasWidth;
  scene_.light.height = std::max(2, row + shelf);
  scene_.light.texels.assign(static_cast<std::size_t>(scene_.light.width) * scene_.light.height, Colour4{1, 1, 1, 1});
  for (const PendingPatch& pending : pending_) {
    const LightPatch& patch = scene_.patches[pending.patch];
    const float c0 = static_cast<float>(patch.column), r0 = static_cast<float>(patch.row);
    const float c1 = c0 + static_cast<float>(patch.columns - 1), r1 = r0 + static_cast<float>(patch.rows - 1);
    const Eigen::Vector2f light[4] = {{c0, r0}, {c1, r0}, {c1, r1}, {c0, r1}};
    Triangle* t = &scene_.meshes[pending.mesh].triangles[pending.first_triangle];
    for (int i = 0; i < 3; ++i) {
      t[0].corners[i].light = light[i];
      t[1].corners[i].light = light[i == 0 ? 0 : i + 1];
    }
  }
  for (Mesh& m : scene_.meshes) m.update_bounds();
  return std::move(scene_);
}

}  // namespace semvslam::render
