#include <algorithm>
#include <cmath>
#include <opencv2/imgproc.hpp>

#include "semvslam/render/noise.h"
#include "semvslam/render/paint.h"
#include "semvslam/render/person.h"

namespace semvslam::render {
namespace {

/// Blends a colour into an image through a soft ellipse. Centre and radii in pixels; strength 0..1.
void soften(cv::Mat& image, cv::Point2f centre, cv::Size2f radii, const cv::Vec3f& colour, float strength) {
  const int x0 = std::max(0, static_cast<int>(centre.x - 2 * radii.width)),
            x1 = std::min(image.cols - 1, static_cast<int>(centre.x + 2 * radii.width));
  const int y0 = std::max(0, static_cast<int>(centre.y - 2 * radii.height)),
            y1 = std::min(image.rows - 1, static_cast<int>(centre.y + 2 * radii.height));
  for (int y = y0; y <= y1; ++y) {
    for (int x = x0; x <= x1; ++x) {
      const float dx = (static_cast<float>(x) - centre.x) / radii.width,
                  dy = (static_cast<float>(y) - centre.y) / radii.height;
      const float a = strength * std::exp(-1.2f * (dx * dx + dy * dy));
      auto& pixel = image.at<cv::Vec3b>(y, x);
      for (int c = 0; c < 3; ++c)
        pixel[c] = cv::saturate_cast<std::uint8_t>(static_cast<float>(pixel[c]) * (1 - a) + colour[c] * a);
    }
  }
}

void mottle(cv::Mat& image, float strength, std::uint32_t seed, float frequency) {
  for (int y = 0; y < image.rows; ++y) {
    auto* row = image.ptr<cv::Vec3b>(y);
    for (int x = 0; x < image.cols; ++x) {
      const float n =
          fractal_noise(static_cast<float>(x) * frequency, static_cast<float>(y) * frequency, seed, 1024, 3) - 0.5f;
      for (int c = 0; c < 3; ++c)
        row[x][c] = cv::saturate_cast<std::uint8_t>(static_cast<float>(row[x][c]) *
                                                    (1.f + strength * n * (c == 2 ? 0.7f : 1.f)));
    }
  }
}

struct FaceFrame {
  int width, height;
  cv::Point2f at(float x_m, float z_m) const {
    return {(0.5f + x_m / 0.22f) * static_cast<float>(width), (1.78f - z_m) / 0.28f * static_cast<float>(height)};
  }
  float px(float metres) const { return metres / 0.22f * static_cast<float>(width); }
};

constexpr int kShift = 4;  // sub-pixel bits of OpenCV's drawing

cv::Point fixed(cv::Point2f p) {
  return {static_cast<int>(std::lround(p.x * 16)), static_cast<int>(std::lround(p.y * 16))};
}

void ellipse(cv::Mat& image, cv::Point2f centre, float rx, float ry, double angle_deg, const cv::Scalar& colour) {
  cv::ellipse(image, fixed(centre), {static_cast<int>(rx * 16), static_cast<int>(ry * 16)}, angle_deg, 0, 360, colour,
              cv::FILLED, cv::LINE_AA, kShift);
}

void polygon(cv::Mat& image, const std::vector<cv::Point2f>& points, const cv::Scalar& colour) {
  std::vector<cv::Point> p;
  for (const auto& q : points) p.push_back(fixed(q));
  cv::fillPoly(image, std::vector<std::vector<cv::Point>>{p}, colour, cv::LINE_AA, kShift);
}

void paint_eye(cv::Mat& face, const FaceFrame& f, float side, const PersonLook& look) {
  const float x = side * 0.0315f, z = 1.633f;
  soften(face, f.at(x, z + 0.004f), {f.px(0.019f), f.px(0.012f)}, look.skin * 0.62f, 0.55f);
  std::vector<cv::Point2f> outline;
  for (int i = 0; i <= 12; ++i) {  // almond
    const float a = static_cast<float>(M_PI) * static_cast<float>(i) / 12;
    outline.push_back(f.at(x - 0.0142f * std::cos(a), z + 0.0066f * std::sin(a)));
  }
  for (int i = 0; i <= 12; ++i) {
    const float a = static_cast<float>(M_PI) * static_cast<float>(i) / 12;
    outline.push_back(f.at(x + 0.0142f * std::cos(a), z - 0.0048f * std::sin(a)));
  }
  polygon(face, outline, cv::Scalar(222, 226, 232));
  ellipse(face, f.at(x, z + 0.0006f), f.px(0.0062f), f.px(0.0062f), 0, scalar(look.eyes));
  ellipse(face, f.at(x, z + 0.0006f), f.px(0.0031f), f.px(0.0031f), 0, cv::Scalar(12, 12, 14));
  ellipse(face, f.at(x + 0.002f, z + 0.003f), f.px(0.0013f), f.px(0.0013f), 0, cv::Scalar(250, 250, 250));
  std::vector<cv::Point2f> lid;
  for (int i = 0; i <= 12; ++i) {
    const float a = static_cast<float>(M_PI) * static_cast<float>(i) / 12;
    lid.push_back(f.at(x - 0.0150f * std::cos(a), z + 0.0070f * std::sin(a)));
  }
  for (int i = 12; i >= 0; --i) {
    const float a = static_cast<float>(M_PI) * static_cast<float>(i) / 12;
    lid.push_back(f.at(x - 0.0145f * std::cos(a), z + (look.woman ? 0.0046f : 0.0053f) * std::sin(a)));
  }
  polygon(face, lid, cv::Scalar(24, 24, 30));
  const float lift = 0.0205f, thick = look.woman ? 0.0024f : 0.0038f;
  std::vector<cv::Point2f> brow{
      f.at(x - side * 0.014f, z + lift - 0.002f), f.at(x, z + lift + 0.003f),
      f.at(x + side * 0.018f, z + lift - 0.001f), f.at(x + side * 0.0195f, z + lift - 0.003f),
      f.at(x, z + lift + 0.003f - 1.6f * thick),  f.at(x - side * 0.014f, z + lift - 0.002f - 1.5f * thick)};
  polygon(face, brow, scalar(look.hair * 0.8f));
}

void paint_mouth_and_nose(cv::Mat& face, const FaceFrame& f, const PersonLook& look) {
  const cv::Vec3f dark = look.skin * 0.55f;
  for (const float side : {-1.f, 1.f}) {
    soften(face, f.at(side * 0.0085f, 1.5925f), {f.px(0.0042f), f.px(0.0026f)}, look.skin * 0.18f, 0.9f);
    soften(face, f.at(side * 0.014f, 1.600f), {f.px(0.003f), f.px(0.008f)}, dark, 0.5f);
    soften(face, f.at(side * 0.027f, 1.583f), {f.px(0.003f), f.px(0.014f)}, dark, 0.28f);
    soften(face, f.at(side * 0.043f, 1.603f), {f.px(0.018f), f.px(0.014f)},
           {look.skin[0] * 0.86f, look.skin[1] * 0.86f, std::min(250.f, look.skin[2] * 1.05f)}, 0.45f);
  }
  soften(face, f.at(0, 1.622f), {f.px(0.004f), f.px(0.020f)}, look.skin * 1.12f, 0.5f);
  const cv::Vec3f lip = look.woman ? cv::Vec3f(look.skin[0] * 0.62f, look.skin[1] * 0.52f, look.skin[2] * 0.88f)
                                   : cv::Vec3f(look.skin[0] * 0.76f, look.skin[1] * 0.70f, look.skin[2] * 0.88f);
  std::vector<cv::Point2f> upper{f.at(-0.024f, 1.568f), f.at(-0.011f, 1.574f), f.at(-0.004f, 1.5765f),
                                 f.at(0, 1.575f),       f.at(0.004f, 1.5765f), f.at(0.011f, 1.574f),
                                 f.at(0.024f, 1.568f),  f.at(0, 1.5675f)};
  std::vector<cv::Point2f> lower{f.at(-0.024f, 1.568f), f.at(0, 1.5675f), f.at(0.024f, 1.568f),
                                 f.at(0.012f, 1.5595f), f.at(0, 1.5575f), f.at(-0.012f, 1.5595f)};
  polygon(face, upper, scalar(lip * 0.86f));
  polygon(face, lower, scalar(lip));
  soften(face, f.at(0, 1.5677f), {f.px(0.021f), f.px(0.0012f)}, look.skin * 0.22f, 0.95f);
  soften(face, f.at(0, 1.5515f), {f.px(0.014f), f.px(0.003f)}, dark, 0.45f);
}

/// Folds as light and shade: slanted ridges of stretched noise.
float fold_at(float x_m, float z_m, std::uint32_t seed) {
  const float a = fractal_noise((x_m + 0.6f * z_m) * 14 + 40, (z_m - 0.25f * x_m) * 6 + 40, seed, 1024, 3);
  const float b = fractal_noise((x_m - 0.7f * z_m) * 12 + 40, (z_m + 0.3f * x_m) * 7 + 40, seed + 9, 1024, 3);
  const float ridge = std::abs(a - 0.5f) * 2 - 0.25f + 0.6f * (b - 0.5f);
  return 1.f + 0.34f * ridge;
}

/// fold_at over both halves of an image of clothes, computed at a quarter of the size. CV_32FC1.
cv::Mat fold_light(cv::Size size, float top_m, float height_m, float stretch, std::uint32_t seed) {
  cv::Mat small(size.height / 4, size.width / 4, CV_32FC1), out;
  const int half = small.cols / 2;
  for (int y = 0; y < small.rows; ++y) {
    for (int x = 0; x < small.cols; ++x) {
      const float x_m = ((static_cast<float>(x % half) + 0.5f) / static_cast<float>(half) - 0.5f) * 0.7f;
      const float z_m = top_m - (static_cast<float>(y) + 0.5f) / static_cast<float>(small.rows) * height_m;
      small.at<float>(y, x) = fold_at(x_m, z_m * stretch, seed + (x >= half));
    }
  }
  cv::resize(small, out, size, 0, 0, cv::INTER_CUBIC);
  return out;
}

cv::Vec3f cloth_tone(PersonLook::Cloth cloth, const cv::Vec3f& tone, const cv::Vec3f& second, float x_m, float z_m,
                     float period_m) {
  using Cloth = PersonLook::Cloth;
  auto band = [&](float v, float width) {
    const float phase = v / period_m - std::floor(v / period_m);
    return smooth_step(0.f, 0.03f, phase) * smooth_step(width + 0.03f, width, phase);
  };
  if (cloth == Cloth::kStripes) {
    const float m = band(z_m, 0.42f);
    return tone * (1 - m) + second * m;
  }
  if (cloth == Cloth::kChecks) {
    const float m = 0.5f * band(z_m, 0.4f) + 0.5f * band(x_m + 1.f, 0.4f),
                line = std::max(band(z_m + 0.3f * period_m, 0.06f), band(x_m + 1.3f * period_m, 0.06f));
    return (tone * (1 - m) + second * m) * (1.f - 0.35f * line);
  }
  return tone;
}

}  // namespace

cv::Mat paint_head(cv::Size size, const PersonLook& look) {
  cv::Mat image(size, CV_8UC3, scalar(look.skin));
  const auto seed = static_cast<std::uint32_t>(look.seed);
  mottle(image, 0.14f, seed, 0.10f);
  const FaceFrame f{size.width / 2, size.height};
  cv::Mat face = image(cv::Rect(0, 0, f.width, f.height));
  soften(face, f.at(0, 1.545f), {f.px(0.05f), f.px(0.012f)}, look.skin * 0.9f, 0.4f);
  for (const float side : {-1.f, 1.f}) paint_eye(face, f, side, look);
  if (look.beard) {
    cv::Mat before = face.clone();
    for (const float side : {-1.f, 1.f}) {
      soften(face, f.at(side * 0.035f, 1.562f), {f.px(0.022f), f.px(0.022f)}, look.hair, 0.85f);
      soften(face, f.at(side * 0.058f, 1.585f), {f.px(0.011f), f.px(0.03f)}, look.hair, 0.8f);
      soften(face, f.at(side * 0.013f, 1.5825f), {f.px(0.013f), f.px(0.004f)}, look.hair, 0.85f);
    }
    soften(face, f.at(0, 1.538f), {f.px(0.034f), f.px(0.014f)}, look.hair, 0.9f);
    mottle(face, 0.3f, seed + 3, 0.5f);
  } else if (!look.woman) {
    soften(face, f.at(0, 1.548f), {f.px(0.045f), f.px(0.022f)}, look.skin * 0.72f, 0.35f);
  }
  paint_mouth_and_nose(face, f, look);
  if (look.glasses) {
    for (const float side : {-1.f, 1.f}) {
      const cv::Point2f c = f.at(side * 0.032f, 1.633f);
      cv::ellipse(face, fixed(c), {static_cast<int>(f.px(0.022f) * 16), static_cast<int>(f.px(0.016f) * 16)}, 0, 0, 360,
                  cv::Scalar(26, 24, 24), 2, cv::LINE_AA, kShift);
    }
    cv::line(face, f.at(-0.010f, 1.636f), f.at(0.010f, 1.636f), cv::Scalar(26, 24, 24), 2, cv::LINE_AA);
    for (const float side : {-1.f, 1.f})
      cv::line(face, f.at(side * 0.054f, 1.637f), f.at(side * 0.09f, 1.64f), cv::Scalar(26, 24, 24), 2, cv::LINE_AA);
  }
  if (look.hair_style == PersonLook::Hair::kBald || look.hair_style == PersonLook::Hair::kCropped) {
    soften(face, f.at(0, 1.76f), {f.px(0.08f), f.px(0.035f)}, look.hair,
           look.hair_style == PersonLook::Hair::kBald ? 0.12f : 0.7f);
  }
  return image;
}

cv::Mat paint_skin(cv::Size size, const PersonLook& look) {
  cv::Mat image(size, CV_8UC3, scalar(look.skin * 0.97f));
  mottle(image, 0.16f, static_cast<std::uint32_t>(look.seed) + 1, 0.125f);
  return image;
}

cv::Mat paint_hair(cv::Size size, const PersonLook& look) {
  cv::Mat image(size, CV_8UC3);
  const auto seed = static_cast<std::uint32_t>(look.seed) + 2;
  for (int y = 0; y < size.height; ++y) {
    for (int x = 0; x < size.width; ++x) {
      const float fx = static_cast<float>(x), fy = static_cast<float>(y);
      const float bend = 6.f * value_noise(fx / 64, fy / 64, seed + 7, 4);
      const float strand = fractal_noise((fx + bend) * 0.25f, fy / 64, seed, size.width / 4, 3, 0.8f);
      const float shine = fractal_noise(fx / 64, fy / 32, seed + 4, 4, 2);
      cv::Vec3f c = look.hair * (0.45f + 1.0f * strand) * (0.75f + 0.6f * shine);
      c += cv::Vec3f(14, 14, 14) * smooth_step(0.55f, 0.8f, shine);
      image.at<cv::Vec3b>(y, x) = {cv::saturate_cast<std::uint8_t>(c[0]), cv::saturate_cast<std::uint8_t>(c[1]),
                                   cv::saturate_cast<std::uint8_t>(c[2])};
    }
  }
  return image;
}

cv::Mat paint_top(cv::Size size, const PersonLook& look) {
  cv::Mat image(size, CV_8UC3);
  RandomStream random(mix64(look.seed, 8));
  const auto seed = static_cast<std::uint32_t>(look.seed >> 3);
  const auto period = static_cast<float>(random.uniform(0.03, 0.09));
  const int half = size.width / 2;
  const cv::Mat folds = fold_light(size, 1.55f, 0.7f, 1.f, seed);
  for (int y = 0; y < size.height; ++y) {
    for (int x = 0; x < size.width; ++x) {
      const float x_m = (static_cast<float>(x % half) / static_cast<float>(half) - 0.5f) * 0.7f;
      const float z_m = 1.55f - static_cast<float>(y) / static_cast<float>(size.height) * 0.7f;
      const float weave =
          0.93f + 0.14f * value_noise(static_cast<float>(x) * 0.7f, static_cast<float>(y) * 0.7f, seed, 1024);
      const cv::Vec3f c =
          cloth_tone(look.top, look.top_tone, look.top_second, x_m, z_m, period) * (weave * folds.at<float>(y, x));
      image.at<cv::Vec3b>(y, x) = {cv::saturate_cast<std::uint8_t>(c[0]), cv::saturate_cast<std::uint8_t>(c[1]),
                                   cv::saturate_cast<std::uint8_t>(c[2])};
    }
  }
  auto at = [&](float x_m, float z_m) {
    return cv::Point(static_cast<int>((0.5f + x_m / 0.7f) * static_cast<float>(half)),
                     static_cast<int>((1.55f - z_m) / 0.7f * static_cast<float>(size.height)));
  };
  if (look.top == PersonLook::Cloth::kPrint) {
    const cv::Rect area(at(-0.085f, 1.36f), at(0.085f, 1.16f));
    cv::Mat print = paint_poster({256, 256}, look.seed), fitted;
    cv::resize(print, fitted, area.size(), 0, 0, cv::INTER_AREA);
    cv::Mat target = image(area);
    cv::addWeighted(target, 0.3, fitted, 0.7, 0, target);
  }
  if (look.collar) {  // button line of a shirt, and a pocket
    const cv::Scalar seam = scalar(look.top_tone * 0.6f);
    for (const float x : {-0.017f, 0.017f}) cv::line(image, at(x, 1.5f), at(x, 0.86f), seam, 1, cv::LINE_AA);
    for (float z = 1.44f; z > 0.9f; z -= 0.085f)
      cv::circle(image, at(0, z), 3, cv::Scalar(225, 228, 230), cv::FILLED, cv::LINE_AA);
    cv::rectangle(image, at(0.05f, 1.33f), at(0.14f, 1.22f), seam, 1, cv::LINE_AA);
  }
  return image;
}

cv::Mat paint_bottom(cv::Size size, const PersonLook& look) {
  cv::Mat image(size, CV_8UC3);
  const auto seed = static_cast<std::uint32_t>(look.seed >> 5);
  const int half = size.width / 2;
  const bool jeans = look.bottom == PersonLook::Cloth::kJeans;
  const cv::Mat folds = fold_light(size, 1.05f, 1.05f, 1.3f, seed);
  for (int y = 0; y < size.height; ++y) {
    for (int x = 0; x < size.width; ++x) {
      const float x_m = (static_cast<float>(x % half) / static_cast<float>(half) - 0.5f) * 0.7f;
      const float z_m = 1.05f - static_cast<float>(y) / static_cast<float>(size.height) * 1.05f;
      float light = folds.at<float>(y, x);
      cv::Vec3f c = cloth_tone(look.bottom, look.bottom_tone, look.bottom_tone * 1.5f, x_m, z_m, 0.07f);
      if (jeans) {
        const float twill = 0.88f + 0.24f * value_noise(static_cast<float>(x + y) * 0.5f,
                                                        static_cast<float>(x - y) * 0.15f + 300, seed + 4, 1024);
        const float dx = (std::abs(x_m) - 0.1f) / 0.035f,
                    worn = std::exp(-dx * dx) * smooth_step(0.25f, 0.6f, z_m) * smooth_step(0.95f, 0.7f, z_m);
        c = c * (1.f + 0.45f * worn);
        light *= twill;
        if (std::abs(std::abs(x_m) - 0.165f) < 0.003f) light *= 0.7f;
      }
      const float gap = smooth_step(0.012f, 0.0f, std::abs(x_m)) * smooth_step(0.86f, 0.80f, z_m);
      c = c * (light * (1.f - 0.5f * gap));
      image.at<cv::Vec3b>(y, x) = {cv::saturate_cast<std::uint8_t>(c[0]), cv::saturate_cast<std::uint8_t>(c[1]),
                                   cv::saturate_cast<std::uint8_t>(c[2])};
    }
  }
  auto at = [&](float x_m, float z_m, int side) {
    return cv::Point(side * half + static_cast<int>((0.5f + x_m / 0.7f) * static_cast<float>(half)),
                     static_cast<int>((1.05f - z_m) / 1.05f * static_cast<float>(size.height)));
  };
  const cv::Scalar stitch = jeans ? cv::Scalar(90, 140, 180) : scalar(look.bottom_tone * 0.6f);
  for (int side = 0; side < 2; ++side) {
    cv::line(image, at(-0.3f, 0.995f, side), at(0.3f, 0.995f, side), stitch, 1, cv::LINE_AA);
    for (const float x : {-0.09f, 0.09f}) {
      if (side)
        cv::rectangle(image, at(x - 0.05f, 0.93f, 1), at(x + 0.05f, 0.81f, 1), stitch, 1, cv::LINE_AA);
      else
        cv::line(image, at(x * 0.7f, 0.99f, 0), at(x * 1.7f, 0.92f, 0), stitch, 1, cv::LINE_AA);
    }
  }
  return image;
}

}  // namespace semvslam::render
