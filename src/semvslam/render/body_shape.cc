#include <cmath>

#include "semvslam/render/noise.h"
#include "semvslam/render/paint.h"
#include "semvslam/render/person.h"

namespace semvslam::render {
namespace {

using Eigen::Vector3f;

const Vector3f kForward = Vector3f::UnitY();

Vector3f arm_point(int side, float along_m) {
  const Vector3f d = rest_arm_direction(side).cast<float>();
  return Vector3f(static_cast<float>(side) * 0.185f, -0.012f, 1.405f) + along_m * d;
}

/// Smooth noise in space, about [-1, 1].
float noise_3d(const Vector3f& p, std::uint32_t seed) {
  const float fz = std::floor(p.z()), a = p.z() - fz, s = a * a * (3 - 2 * a);
  const auto slice = static_cast<std::uint32_t>(static_cast<int>(fz) + 512) * 7919u;
  return 2.f * (value_noise(p.x(), p.y(), seed + slice, 1024) * (1 - s) +
                value_noise(p.x(), p.y(), seed + slice + 7919u, 1024) * s) -
         1.f;
}

ImplicitShape head_shape(const PersonLook& look) {
  ImplicitShape s;
  const float w = look.woman ? 0.95f : 1.f;
  s.ellipsoid({0, 0.002f, 1.668f}, {0.076f, 0.097f, 0.086f}, 0.02f);                                          // skull
  s.ellipsoid({0, 0.036f, 1.612f}, {0.063f * w, 0.062f, 0.088f}, 0.03f);                                      // face
  s.ellipsoid({0, 0.042f, 1.562f}, {0.050f * w, 0.050f, 0.044f}, 0.03f);                                      // jaw
  s.ellipsoid({0, 0.086f, 1.541f}, {0.020f * w, 0.016f, 0.016f}, 0.025f);                                     // chin
  s.cone({-0.034f, 0.083f, 1.652f}, 0.012f, {0.034f, 0.083f, 1.652f}, 0.012f, look.woman ? 0.025f : 0.015f);  // brow
  for (const float x : {-1.f, 1.f}) {
    s.ellipsoid({x * 0.041f, 0.066f, 1.603f}, {0.024f, 0.024f, 0.024f}, 0.03f);  // cheek
    s.carve({x * 0.0315f, 0.113f, 1.634f}, {0.019f, 0.018f, 0.013f}, 0.016f);    // eye socket
    s.ellipsoid({x * 0.0315f, 0.0815f, 1.633f}, {0.0145f, 0.0145f, 0.0125f}, 0.006f);
    s.ellipsoid({x * 0.0765f, -0.004f, 1.628f}, {0.009f, 0.019f, 0.031f}, 0.008f,
                Eigen::Quaternionf(Eigen::AngleAxisf(x * 0.35f, Vector3f::UnitZ())));  // ear
    s.ellipsoid({x * 0.0105f, 0.106f, 1.597f}, {0.0085f, 0.010f, 0.008f}, 0.008f);     // nostril
  }
  s.cone({0, 0.094f, 1.640f}, 0.0075f, {0, 0.117f, 1.602f}, 0.0115f, 0.014f);  // nose
  s.ellipsoid({0, 0.0975f, 1.573f}, {0.022f, 0.010f, 0.0055f}, 0.008f);        // lips
  s.ellipsoid({0, 0.0955f, 1.563f}, {0.019f, 0.0105f, 0.006f}, 0.008f);
  const float neck = look.woman ? 0.050f : 0.058f;
  s.cone({0, -0.018f, 1.43f}, neck * 1.12f, {0, -0.002f, 1.585f}, neck, 0.03f);
  if (look.glasses) {
    for (const float x : {-1.f, 1.f})
      s.cone({x * 0.058f, 0.075f, 1.637f}, 0.002f, {x * 0.078f, 0.0f, 1.64f}, 0.002f, 0.001f);
  }
  return s;
}

ImplicitShape hair_shape(const PersonLook& look) {
  using Style = PersonLook::Hair;
  ImplicitShape s;
  const float grown = look.hair_style == Style::kCropped ? 0.006f : 0.016f;
  s.ellipsoid({0, -0.004f, 1.672f + grown * 0.3f}, {0.077f + grown, 0.099f + grown * 0.8f, 0.087f + grown}, 0.02f);
  if (look.hair_style == Style::kLong || look.hair_style == Style::kBob) {
    const float low = look.hair_style == Style::kLong ? 1.37f : 1.51f;
    s.cone({0, -0.055f, 1.65f}, 0.082f, {0, -0.085f, low}, 0.062f, 0.04f, kForward, 1.5f);
    for (const float x : {-1.f, 1.f})
      s.cone({x * 0.062f, 0.005f, 1.66f}, 0.036f, {x * 0.074f, -0.02f, low + 0.03f}, 0.026f, 0.03f, kForward, 0.8f);
  } else {
    s.ellipsoid({0, -0.050f, 1.605f}, {0.062f + grown * 0.4f, 0.045f + grown * 0.5f, 0.062f}, 0.03f);
  }
  if (look.hair_style == Style::kBun) s.ellipsoid({0, -0.112f, 1.715f}, {0.046f, 0.040f, 0.042f}, 0.02f);
  s.carve({0, 0.128f, 1.592f}, {0.083f, 0.098f, 0.100f}, 0.022f);  // the face stays free
  const std::uint32_t seed = static_cast<std::uint32_t>(look.seed);
  s.displace([seed, grown](const Vector3f& p) {
    return 0.28f * grown * noise_3d({p.x() * 60 + 40, p.y() * 60 + 40, p.z() * 22}, seed);
  });
  return s;
}

ImplicitShape hands_shape() {
  ImplicitShape s;
  for (const int side : {1, -1}) {
    const Vector3f d = rest_arm_direction(side).cast<float>(), wrist = arm_point(side, 0.545f);
    const Vector3f inner =
        (Vector3f(-static_cast<float>(side), 0, 0) - d * d.dot(Vector3f(-static_cast<float>(side), 0, 0))).normalized();
    s.cone(wrist - 0.03f * d, 0.027f, wrist + 0.01f * d, 0.026f, 0.015f, inner, 1.2f);
    s.cone(wrist + 0.025f * d, 0.033f, wrist + 0.075f * d, 0.039f, 0.02f, inner, 2.2f);
    for (int i = 0; i < 4; ++i) {
      const float y = 0.029f - 0.0185f * static_cast<float>(i), length = i == 3 ? 0.058f : i == 1 ? 0.080f : 0.073f;
      const Vector3f root = wrist + 0.088f * d + y * kForward;
      const Vector3f knuckle = root + length * 0.5f * d + 0.008f * inner;
      s.cone(root, 0.0095f, knuckle, 0.0088f, 0.008f);
      s.cone(knuckle, 0.0088f, knuckle + length * 0.5f * d + 0.024f * inner, 0.0072f, 0.005f);
    }
    const Vector3f ball = wrist + 0.035f * d + 0.032f * kForward + 0.008f * inner;
    s.cone(ball, 0.014f, ball + 0.030f * d + 0.020f * kForward + 0.008f * inner, 0.0115f, 0.015f);
    s.cone(ball + 0.030f * d + 0.020f * kForward + 0.008f * inner, 0.0115f,
           ball + 0.062f * d + 0.022f * kForward + 0.016f * inner, 0.009f, 0.006f);
  }
  return s;
}

ImplicitShape bare_arms() {
  ImplicitShape s;
  for (const int side : {1, -1}) {
    s.cone(arm_point(side, 0.16f), 0.042f, arm_point(side, 0.29f), 0.037f, 0.03f);
    s.cone(arm_point(side, 0.29f), 0.037f, arm_point(side, 0.36f), 0.040f, 0.03f);
    s.cone(arm_point(side, 0.36f), 0.040f, arm_point(side, 0.55f), 0.026f, 0.03f);
  }
  return s;
}

ImplicitShape bare_legs() {
  ImplicitShape s;
  for (const float x : {-1.f, 1.f}) {
    s.cone({x * 0.104f, 0.008f, 0.56f}, 0.050f, {x * 0.105f, 0.006f, 0.50f}, 0.046f,
           0.04f);  // the rest is under the skirt
    s.cone({x * 0.105f, -0.005f, 0.48f}, 0.046f, {x * 0.110f, -0.018f, 0.34f}, 0.052f, 0.04f);
    s.cone({x * 0.110f, -0.018f, 0.34f}, 0.052f, {x * 0.115f, -0.02f, 0.10f}, 0.034f, 0.04f);
  }
  return s;
}

ImplicitShape top_shape(const PersonLook& look) {
  ImplicitShape s;
  const float g = static_cast<float>(look.girth), c = 0.012f;  // cloth stands off
  const float shoulder = look.woman ? 0.90f : 1.f, waist = (look.woman ? 0.080f : 0.098f) * g,
              hip = (look.woman ? 0.108f : 0.100f) * g;
  s.cone({-0.072f * shoulder, -0.012f, 1.30f}, 0.108f * g + c, {0.072f * shoulder, -0.012f, 1.30f}, 0.108f * g + c,
         0.05f, kForward, 1.05f);
  s.cone({-0.058f, -0.004f, 1.10f}, waist + c, {0.058f, -0.004f, 1.10f}, waist + c, 0.09f);
  const float hem = look.skirt ? hip - 0.012f : hip + c + 0.014f;  // tucked in, or hanging over the trousers
  s.cone({-0.066f, -0.006f, 0.95f}, hem, {0.066f, -0.006f, 0.95f}, hem, 0.09f);
  s.cone({-0.150f * shoulder, -0.016f, 1.402f}, 0.050f + c, {0.150f * shoulder, -0.016f, 1.402f}, 0.050f + c, 0.06f);
  for (const float x : {-1.f, 1.f}) {
    s.cone({x * 0.02f, -0.024f, 1.47f}, 0.045f + c, {x * 0.13f, -0.018f, 1.425f}, 0.035f + c, 0.05f);
    if (look.woman) s.ellipsoid({x * 0.072f, 0.082f, 1.265f}, {0.060f, 0.056f, 0.058f}, 0.05f);
  }
  if (!look.woman && g > 1.05f) s.ellipsoid({0, 0.055f, 1.06f}, {0.115f, 0.085f * g, 0.11f}, 0.07f);
  const float arm = (look.woman ? 0.045f : 0.051f) * std::sqrt(g) + c * 0.8f;
  for (const int side : {1, -1}) {
    const float end = look.long_sleeves ? 0.540f : 0.215f;
    s.cone(arm_point(side, 0.f), arm + 0.004f, arm_point(side, 0.20f), arm - (look.long_sleeves ? 0.004f : -0.004f),
           0.045f);
    if (look.long_sleeves) {
      s.cone(arm_point(side, 0.20f), arm - 0.004f, arm_point(side, 0.30f), arm - 0.008f, 0.03f);
      s.cone(arm_point(side, 0.30f), arm - 0.008f, arm_point(side, end), 0.036f, 0.03f);
    }
    s.cut(arm_point(side, end), rest_arm_direction(side).cast<float>());
  }
  s.cut({0, 0, look.skirt ? 0.95f : 0.885f}, -Vector3f::UnitZ());
  const std::uint32_t seed = static_cast<std::uint32_t>(look.seed >> 7);
  s.displace([seed](const Vector3f& p) {
    // Slanted folds on the trunk, rings on the sleeves.
    const float x = std::abs(p.x()), sleeve = smooth_step(0.20f, 0.30f, x);
    const float trunk = noise_3d({p.x() * 9 + 50 + p.z() * 8, p.y() * 9 + 50, p.z() * 13}, seed);
    const float along = (x * 0.64f - p.z() * 0.77f) * 34;
    const float rings = noise_3d({p.y() * 14 + 50, x * 6 + 20, along}, seed + 5);
    return 0.0075f * (1 - sleeve) * trunk + 0.0065f * sleeve * rings;
  });
  return s;
}

ImplicitShape collar_shape() {
  ImplicitShape s;
  constexpr int kParts = 16;
  for (int i = 0; i < kParts; ++i) {
    const float a = 2 * static_cast<float>(M_PI) * static_cast<float>(i) / kParts,
                b = 2 * static_cast<float>(M_PI) * static_cast<float>(i + 1) / kParts;
    auto at = [](float angle) {
      return Vector3f(0.066f * std::sin(angle), -0.014f + 0.066f * std::cos(angle), 1.487f - 0.020f * std::cos(angle));
    };
    s.cone(at(a), 0.012f, at(b), 0.012f, 0.01f);
  }
  return s;
}

ImplicitShape trousers_shape(const PersonLook& look) {
  ImplicitShape s;
  const float g = static_cast<float>(look.girth), c = 0.008f, hip = (look.woman ? 0.112f : 0.100f) * g;
  s.cone({-0.066f, -0.005f, 0.95f}, hip + c, {0.066f, -0.005f, 0.95f}, hip + c, 0.05f, kForward, 1.02f);
  s.cone({-0.058f, -0.004f, 1.04f}, 0.088f * g, {0.058f, -0.004f, 1.04f}, 0.088f * g, 0.05f);
  for (const float x : {-1.f, 1.f}) {
    s.ellipsoid({x * 0.062f, -0.052f, 0.915f}, {0.078f * g, 0.076f * g, 0.085f}, 0.05f);
    s.cone({x * 0.088f, 0, 0.90f}, (look.woman ? 0.090f : 0.087f) * g + c, {x * 0.105f, 0.006f, 0.52f}, 0.058f * g + c,
           0.035f);
    s.cone({x * 0.105f, 0.004f, 0.52f}, 0.058f * g + c, {x * 0.110f, -0.014f, 0.36f}, 0.060f + c, 0.03f);
    s.cone({x * 0.110f, -0.014f, 0.36f}, 0.060f + c, {x * 0.115f, -0.012f, 0.075f}, 0.052f + c, 0.04f);
  }
  s.cut({0, 0, 0.055f}, -Vector3f::UnitZ());
  const std::uint32_t seed = static_cast<std::uint32_t>(look.seed >> 11);
  s.displace([seed](const Vector3f& p) {
    const float low = smooth_step(0.35f, 0.08f, p.z()), knee = 1.f - std::min(1.f, std::abs(p.z() - 0.5f) / 0.14f);
    const float rings = noise_3d({p.x() * 10 + 50, p.y() * 10 + 50, p.z() * 30 + p.y() * 10}, seed);
    return (0.003f + 0.007f * low + 0.004f * std::max(0.f, knee)) * rings;
  });
  return s;
}

ImplicitShape skirt_shape(const PersonLook& look) {
  ImplicitShape s;
  const float g = static_cast<float>(look.girth);
  s.cone({-0.06f, -0.004f, 1.05f}, 0.104f * g, {0.06f, -0.004f, 1.05f}, 0.104f * g, 0.04f);
  s.cone({-0.068f, -0.012f, 0.93f}, 0.126f * g, {0.068f, -0.012f, 0.93f}, 0.126f * g, 0.06f);
  s.cone({0, 0, 0.90f}, 0.185f * g, {0, 0, 0.50f}, 0.225f * g, 0.06f, kForward, 1.25f);
  s.cut({0, 0, 1.045f}, Vector3f::UnitZ());
  s.cut({0, 0, 0.53f}, -Vector3f::UnitZ());
  const std::uint32_t seed = static_cast<std::uint32_t>(look.seed >> 11);
  s.displace([seed](const Vector3f& p) {
    const float angle = std::atan2(p.y(), p.x()), down = smooth_step(0.95f, 0.55f, p.z());
    return down * 0.014f * std::sin(9 * angle + 2 * noise_3d({p.x() * 4 + 9, p.y() * 4 + 9, p.z() * 3}, seed));
  });
  return s;
}

ImplicitShape shoes_shape() {
  ImplicitShape s;
  for (const float x : {-1.f, 1.f}) {
    s.cone({x * 0.115f, -0.050f, 0.040f}, 0.040f, {x * 0.122f, 0.060f, 0.036f}, 0.044f, 0.03f, Vector3f::UnitZ(),
           1.05f);
    s.cone({x * 0.122f, 0.060f, 0.034f}, 0.044f, {x * 0.128f, 0.160f, 0.024f}, 0.034f, 0.03f, Vector3f::UnitZ(), 1.25f);
    s.cone({x * 0.115f, -0.025f, 0.06f}, 0.040f, {x * 0.115f, -0.02f, 0.115f}, 0.042f, 0.03f);
  }
  s.cut({0, 0, 0.0f}, -Vector3f::UnitZ());
  s.cut({0, 0, 0.125f}, Vector3f::UnitZ());
  return s;
}

}  // namespace

std::vector<BodyPart> make_body_parts(const PersonLook& look, SceneBuilder& builder) {
  using Chart = BodyPart::Chart;
  const std::uint16_t head = builder.add_texture([look] { return paint_head({512, 256}, look); });
  const std::uint16_t skin = builder.add_texture([look] { return paint_skin({128, 128}, look); });
  const std::uint16_t top = builder.add_texture([look] { return paint_top({1024, 512}, look); });
  const std::uint16_t bottom = builder.add_texture([look] { return paint_bottom({1024, 512}, look); });
  const std::uint16_t shoes = builder.add_texture([look] {
    return paint_material({128, 128}, look.shoes, 0.35f, static_cast<std::uint32_t>(look.seed));
  });
  std::vector<BodyPart> parts;
  parts.push_back({Chart::kHead, head_shape(look), 0.0075f, head, 0.3, false});
  if (look.hair_style != PersonLook::Hair::kBald) {
    parts.push_back({Chart::kBox, hair_shape(look), 0.010f, builder.add_texture([look] {
                       return paint_hair({256, 256}, look);
                     }),
                     0.25, false});
  }
  parts.push_back({Chart::kBox, hands_shape(), 0.0075f, skin, 0.2, false});
  if (!look.long_sleeves) parts.push_back({Chart::kBox, bare_arms(), 0.014f, skin, 0.2, false});
  parts.push_back({Chart::kFrontBack, top_shape(look), 0.017f, top, 0.7, false});
  if (look.collar) parts.push_back({Chart::kFrontBack, collar_shape(), 0.010f, top, 0.7, false});
  if (look.skirt) {
    parts.push_back({Chart::kFrontBack, skirt_shape(look), 0.018f, bottom, 1.05, true});
    parts.push_back({Chart::kBox, bare_legs(), 0.016f, skin, 0.2, false});
  } else {
    parts.push_back({Chart::kFrontBack, trousers_shape(look), 0.018f, bottom, 1.05, false});
  }
  parts.push_back({Chart::kBox, shoes_shape(), 0.012f, shoes, 0.2, false});
  return parts;
}

}  // namespace semvslam::render
