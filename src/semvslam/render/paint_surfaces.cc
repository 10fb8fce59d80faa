#include <algorithm>
#include <cmath>
#include <opencv2/imgproc.hpp>

#include "semvslam/render/noise.h"
#include "semvslam/render/paint.h"

namespace semvslam::render {
namespace {

cv::Vec3b to_pixel(const cv::Vec3f& c) {
  cv::Vec3b out;
  for (int i = 0; i < 3; ++i) out[i] = static_cast<std::uint8_t>(std::clamp(c[i], 0.f, 255.f));
  return out;
}

/// Calls pixel(x, y) -> colour for the whole image.
template <typename Pixel>
cv::Mat paint(cv::Size size, Pixel&& pixel) {
  cv::Mat image(size, CV_8UC3);
  for (int y = 0; y < size.height; ++y) {
    auto* row = image.ptr<cv::Vec3b>(y);
    for (int x = 0; x < size.width; ++x) row[x] = to_pixel(pixel(x, y));
  }
  return image;
}

}  // namespace

cv::Point any_place(RandomStream& random, int width, int height) {
  const int y = random.below(height);
  return {random.below(width), y};
}

cv::Vec3f hue_colour(double hue, double saturation, double value) {
  auto channel = [&](double n) {
    const double k = std::fmod(n + hue * 6.0, 6.0);
    return static_cast<float>(255.0 * (value - value * saturation * std::clamp(std::min(k, 4.0 - k), 0.0, 1.0)));
  };
  return {channel(1), channel(3), channel(5)};
}

cv::Mat paint_wood(cv::Size size, const cv::Vec3f& tone, int boards, std::uint32_t seed) {
  const float board_px = static_cast<float>(size.height) / static_cast<float>(boards);
  struct Piece {
    int board = -1, number = -1;
    std::uint32_t seed = 0;
    float light = 0, warm = 0;
  } piece;  // of the pixel before: most pixels share it
  return paint(size, [&, piece](int x, int y) mutable -> cv::Vec3f {
    const int board = static_cast<int>(static_cast<float>(y) / board_px);
    const float across = static_cast<float>(y) - static_cast<float>(board) * board_px;
    // Boards are staggered pieces of unequal length.
    const float start = lattice_hash(board, 7, seed) * static_cast<float>(size.width);
    const float piece_px = board_px * (5.f + 6.f * lattice_hash(board, 3, seed));
    const float run = static_cast<float>(x) + start;
    const int number = boards > 1 ? static_cast<int>(run / piece_px) : 0;
    const float along = boards > 1 ? run - static_cast<float>(number) * piece_px : run;
    if (board != piece.board || number != piece.number) {
      piece = {board, number, seed + static_cast<std::uint32_t>(board * 131 + number * 7919),
               0.78f + 0.30f * lattice_hash(board, number, seed + 5), lattice_hash(board, number, seed + 6) - 0.5f};
    }
    const float warp = fractal_noise(along * 0.006f, across * 0.02f + 11.f, piece.seed, 4096, 2);
    const float ring = (across * 0.05f + warp * 7.f) * 0.55f + 0.3f * warp;
    const float grain = smooth_step(0.f, 1.f, std::abs(2.f * (ring - std::floor(ring)) - 1.f));
    const float fibre = fractal_noise(along * 0.03f, across * 0.9f, piece.seed + 1, 4096, 2);
    float light = piece.light - 0.20f * grain * grain + 0.28f * (fibre - 0.5f);
    if (value_noise(along * 0.08f, across * 1.3f, piece.seed + 2, 4096) > 0.86f) light *= 0.82f;  // pores
    const float knot = value_noise(along * 0.016f, across * 0.055f, piece.seed + 3, 4096);
    if (knot > 0.88f) light *= 1.f - 3.2f * (knot - 0.88f);
    if (boards > 1) {
      const float gap = std::min({across, board_px - across, along, piece_px - along});
      light *= 0.45f + 0.55f * smooth_step(0.f, 1.8f, gap);
    }
    light *= 0.9f + 0.2f * value_noise(static_cast<float>(x) * 0.012f, static_cast<float>(y) * 0.012f, seed + 9, 4096);
    return {tone[0] * light * (1.f - 0.12f * piece.warm), tone[1] * light,
            tone[2] * light * (1.f + 0.06f * piece.warm)};
  });
}

cv::Mat paint_plaster(cv::Size size, const cv::Vec3f& tone, float roughness, std::uint32_t seed) {
  constexpr int kCoarse = 8;  // clouds and stains are smooth: painted small, then enlarged
  cv::Mat broad(size.height / kCoarse, size.width / kCoarse, CV_32FC1), smooth;
  for (int y = 0; y < broad.rows; ++y) {
    for (int x = 0; x < broad.cols; ++x) {
      const float fx = (static_cast<float>(x) + 0.5f) * kCoarse, fy = (static_cast<float>(y) + 0.5f) * kCoarse;
      const float clouds = fractal_noise(fx * 0.006f, fy * 0.006f, seed, 4096, 4) - 0.5f;
      const float stain = fractal_noise(fx * 0.02f, fy * 0.008f, seed + 21, 4096, 4);
      broad.at<float>(y, x) = 0.25f * clouds - 0.9f * std::max(0.f, stain - 0.66f);
    }
  }
  cv::resize(broad, smooth, size, 0, 0, cv::INTER_CUBIC);
  std::vector<float> above(size.width, 0.5f);  // relief of the row before: light falls from above
  return paint(size, [&, above](int x, int y) mutable -> cv::Vec3f {
    const float fx = static_cast<float>(x), fy = static_cast<float>(y);
    const float relief = fractal_noise(fx * 0.11f, fy * 0.11f, seed + 4, 4096, 3);
    const float slope = relief - above[x];
    above[x] = relief;
    const float speck = value_noise(fx * 0.35f, fy * 0.35f, seed + 5, 4096);
    float light = 1.f + roughness * (smooth.at<float>(y, x) + 0.9f * slope);
    if (speck > 0.955f) light -= roughness * 0.35f;
    if (speck < 0.03f) light += roughness * 0.12f;
    return tone * light;
  });
}

cv::Mat paint_bricks(cv::Size size, int courses, std::uint32_t seed) {
  const float brick_h = static_cast<float>(size.height) / static_cast<float>(courses), brick_w = brick_h * 3.f;
  const int across = std::max(1, static_cast<int>(std::lround(static_cast<float>(size.width) / brick_w)));
  const float width = static_cast<float>(size.width) / static_cast<float>(across);
  return paint(size, [&](int x, int y) -> cv::Vec3f {
    const float fx = static_cast<float>(x), fy = static_cast<float>(y);
    const float wobble = 3.f * (fractal_noise(fx * 0.04f, fy * 0.04f, seed + 8, 4096, 2) - 0.5f);
    const int course = static_cast<int>(fy / brick_h);
    const float run = fx + wobble + (course % 2 ? width / 2 : 0.f);
    int column = static_cast<int>(std::floor(run / width));
    const float a = run - static_cast<float>(column) * width, b = fy - static_cast<float>(course) * brick_h + wobble;
    column = (column + across) % across;
    const float gap = std::min(std::min(a, width - a), std::min(b, brick_h - b));
    const float joint = smooth_step(brick_h * 0.05f, brick_h * 0.10f, gap);
    const float tone = lattice_hash(column, course, seed);
    const float grit = fractal_noise(fx * 0.12f, fy * 0.12f, seed + 1, 4096, 4);
    const float pits = value_noise(fx * 0.3f, fy * 0.3f, seed + 2, 4096) > 0.9f ? 0.75f : 1.f;
    const float burnt = lattice_hash(column, course, seed + 3) > 0.8f ? 0.62f : 1.f;
    const cv::Vec3f brick =
        cv::Vec3f(62 + 30 * tone, 84 + 34 * tone, 148 + 46 * tone) * ((0.62f + 0.7f * grit) * pits * burnt);
    const cv::Vec3f mortar = cv::Vec3f(150, 160, 166) * (0.7f + 0.5f * grit);
    const float edge = 0.8f + 0.2f * smooth_step(brick_h * 0.1f, brick_h * 0.2f, gap);
    return mortar * (1.f - joint) + brick * (joint * edge);
  });
}

cv::Mat paint_tiles(cv::Size size, int across, const cv::Vec3f& tone, std::uint32_t seed) {
  const float side = static_cast<float>(size.width) / static_cast<float>(across);
  return paint(size, [&](int x, int y) -> cv::Vec3f {
    const float fx = static_cast<float>(x), fy = static_cast<float>(y);
    const int i = static_cast<int>(fx / side), j = static_cast<int>(fy / side);
    const float a = fx - static_cast<float>(i) * side, b = fy - static_cast<float>(j) * side;
    const float gap = std::min(std::min(a, side - a), std::min(b, side - b));
    const auto own = seed + static_cast<std::uint32_t>(i * 1013 + j * 7);
    const float cloud = fractal_noise(a * 0.02f, b * 0.02f, own, 4096, 4);
    const float vein = std::abs(fractal_noise(a * 0.015f, b * 0.015f, own + 3, 4096, 4) - 0.5f);
    float light =
        0.8f + 0.22f * lattice_hash(i, j, seed) + 0.35f * (cloud - 0.5f) - 0.22f * smooth_step(0.03f, 0.0f, vein);
    const float speck = value_noise(fx * 0.45f, fy * 0.45f, seed + 6, 4096);
    light *= speck > 0.92f ? 0.82f : 1.f;
    const float joint = smooth_step(1.0f, 2.6f, gap);
    const cv::Vec3f grout(105, 112, 118);
    return grout * ((1.f - joint) * (0.7f + 0.6f * cloud)) + tone * (light * joint);
  });
}

cv::Mat paint_carpet(cv::Size size, const cv::Vec3f& tone, std::uint32_t seed) {
  return paint(size, [&](int x, int y) -> cv::Vec3f {
    const float fx = static_cast<float>(x), fy = static_cast<float>(y);
    const float pile = fractal_noise(fx * 0.25f, fy * 0.25f, seed, size.width / 4, 3, 0.8f);
    const float broad = fractal_noise(fx / 64.f, fy / 64.f, seed + 2, size.width / 64, 4);
    const float fleck = value_noise(fx * 0.25f, fy * 0.25f, seed + 4, size.width / 4);
    cv::Vec3f c = tone * (0.55f + 0.75f * pile) * (0.8f + 0.4f * broad);
    if (fleck > 0.9f) c = c * 0.4f + cv::Vec3f(150, 160, 190) * 0.5f;
    if (fleck < 0.07f) c = c * 0.4f;
    return c;
  });
}

cv::Mat paint_rug(cv::Size size, std::uint64_t seed) {
  RandomStream random(seed);
  const double hue = random.uniform();
  cv::Mat image(size, CV_8UC3);
  auto tone = [&](double h, double s, double v) {
    const cv::Vec3f c = hue_colour(std::fmod(h + 1.0, 1.0), s, v);
    return scalar(c);
  };
  image.setTo(tone(hue, 0.65, 0.42));
  const int w = size.width, h = size.height;
  const double inset[] = {0.03, 0.06, 0.13, 0.15};
  for (int i = 0; i < 4; ++i) {
    const int m = static_cast<int>(inset[i] * h);
    cv::rectangle(image, {m, m}, {w - m, h - m}, tone(hue + 0.13 * (i + 1), 0.5, i % 2 ? 0.75 : 0.30), cv::FILLED);
  }
  const int field = static_cast<int>(0.17 * h);
  cv::rectangle(image, {field, field}, {w - field, h - field}, tone(hue + 0.02, 0.62, 0.48), cv::FILLED);
  for (int i = 0; i < 130; ++i) {
    const int y = static_cast<int>(random.uniform(field, h - field));
    const cv::Point at(static_cast<int>(random.uniform(field, w - field)), y);
    const double r = random.uniform(0.012, 0.075) * h;
    const int petals = 3 + random.below(6);
    const double value = random.uniform(0.25, 0.85), saturation = random.uniform(0.2, 0.7);
    const cv::Scalar c = tone(hue + random.uniform(-0.2, 0.5), saturation, value);
    for (int k = 0; k < petals; ++k) {
      const double a = 2 * M_PI * k / petals;
      cv::ellipse(image,
                  at + cv::Point(static_cast<int>(r * 0.6 * std::cos(a)), static_cast<int>(r * 0.6 * std::sin(a))),
                  cv::Size(std::max(1, static_cast<int>(r * 0.5)), std::max(1, static_cast<int>(r * 0.22))),
                  a * 180 / M_PI, 0, 360, c, cv::FILLED, cv::LINE_AA);
    }
    cv::circle(image, at, std::max(1, static_cast<int>(r * 0.25)), tone(hue + 0.5, 0.4, 0.8), cv::FILLED, cv::LINE_AA);
  }
  const auto noise_seed = random.bits32();
  return paint(size, [&](int x, int y) -> cv::Vec3f {
    const float weave =
        fractal_noise(static_cast<float>(x) * 0.45f, static_cast<float>(y) * 0.45f, noise_seed, 4096, 2, 0.8f);
    const float worn =
        fractal_noise(static_cast<float>(x) * 0.012f, static_cast<float>(y) * 0.012f, noise_seed + 1, 4096, 4);
    return cv::Vec3f(image.at<cv::Vec3b>(y, x)) * ((0.6f + 0.7f * weave) * (0.75f + 0.5f * worn));
  });
}

cv::Mat paint_wallpaper(cv::Size size, std::uint64_t seed) {
  RandomStream random(seed);
  const double hue = random.uniform();
  const auto noise_seed = random.bits32();
  const cv::Vec3f base = hue_colour(hue, 0.18, 0.80), stripe = hue_colour(std::fmod(hue + 0.05, 1.0), 0.30, 0.66);
  cv::Mat image = paint(size, [&](int x, int y) -> cv::Vec3f {
    const float phase = std::fmod(static_cast<float>(x), 120.f) / 120.f;
    const float mix = smooth_step(0.42f, 0.46f, phase) * smooth_step(0.96f, 0.92f, phase);
    const float fade =
        fractal_noise(static_cast<float>(x) * 0.004f, static_cast<float>(y) * 0.004f, noise_seed, 4096, 3);
    return (base * (1.f - mix) + stripe * mix) * (0.82f + 0.36f * fade);
  });
  const int ornaments = size.area() / 5200;
  for (int i = 0; i < ornaments; ++i) {
    const cv::Point at = any_place(random, size.width, size.height);
    const double r = random.uniform(4, 17);
    const double value = random.uniform(0.35, 0.75);
    const cv::Vec3f c = hue_colour(std::fmod(hue + random.uniform(0.3, 0.7), 1.0), 0.45, value);
    const int petals = 4 + random.below(4);
    const double turn = random.uniform(0, 6.28);
    for (int k = 0; k < petals; ++k) {
      const double a = turn + 2 * M_PI * k / petals;
      cv::ellipse(image, at + cv::Point(static_cast<int>(r * std::cos(a)), static_cast<int>(r * std::sin(a))),
                  cv::Size(std::max(1, static_cast<int>(r * 0.6)), std::max(1, static_cast<int>(r * 0.28))),
                  a * 180 / M_PI, 0, 360, cv::Scalar(c[0], c[1], c[2]), cv::FILLED, cv::LINE_AA);
    }
  }
  return image;
}

cv::Mat paint_material(cv::Size size, const cv::Vec3f& tone, float unevenness, std::uint32_t seed) {
  return paint(size, [&](int x, int y) -> cv::Vec3f {
    const float fx = static_cast<float>(x), fy = static_cast<float>(y);
    const float broad = fractal_noise(fx / 64.f, fy / 64.f, seed, std::max(1, size.width / 64), 5);
    const float wear = fractal_noise(fx / 32.f, fy / 32.f, seed + 17, std::max(1, size.width / 32), 4);
    float light = 1.f + unevenness * 2.f * (broad - 0.5f);
    if (wear > 0.68f) light += unevenness * (wear - 0.68f) * 3.f;
    return tone * light;
  });
}

cv::Mat paint_fabric(cv::Size size, const cv::Vec3f& tone, const cv::Vec3f& second, std::uint32_t seed) {
  return paint(size, [&](int x, int y) -> cv::Vec3f {
    const float fx = static_cast<float>(x), fy = static_cast<float>(y);
    const bool over = ((x / 2) + (y / 2)) % 2 == 0;
    const float thread = fractal_noise(over ? fx * 0.06f : fx * 0.5f, over ? fy * 0.5f : fy * 0.06f, seed, 4096, 2);
    const float fold = fractal_noise(fx / 48.f, fy / 48.f, seed + 3, std::max(1, size.width / 48), 3);
    const float blend =
        smooth_step(0.35f, 0.65f, fractal_noise(fx / 24.f, fy / 24.f, seed + 5, std::max(1, size.width / 24), 4));
    return (tone * (1.f - blend) + second * blend) * ((0.75f + 0.5f * thread) * (0.8f + 0.4f * fold));
  });
}

}  // namespace semvslam::render
