#include "semvslam/render/rasterizer.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>

#include "semvslam/render/parallel.h"

namespace semvslam::render {
namespace {

constexpr double kNear_m = 0.05;
// Sample points in pixels from the centre. The four of the colour are symmetric to it: no shift between colour and
// depth.
constexpr float kOffsetX[5] = {0.f, -0.125f, 0.375f, 0.125f, -0.375f};
constexpr float kOffsetY[5] = {0.f, -0.375f, -0.125f, 0.375f, 0.125f};
constexpr std::uint32_t kNothing = 0xffffffffu;
constexpr int kMaxTaps = 5;  // of anisotropic filtering

struct ScreenPoint {
  double x, y;
};

/// The part of the triangle beyond the near plane, as a convex polygon. A cut edge gives the same point for both of its
/// triangles: it is always cut from the inside to the outside.
int clip_near(const std::array<Eigen::Vector3d, 3>& points, std::array<Eigen::Vector3d, 4>& out) {
  int count = 0;
  for (int i = 0; i < 3; ++i) {
    const Eigen::Vector3d &a = points[i], &b = points[(i + 1) % 3];
    const bool a_in = a.z() >= kNear_m, b_in = b.z() >= kNear_m;
    if (a_in) out[count++] = a;
    if (a_in != b_in) {
      const Eigen::Vector3d &in = a_in ? a : b, &away = a_in ? b : a;
      const double t = (in.z() - kNear_m) / (in.z() - away.z());
      out[count++] = in + t * (away - in);
    }
  }
  return count;
}

}  // namespace

Rasterizer::Rasterizer(const Camera& camera) : camera_(camera) {
  bands_ = (camera.height_px + kBandRows - 1) / kBandRows;
  bins_.resize(bands_);
}

bool Rasterizer::outside(const Mesh& mesh, const SE3& camera_from_world) const {
  const Eigen::Vector3d c = camera_from_world * mesh.centre;
  const double r = mesh.radius_m;
  if (c.z() + r < kNear_m) return true;
  const double left = camera_.cx_px + 1, right = camera_.width_px - camera_.cx_px;
  const double up = camera_.cy_px + 1, down = camera_.height_px - camera_.cy_px;
  auto beyond = [&](double along, double extent, double focal) {  // plane through the eye and one side of the picture
    return (along * focal - c.z() * extent) > r * std::hypot(focal, extent);
  };
  return beyond(-c.x(), left, camera_.fx_px) || beyond(c.x(), right, camera_.fx_px) ||
         beyond(-c.y(), up, camera_.fy_px) || beyond(c.y(), down, camera_.fy_px);
}

void Rasterizer::set_up_planes(const std::array<Eigen::Vector3d, 3>& points, double determinant, const Triangle& source,
                               ScreenTriangle& out) const {
  // Row i of the inverse of [p0 p1 p2] times the ray (x, y, 1) is barycentric coordinate i over depth.
  std::array<Eigen::Vector3d, 3> over_depth;
  for (int i = 0; i < 3; ++i) over_depth[i] = points[(i + 1) % 3].cross(points[(i + 2) % 3]) / determinant;
  auto in_pixels = [&](const Eigen::Vector3d& g) -> Eigen::Vector3d {
    const double dx = g.x() / camera_.fx_px, dy = g.y() / camera_.fy_px;
    return {dx, dy, g.z() - dx * camera_.cx_px - dy * camera_.cy_px};
  };
  auto local = [&](const Eigen::Vector3d& plane) -> Plane {
    return {static_cast<float>(plane.x() * out.origin_x + plane.y() * out.origin_y + plane.z()),
            static_cast<float>(plane.x()), static_cast<float>(plane.y())};
  };
  auto attribute = [&](double a0, double a1, double a2) {
    return local(in_pixels(a0 * over_depth[0] + a1 * over_depth[1] + a2 * over_depth[2]));
  };
  const Eigen::Vector3d inverse_depth_of_ray = over_depth[0] + over_depth[1] + over_depth[2];  // = normal / offset
  const Eigen::Vector3d inverse_depth = in_pixels(inverse_depth_of_ray);
  for (int i = 0; i < 3; ++i) out.inverse_depth[i] = inverse_depth[i];
  out.inverse_depth_local = local(inverse_depth);
  const auto& c = source.corners;
  out.u = attribute(c[0].uv.x(), c[1].uv.x(), c[2].uv.x());
  out.v = attribute(c[0].uv.y(), c[1].uv.y(), c[2].uv.y());
  out.light_column = attribute(c[0].light.x(), c[1].light.x(), c[2].light.x());
  out.light_row = attribute(c[0].light.y(), c[1].light.y(), c[2].light.y());
  out.normal_norm = static_cast<float>(inverse_depth_of_ray.norm());
}

bool Rasterizer::set_up_triangle(const std::array<Eigen::Vector3d, 3>& points, const Triangle& source,
                                 ScreenTriangle& out) const {
  // Negative = counter-clockwise seen from the eye (the y axis points down).
  const double determinant = points[0].dot(points[1].cross(points[2]));
  if (!(std::abs(determinant) > 1e-14) || (determinant > 0 && !source.two_sided)) return false;
  std::array<Eigen::Vector3d, 4> polygon;
  const int count = clip_near(points, polygon);
  if (count < 3) return false;
  std::array<ScreenPoint, 4> screen;
  double left = 1e30, right = -1e30, top = 1e30, bottom = -1e30;
  for (int i = 0; i < count; ++i) {
    const Eigen::Vector2d p = camera_.project(polygon[i]);
    screen[i] = {p.x(), p.y()};
    left = std::min(left, p.x());
    right = std::max(right, p.x());
    top = std::min(top, p.y());
    bottom = std::max(bottom, p.y());
  }
  if (right < -0.5 || left > camera_.width_px - 0.5 || bottom < -0.5 || top > camera_.height_px - 0.5) return false;
  out.first_row = static_cast<int>(std::max(0.0, std::ceil(top - 0.4)));
  out.last_row = static_cast<int>(std::min(camera_.height_px - 1.0, std::floor(bottom + 0.4)));
  if (out.first_row > out.last_row) return false;
  out.edge_count = 0;
  for (int i = 0; i < count; ++i) {
    ScreenPoint a = screen[i], b = screen[(i + 1) % count];
    if (a.y == b.y) continue;
    if (a.y > b.y) std::swap(a, b);  // both triangles of an edge compute the same crossings
    out.edges[out.edge_count++] = {a.y, b.y, a.x, (b.x - a.x) / (b.y - a.y)};
  }
  out.origin_x = static_cast<float>(std::floor(std::clamp((left + right) / 2, 0.0, camera_.width_px - 1.0)));
  out.origin_y = static_cast<float>(std::floor(std::clamp((top + bottom) / 2, 0.0, camera_.height_px - 1.0)));
  set_up_planes(points, determinant, source, out);
  out.texture = source.texture;
  out.lighting = source.lighting;
  return true;
}

void Rasterizer::set_up(const Mesh& mesh, const SE3& camera_from_world, std::vector<ScreenTriangle>& out) const {
  const Eigen::Matrix3d rotation = camera_from_world.rotation_matrix();
  const Eigen::Vector3d translation = camera_from_world.translation();
  std::vector<Eigen::Vector3d> points(mesh.vertices.size());
  for (std::size_t i = 0; i < points.size(); ++i) points[i] = rotation * mesh.vertices[i] + translation;
  ScreenTriangle screen;
  bool last_drawn = false;
  for (const Triangle& triangle : mesh.triangles) {
    const std::array<Eigen::Vector3d, 3> corners{points[triangle.corners[0].vertex], points[triangle.corners[1].vertex],
                                                 points[triangle.corners[2].vertex]};
    const bool before = last_drawn;
    last_drawn = set_up_triangle(corners, triangle, screen);
    if (!last_drawn) continue;
    screen.role = mesh.role;
    screen.continues = triangle.continues && before;
    out.push_back(screen);
  }
}

void Rasterizer::fill_row(const ScreenTriangle& triangle, std::uint32_t id, int row, int band_top,
                          BandBuffers& buffers) const {
  const std::size_t offset = static_cast<std::size_t>(row - band_top) * camera_.width_px;
  for (int s = 0; s < kSamples; ++s) {
    const double y = row + static_cast<double>(kOffsetY[s]);
    double left = 1e30, right = -1e30;
    for (int e = 0; e < triangle.edge_count; ++e) {
      const Edge& edge = triangle.edges[e];
      if (y < edge.top || y >= edge.bottom) continue;
      const double x = edge.x_at_top + (y - edge.top) * edge.slope;
      left = std::min(left, x);
      right = std::max(right, x);
    }
    const double shift = static_cast<double>(kOffsetX[s]);
    left = std::max(std::ceil(left - shift), 0.0);
    right = std::min(std::ceil(right - shift), static_cast<double>(camera_.width_px));
    if (!(left < right)) continue;
    const int first = static_cast<int>(left), count = static_cast<int>(right) - first;
    const double* plane = triangle.inverse_depth;
    const float start = static_cast<float>(plane[0] * (first + shift) + plane[1] * y + plane[2]);
    const float step = static_cast<float>(plane[0]);
    float* __restrict depth = buffers.inverse_depth[s].data() + offset + first;
    std::uint32_t* __restrict ids = buffers.triangle[s].data() + offset + first;
    for (int i = 0; i < count; ++i) {
      const float here = start + step * static_cast<float>(i);
      const bool nearer = here > depth[i];
      depth[i] = nearer ? here : depth[i];
      ids[i] = nearer ? id : ids[i];
    }
  }
}

void Rasterizer::fill_band(int band, BandBuffers& buffers) const {
  const int top = band * kBandRows, bottom = std::min(top + kBandRows, camera_.height_px);
  for (int s = 0; s < kSamples; ++s) {
    buffers.inverse_depth[s].assign(static_cast<std::size_t>(kBandRows) * camera_.width_px, 0.f);
    buffers.triangle[s].assign(static_cast<std::size_t>(kBandRows) * camera_.width_px, kNothing);
  }
  for (const std::uint32_t id : bins_[band]) {
    const ScreenTriangle& triangle = *triangles_[id];
    const int first = std::max(triangle.first_row, top), last = std::min(triangle.last_row, bottom - 1);
    const std::uint32_t surface = triangle.continues ? id - 1 : id;
    for (int row = first; row <= last; ++row) fill_row(triangle, surface, row, top, buffers);
  }
}

Colour4 Rasterizer::shade(const ScreenTriangle& t, float x, float y, const std::vector<Texture>& textures,
                          const LightAtlas& light) const {
  const float dx = x - t.origin_x, dy = y - t.origin_y;
  auto at = [&](const Plane& plane) { return plane.at_origin + plane.dx * dx + plane.dy * dy; };
  const float depth = 1.f / at(t.inverse_depth_local);
  const float u = at(t.u) * depth, v = at(t.v) * depth;
  // Derivative of a quotient of two planes.
  const Plane& w = t.inverse_depth_local;
  const Texture& texture = textures[t.texture];
  const float columns = static_cast<float>(texture.width()) * depth,
              rows = static_cast<float>(texture.height()) * depth;
  const float ux = (t.u.dx - u * w.dx) * columns, uy = (t.u.dy - u * w.dy) * columns;
  const float vx = (t.v.dx - v * w.dx) * rows, vy = (t.v.dy - v * w.dy) * rows;
  const float along_x = ux * ux + vx * vx, along_y = uy * uy + vy * vy;  // texels^2 per pixel
  const float major = std::max(along_x, along_y), minor = std::max(std::min(along_x, along_y), 1e-12f);
  const float ratio = std::sqrt(major / minor);
  const int taps = std::clamp(static_cast<int>(ratio + 0.15f), 1, kMaxTaps);
  // Half a level sharper than one texel per pixel: four colour points per edge, but the surface itself is sampled once.
  const float lod = 0.5f * std::log2(std::max(major, 1e-12f)) - std::log2(static_cast<float>(taps)) - 0.35f;
  Colour4 colour{};
  if (taps == 1 || lod <= -1.f) {
    colour = texture.sample(u, v, lod);
  } else {
    const bool horizontal = along_x >= along_y;
    const float du = (horizontal ? ux : uy) / static_cast<float>(texture.width());
    const float dv = (horizontal ? vx : vy) / static_cast<float>(texture.height());
    for (int i = 0; i < taps; ++i) {  // symmetric to the pixel centre
      const float s = (static_cast<float>(i) + 0.5f) / static_cast<float>(taps) - 0.5f;
      colour += texture.sample(u + s * du, v + s * dv, lod);
    }
    colour *= 1.f / static_cast<float>(taps);
  }
  if (t.lighting == Lighting::kEmissive) return colour;
  const float column = at(t.light_column) * depth, row = at(t.light_row) * depth;
  if (t.lighting == Lighting::kLightmap) return colour * light.sample(column, row);
  return colour * column;
}

void Rasterizer::resolve_band(int band, const BandBuffers& buffers, const std::vector<Texture>& textures,
                              const LightAtlas& light, Picture& picture) const {
  const int top = band * kBandRows, bottom = std::min(top + kBandRows, camera_.height_px), width = camera_.width_px;
  for (int y = top; y < bottom; ++y) {
    const std::size_t offset = static_cast<std::size_t>(y - top) * width;
    auto* colour_row = picture.colour.ptr<cv::Vec3b>(y);
    auto* depth_row = picture.depth_m.ptr<float>(y);
    auto* cosine_row = picture.cosine.ptr<float>(y);
    auto* instance_row = picture.instances.ptr<std::uint8_t>(y);
    const double ray_y = (y - camera_.cy_px) / camera_.fy_px;
    for (int x = 0; x < width; ++x) {
      const std::uint32_t centre = buffers.triangle[0][offset + x];
      depth_row[x] = cosine_row[x] = 0.f;
      instance_row[x] = 0;
      if (centre != kNothing) {
        const ScreenTriangle& t = *triangles_[centre];
        const double inverse = t.inverse_depth[0] * x + t.inverse_depth[1] * y + t.inverse_depth[2];
        depth_row[x] = static_cast<float>(1.0 / inverse);
        const double ray_x = (x - camera_.cx_px) / camera_.fx_px;
        const float ray_norm = static_cast<float>(std::sqrt(ray_x * ray_x + ray_y * ray_y + 1.0));
        cosine_row[x] = static_cast<float>(inverse) / (t.normal_norm * ray_norm);
        instance_row[x] = t.role;
      }
      std::uint32_t ids[4];
      for (int s = 0; s < 4; ++s) ids[s] = buffers.triangle[s + 1][offset + x];
      Colour4 sum{};
      if (ids[0] == ids[1] && ids[0] == ids[2] && ids[0] == ids[3]) {
        if (ids[0] != kNothing) {
          sum = shade(*triangles_[ids[0]], static_cast<float>(x), static_cast<float>(y), textures, light) * 4.f;
        }
      } else {
        for (int s = 0; s < 4; ++s) {
          if (ids[s] == kNothing) continue;
          float mean_x = 0, mean_y = 0, count = 0;
          const std::uint32_t id = ids[s];
          for (int other = s; other < 4; ++other) {
            if (ids[other] != id) continue;
            mean_x += kOffsetX[other + 1];
            mean_y += kOffsetY[other + 1];
            count += 1.f;
            if (other > s) ids[other] = kNothing;
          }
          sum += shade(*triangles_[id], static_cast<float>(x) + mean_x / count, static_cast<float>(y) + mean_y / count,
                       textures, light) *
                 count;
        }
      }
      for (int c = 0; c < 3; ++c) {
        colour_row[x][c] = static_cast<std::uint8_t>(std::clamp(sum[c] * 0.25f + 0.5f, 0.f, 255.f));
      }
    }
  }
}

void Rasterizer::draw(const std::vector<const Mesh*>& meshes, const std::vector<Texture>& textures,
                      const LightAtlas& light, const SE3& world_from_camera, int threads, Picture& picture) {
  picture.colour.create(camera_.height_px, camera_.width_px, CV_8UC3);
  picture.depth_m.create(camera_.height_px, camera_.width_px, CV_32FC1);
  picture.cosine.create(camera_.height_px, camera_.width_px, CV_32FC1);
  picture.instances.create(camera_.height_px, camera_.width_px, CV_8UC1);
  const SE3 camera_from_world = world_from_camera.inverse();
  if (parts_.size() < meshes.size()) parts_.resize(meshes.size());
  const int last = static_cast<int>(meshes.size()) - 1;
  parallel_for(last + 1, threads, [&](int task, int) {
    const int i = last - task;  // people come last and are the most work: they go first
    parts_[i].clear();
    if (!outside(*meshes[i], camera_from_world)) set_up(*meshes[i], camera_from_world, parts_[i]);
  });
  triangles_.clear();
  for (auto& bin : bins_) bin.clear();
  for (std::size_t i = 0; i < meshes.size(); ++i) {
    for (const ScreenTriangle& triangle : parts_[i]) {
      const auto id = static_cast<std::uint32_t>(triangles_.size());
      for (int band = triangle.first_row / kBandRows; band <= triangle.last_row / kBandRows; ++band) {
        bins_[band].push_back(id);
      }
      triangles_.push_back(&triangle);
    }
  }
  buffers_.resize(std::max<std::size_t>(buffers_.size(), std::max(1, threads)));
  parallel_for(bands_, threads, [&](int band, int worker) {
    fill_band(band, buffers_[worker]);
    resolve_band(band, buffers_[worker], textures, light, picture);
  });
}

}  // namespace semvslam::render
