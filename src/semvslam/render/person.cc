#include "semvslam/render/person.h"

#include <algorithm>
#include <cmath>

#include "semvslam/render/paint.h"
#include "semvslam/render/parallel.h"

namespace semvslam::render {
namespace {

using Eigen::Vector2f;
using Eigen::Vector3f;

constexpr float kCoarse = 2.0f;  // lattice of the far level of detail

/// Texture coordinates of a triangle's corners; one chart per triangle, so that no triangle crosses a seam.
std::array<Vector2f, 3> chart(const BodyPart& part, const std::array<Vector3f, 3>& p, const Vector3f& normal) {
  const Vector3f middle = (p[0] + p[1] + p[2]) / 3;
  const auto image = static_cast<float>(part.image_m);
  std::array<Vector2f, 3> uv;
  for (int i = 0; i < 3; ++i) {
    if (part.chart == BodyPart::Chart::kHead) {
      const bool face = middle.y() > 0.015f && middle.z() > 1.505f;
      const float across = face ? p[i].x() : (std::abs(normal.x()) > 0.7f ? p[i].y() : p[i].x());
      uv[i] = {0.25f + across / 0.44f + (face ? 0.f : 0.5f), (1.78f - p[i].z()) / 0.28f};
      if (!face) uv[i].x() = std::clamp(uv[i].x(), 0.53f, 0.97f);
    } else if (part.chart == BodyPart::Chart::kFrontBack) {
      float x = p[i].x();  // mirrored beyond the image's edge
      if (std::abs(x) > image / 2 && image < 1.f) x = std::copysign(image - std::abs(x), x);
      const float top = image < 1.f ? 1.55f : 1.05f, width = image < 1.f ? image : 0.7f;
      const bool front = normal.y() >= 0;
      uv[i] = {0.25f + (front ? x : -x) / (2 * width) + (front ? 0.f : 0.5f), (top - p[i].z()) / image};
    } else {
      int axis = 0;
      normal.cwiseAbs().maxCoeff(&axis);
      const Vector3f& q = p[i];
      uv[i] = axis == 0   ? Vector2f(q.y(), -q.z()) / image
              : axis == 1 ? Vector2f(q.x(), -q.z()) / image
                          : Vector2f(q.x(), q.y()) / image;
    }
  }
  return uv;
}

/// How open a point of the surface is: distances ahead that come out shorter than straight ones (after Evans 2006).
float openness(const std::vector<BodyPart>& parts, const Vector3f& p, const Vector3f& normal) {
  float closed = 0;
  for (const float ahead : {0.035f, 0.12f}) {
    float nearest = ahead;
    for (const BodyPart& part : parts) nearest = std::min(nearest, part.shape.value(p + ahead * normal));
    closed += 0.62f * std::max(0.f, ahead - nearest) / ahead;
  }
  return std::clamp(1.f - closed, 0.25f, 1.f);
}

}  // namespace

PersonLook random_look(std::uint64_t seed) {
  RandomStream random(mix64(seed, 333));
  PersonLook look;
  look.seed = mix64(seed, 334);
  look.woman = random.chance(0.45);
  look.height_m = std::clamp((look.woman ? 1.665 : 1.785) + 0.06 * random.normal(), 1.5, 1.98);
  look.girth = std::clamp(1.0 + 0.09 * random.normal(), 0.86, 1.22);
  static const cv::Vec3f kSkins[] = {{158, 184, 226}, {142, 170, 216}, {120, 152, 204},
                                     {96, 128, 182},  {66, 94, 146},   {46, 66, 104}};
  look.skin = kSkins[random.below(6)];
  static const cv::Vec3f kHairs[] = {{22, 24, 28},   {28, 38, 56},  {40, 60, 92},   {70, 110, 150},
                                     {96, 150, 196}, {34, 62, 128}, {150, 152, 154}};
  look.hair = kHairs[look.skin[2] < 160 ? random.below(2) : random.below(7)];
  using Hair = PersonLook::Hair;
  const Hair hers[] = {Hair::kLong, Hair::kBob, Hair::kBun, Hair::kLong},
             his[] = {Hair::kShort, Hair::kCropped, Hair::kShort, Hair::kBald};
  look.hair_style = look.woman ? hers[random.below(4)] : his[random.below(4)];
  look.beard = !look.woman && random.chance(0.35);
  look.glasses = random.chance(0.3);
  look.long_sleeves = random.chance(0.6);
  look.collar = random.chance(0.6);
  look.skirt = look.woman && random.chance(0.35);
  using Cloth = PersonLook::Cloth;
  const Cloth tops[] = {Cloth::kPlain, Cloth::kStripes, Cloth::kChecks, Cloth::kPrint};
  look.top = tops[random.below(4)];
  look.bottom = look.skirt ? (random.chance(0.5) ? Cloth::kPlain : Cloth::kChecks)
                           : (random.chance(0.6) ? Cloth::kJeans : Cloth::kPlain);
  const double hue = random.uniform();
  double value = random.uniform(0.25, 0.85);
  look.top_tone = hue_colour(hue, random.uniform(0.25, 0.75), value);
  value = random.uniform(0.1, 0.9);
  const double saturation = random.uniform(0.0, 0.5);
  look.top_second = hue_colour(std::fmod(hue + random.uniform(0.3, 0.7), 1.0), saturation, value);
  if (look.bottom == Cloth::kJeans) {
    look.bottom_tone = cv::Vec3f(118, 82, 58) * static_cast<float>(random.uniform(0.6, 1.25));
  } else {
    value = random.uniform(0.16, 0.6);
    look.bottom_tone = hue_colour(random.uniform(0.05, 0.7), 0.25, value);
  }
  look.shoes = cv::Vec3f(200, 205, 208);
  if (!random.chance(0.3)) {
    value = random.uniform(0.1, 0.3);
    look.shoes = hue_colour(random.uniform(), 0.3, value);
  }
  return look;
}

Person::Surface Person::make_piece(const std::vector<BodyPart>& parts, const BodyPart& part, float coarseness) {
  const ShapeMesh shape = polygonise(part.shape, part.cell_m * coarseness);
  Surface piece;
  piece.vertices.reserve(shape.vertices.size());
  for (std::size_t v = 0; v < shape.vertices.size(); ++v) {
    const Eigen::Vector3d p = shape.vertices[v].cast<double>();
    SkinWeights weights = skin_weights(p);
    if (part.skirt) weights = skirt_weights(p);
    // Hair and face follow the head as one piece.
    if (p.z() > 1.53 && std::abs(p.x()) < 0.13) weights = {{kHead, 0, 0, 0}, {1.f, 0, 0, 0}};
    piece.vertices.push_back(
        {p, shape.normals[v].cast<double>(), weights, openness(parts, shape.vertices[v], shape.normals[v])});
  }
  for (const auto& corners : shape.triangles) {
    const std::array<Vector3f, 3> p{shape.vertices[corners[0]], shape.vertices[corners[1]], shape.vertices[corners[2]]};
    const Vector3f normal = (p[1] - p[0]).cross(p[2] - p[0]).normalized();
    const auto uv = chart(part, p, normal);
    Triangle t;
    t.texture = part.texture;
    for (int c = 0; c < 3; ++c) {
      t.corners[c].vertex = corners[c];
      t.corners[c].uv = uv[c];
    }
    piece.triangles.push_back(t);
  }
  return piece;
}

void Person::Surface::append(const Surface& piece) {
  const auto base = static_cast<std::uint32_t>(vertices.size());
  vertices.insert(vertices.end(), piece.vertices.begin(), piece.vertices.end());
  for (Triangle t : piece.triangles) {
    for (Corner& corner : t.corners) corner.vertex += base;
    triangles.push_back(t);
  }
}

Person::Person(const PersonLook& look, SceneBuilder& builder, int threads) : look_(look) {
  const std::vector<BodyPart> parts = make_body_parts(look, builder);
  const int count = static_cast<int>(parts.size());
  std::vector<Surface> pieces(2 * count);
  parallel_for(2 * count, threads,
               [&](int i, int) { pieces[i] = make_piece(parts, parts[i % count], i < count ? 1.f : kCoarse); });
  for (int i = 0; i < 2 * count; ++i) (i < count ? fine_ : coarse_).append(pieces[i]);
}

void Person::pose(const std::array<BoneMotion, kBones>& motions, const SE3& world_from_person,
                  const std::array<float, 6>& light, bool fine, Mesh& out) const {
  const Surface& surface = fine ? fine_ : coarse_;
  const Skinner skinner(motions);
  const Eigen::Matrix3d turn = world_from_person.rotation_matrix();
  out.vertices.resize(surface.vertices.size());
  out.triangles = surface.triangles;
  std::vector<float> brightness(surface.vertices.size());
  for (std::size_t i = 0; i < surface.vertices.size(); ++i) {
    const Vertex& v = surface.vertices[i];
    Eigen::Vector3d point, normal;
    skinner.apply(v.weights, v.point, v.normal, point, normal);
    out.vertices[i] = turn * (scale() * point) + world_from_person.translation();
    const Eigen::Vector3d n = turn * normal;
    float sum = 0;
    for (int axis = 0; axis < 3; ++axis) sum += static_cast<float>(n[axis] * n[axis]) * light[2 * axis + (n[axis] < 0)];
    brightness[i] = sum * (0.35f + 0.65f * v.open);
  }
  for (Triangle& t : out.triangles) {
    for (Corner& corner : t.corners) corner.light.x() = brightness[corner.vertex];
  }
  out.update_bounds();
}

}  // namespace semvslam::render
