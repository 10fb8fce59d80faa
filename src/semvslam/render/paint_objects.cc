#include <algorithm>
#include <cmath>
#include <opencv2/imgproc.hpp>
#include <string>

#include "semvslam/render/noise.h"
#include "semvslam/render/paint.h"

namespace semvslam::render {
namespace {

/// What printed things look like: warm and muted tones more often than pure ones.
cv::Scalar any_colour(RandomStream& random, double saturation, double low, double high) {
  const double kind = random.uniform(), strength = saturation * random.uniform(0.4, 1.0),
               value = random.uniform(low, high);
  if (kind < 0.2) return scalar(hue_colour(0.1, 0.12 * saturation, value));  // grey, paper
  if (kind < 0.55)
    return scalar(hue_colour(std::fmod(1.02 + 0.05 * random.normal(), 1.0), strength, value));      // red to ochre
  if (kind < 0.75) return scalar(hue_colour(0.6 + 0.04 * random.normal(), 0.8 * strength, value));  // blue
  return scalar(hue_colour(random.uniform(), 0.75 * strength, value));
}

/// A word of random letters; syllables, so that word shapes look like writing.
std::string word(RandomStream& random) {
  static const char* const kSyllables[] = {"ka", "lo", "ven", "ta", "ri",  "mo", "sel", "du",  "on", "pra",
                                           "ne", "ti", "gar", "el", "sto", "fi", "ba",  "rum", "ol", "ce"};
  std::string text;
  const int parts = 1 + random.below(3);
  for (int i = 0; i < parts; ++i) text += kSyllables[random.below(20)];
  return text;
}

std::string two_words(RandomStream& random) {
  const std::string second = word(random);
  return word(random) + " " + second;
}

/// Text lines in a rectangle; ragged right.
void write_block(cv::Mat& image, const cv::Rect& area, int line_px, const cv::Scalar& colour, RandomStream& random,
                 bool indented = false) {
  const double scale = line_px / 34.0;
  for (int y = area.y + line_px; y < area.y + area.height; y += line_px) {
    int x = area.x + (indented ? random.below(4) * line_px : 0);
    const int end = area.x + static_cast<int>(area.width * random.uniform(0.45, 1.0));
    while (x < end) {
      const std::string text = word(random);
      int baseline = 0;
      const int width = cv::getTextSize(text, cv::FONT_HERSHEY_SIMPLEX, scale, 1, &baseline).width;
      if (x + width > area.x + area.width) break;
      cv::putText(image, text, {x, y}, cv::FONT_HERSHEY_SIMPLEX, scale, colour, 1, cv::LINE_AA);
      x += width + line_px / 3;
    }
    if (random.chance(0.12)) y += line_px / 2;
  }
}

void add_grain(cv::Mat& image, float strength, std::uint32_t seed) {
  for (int y = 0; y < image.rows; ++y) {
    auto* row = image.ptr<cv::Vec3b>(y);
    for (int x = 0; x < image.cols; ++x) {
      const float fx = static_cast<float>(x), fy = static_cast<float>(y);
      const float n = 1.f + strength * (fractal_noise(fx * 0.02f, fy * 0.02f, seed, 4096, 2) - 0.5f) +
                      strength * 0.4f * (lattice_hash(x, y, seed) - 0.5f);
      for (int c = 0; c < 3; ++c) row[x][c] = cv::saturate_cast<std::uint8_t>(static_cast<float>(row[x][c]) * n);
    }
  }
}

void paint_landscape(cv::Mat& image, RandomStream& random) {
  const int w = image.cols, h = image.rows;
  const cv::Vec3f high = hue_colour(random.uniform(0.5, 0.7), 0.6, 0.8),
                  low = hue_colour(random.uniform(0.0, 0.15), 0.35, 0.95);
  for (int y = 0; y < h; ++y) {
    const float a = static_cast<float>(y) / static_cast<float>(h);
    image.row(y).setTo(scalar(high * (1.f - a) + low * a));
  }
  cv::circle(image, {static_cast<int>(w * random.uniform(0.15, 0.85)), static_cast<int>(h * random.uniform(0.15, 0.4))},
             std::max(2, w / 12), scalar(hue_colour(0.12, 0.3, 1.0)), cv::FILLED, cv::LINE_AA);
  for (int layer = 0; layer < 5; ++layer) {
    const auto seed = random.bits32();
    const double base = 0.38 + 0.13 * layer;
    const cv::Scalar colour = scalar(hue_colour(random.uniform(0.2, 0.6), 0.35 + 0.1 * layer, 0.75 - 0.13 * layer));
    std::vector<cv::Point> ridge{{0, h}};
    for (int x = 0; x <= w; x += std::max(1, w / 64)) {
      const float n = fractal_noise(static_cast<float>(x) * 5.f / static_cast<float>(w), 0.5f, seed, 4096, 5);
      ridge.emplace_back(x, static_cast<int>(h * (base + 0.3 * (0.5 - n))));
    }
    ridge.emplace_back(w, h);
    cv::fillPoly(image, std::vector<std::vector<cv::Point>>{ridge}, colour, cv::LINE_AA);
  }
  for (int i = 0; i < 30; ++i) {  // trees
    const int ground = static_cast<int>(h * random.uniform(0.75, 1.0));
    const cv::Point foot(random.below(w), ground);
    const int t = std::max(3, static_cast<int>(h * random.uniform(0.04, 0.14)));
    const std::vector<cv::Point> tree{{foot.x - t / 3, foot.y}, {foot.x + t / 3, foot.y}, {foot.x, foot.y - t}};
    const double value = random.uniform(0.15, 0.45), hue = random.uniform(0.25, 0.42);
    cv::fillConvexPoly(image, tree, scalar(hue_colour(hue, 0.6, value)), cv::LINE_AA);
  }
}

void paint_shapes(cv::Mat& image, RandomStream& random) {
  const int w = image.cols, h = image.rows;
  image.setTo(any_colour(random, 0.3, 0.6, 0.95));
  for (int i = 0; i < 34; ++i) {
    const cv::Point at = any_place(random, w, h);
    const double largest = w * random.uniform(0.02, 0.22);
    const int r = std::max(2, static_cast<int>(largest * random.uniform()));
    const cv::Scalar c = any_colour(random, 0.9, 0.15, 0.95);
    switch (random.below(4)) {
      case 0:
        cv::circle(image, at, r, c, random.chance(0.3) ? std::max(1, r / 5) : cv::FILLED, cv::LINE_AA);
        break;
      case 1:
        cv::rectangle(image, {at.x - r, at.y - r / 2, 2 * r, r}, c, cv::FILLED);
        break;
      case 2:
        cv::line(image, at, {random.below(w), random.below(h)}, c, 1 + r / 6, cv::LINE_AA);
        break;
      default: {
        const std::vector<cv::Point> p{{at.x - r, at.y + r}, {at.x + r, at.y + r / 2}, {at.x + r / 4, at.y - r}};
        cv::fillConvexPoly(image, p, c, cv::LINE_AA);
      }
    }
  }
}

}  // namespace

cv::Mat paint_poster(cv::Size size, std::uint64_t seed) {
  RandomStream random(seed);
  cv::Mat image(size, CV_8UC3);
  const int w = size.width, h = size.height;
  const int kind = random.below(3);
  if (kind == 0) paint_landscape(image, random);
  if (kind == 1) paint_shapes(image, random);
  if (kind == 2) {
    image.setTo(any_colour(random, 0.6, 0.2, 0.95));
    cv::Mat picture = image({w / 12, h / 5, w * 10 / 12, h / 2});
    if (random.chance(0.5))
      paint_landscape(picture, random);
    else
      paint_shapes(picture, random);
    const cv::Scalar ink = any_colour(random, 0.5, 0.05, 0.3);
    cv::putText(image, two_words(random), {w / 12, h / 7}, cv::FONT_HERSHEY_DUPLEX, w / 260.0, ink,
                std::max(1, w / 120), cv::LINE_AA);
    write_block(image, {w / 12, h * 3 / 4, w * 10 / 12, h / 5}, std::max(7, h / 30), ink, random);
  }
  add_grain(image, 0.2f, random.bits32());
  const int frame = std::max(2, w / 50);
  if (random.chance(0.7)) {
    cv::rectangle(image, {0, 0, w, h}, any_colour(random, 0.4, 0.05, 0.35), frame * 2);
    cv::rectangle(image, {frame, frame, w - 2 * frame, h - 2 * frame}, cv::Scalar(225, 230, 232), frame);
  }
  return image;
}

cv::Mat paint_spines(cv::Size size, int count, std::uint64_t seed) {
  RandomStream random(seed);
  cv::Mat image(size, CV_8UC3);
  const int w = size.width / count, h = size.height;
  for (int i = 0; i < count; ++i) {
    cv::Mat spine(w, h, CV_8UC3, any_colour(random, 0.8, 0.12, 0.85));  // lying; turned upright below
    const cv::Scalar ink = any_colour(random, 0.5, random.chance(0.5) ? 0.75 : 0.05, 1.0);
    const int bands = random.below(4);
    for (int b = 0; b < bands; ++b) {
      const int x = random.below(h);
      const cv::Scalar colour = any_colour(random, 0.8, 0.1, 0.95);
      cv::rectangle(spine, {x, 0, 2 + random.below(h / 8), w}, colour, cv::FILLED);
    }
    const double scale = w / 34.0;
    const double size_of_letters = scale * random.uniform(0.6, 1.0);
    const int font = random.chance(0.5) ? cv::FONT_HERSHEY_DUPLEX : cv::FONT_HERSHEY_TRIPLEX;
    cv::putText(spine, two_words(random), {h / 8, w * 2 / 3}, font, size_of_letters, ink, 1, cv::LINE_AA);
    for (int r = 0; r < w; ++r) {  // rounded back: darker to both sides
      const double side = 2.0 * (r + 0.5) / w - 1.0;
      spine.row(r).convertTo(spine.row(r), CV_8UC3, 1.0 - 0.45 * side * side * side * side);
    }
    cv::Mat upright;
    cv::rotate(spine, upright, cv::ROTATE_90_CLOCKWISE);
    upright.copyTo(image(cv::Rect(i * w, 0, w, h)));
  }
  add_grain(image, 0.25f, random.bits32());
  return image;
}

cv::Mat paint_screen(cv::Size size, std::uint64_t seed) {
  RandomStream random(seed);
  cv::Mat image(size, CV_8UC3);
  const int w = size.width, h = size.height;
  paint_landscape(image, random);
  const int windows = 2 + random.below(3);
  for (int i = 0; i < windows; ++i) {
    const bool dark = random.chance(0.5);
    const int tall = h / 3 + random.below(h / 4), wide = w / 3 + random.below(w / 4),
              top = h / 20 + random.below(h / 3);
    const cv::Rect area(random.below(w / 2), top, wide, tall);
    const cv::Rect in = area & cv::Rect(0, 0, w, h);
    cv::rectangle(image, in, dark ? cv::Scalar(42, 36, 34) : cv::Scalar(238, 240, 240), cv::FILLED);
    cv::rectangle(image, {in.x, in.y, in.width, h / 28}, dark ? cv::Scalar(80, 70, 60) : cv::Scalar(205, 180, 150),
                  cv::FILLED);
    const cv::Rect inner(in.x + 6, in.y + h / 24, in.width - 12, in.height - h / 20);
    if (random.chance(0.3)) {  // a plot
      for (int k = 0; k < 3; ++k) {
        const cv::Scalar c = any_colour(random, 0.9, 0.5, 0.9);
        const auto s = random.bits32();
        cv::Point last;
        for (int x = 0; x < inner.width; x += 4) {
          const float n = fractal_noise(static_cast<float>(x) * 0.03f, 0.f, s, 4096, 4);
          const cv::Point p(inner.x + x, inner.y + static_cast<int>(static_cast<float>(inner.height) * n));
          if (x > 0) cv::line(image, last, p, c, 1, cv::LINE_AA);
          last = p;
        }
      }
    } else {
      const int line = std::max(8, h / 36);
      for (int y = 0; y + line < inner.height; y += line) {  // coloured like code
        write_block(image, {inner.x, inner.y + y, inner.width, line + 1}, line,
                    dark ? any_colour(random, 0.6, 0.6, 1.0) : any_colour(random, 0.7, 0.05, 0.45), random, true);
      }
    }
  }
  cv::rectangle(image, {0, h - h / 22, w, h / 22}, cv::Scalar(50, 44, 40), cv::FILLED);
  for (int i = 0; i < 9; ++i) {
    cv::rectangle(image, {6 + i * h / 16, h - h / 26, h / 30, h / 30}, any_colour(random, 0.8, 0.4, 1.0), cv::FILLED);
  }
  return image;
}

cv::Mat paint_page(cv::Size size, std::uint64_t seed) {
  RandomStream random(seed);
  cv::Mat image(size, CV_8UC3, cv::Scalar(232, 238, 240));
  const int w = size.width, h = size.height, line = std::max(7, h / 40);
  cv::putText(image, two_words(random), {w / 10, h / 9}, cv::FONT_HERSHEY_DUPLEX, w / 420.0, {30, 25, 25}, 1 + w / 300,
              cv::LINE_AA);
  const int columns = 1 + random.below(2);
  for (int c = 0; c < columns; ++c) {
    write_block(image, {w / 10 + c * w * 8 / 10 / columns, h / 7, w * 8 / 10 / columns - w / 30, h * 5 / 7}, line,
                {50, 45, 45}, random);
  }
  cv::Mat figure = image({w / 5 + random.below(w / 8), h / 3 + random.below(h / 5), w * 2 / 5, h / 5});
  paint_shapes(figure, random);
  const cv::Scalar pen = any_colour(random, 1.0, 0.4, 0.8);
  for (int i = 0; i < 3; ++i) {
    const double turn_deg = random.uniform(-20, 20);
    const cv::Size axes{w / 12 + random.below(w / 10), h / 30 + random.below(h / 20)};
    const cv::Point centre{random.below(w), random.below(h)};
    cv::ellipse(image, centre, axes, turn_deg, 0, 330, pen, 2, cv::LINE_AA);
  }
  add_grain(image, 0.1f, random.bits32());
  return image;
}

cv::Mat paint_whiteboard(cv::Size size, std::uint64_t seed) {
  RandomStream random(seed);
  cv::Mat image(size, CV_8UC3, cv::Scalar(228, 230, 228));
  const int w = size.width, h = size.height;
  for (int i = 0; i < 25; ++i) {  // wiped remains
    const int thickness = 6 + random.below(18);
    const cv::Point to{random.below(w), random.below(h)}, from{random.below(w), random.below(h)};
    cv::line(image, from, to, cv::Scalar(214, 216, 216), thickness, cv::LINE_AA);
  }
  const cv::Scalar pens[] = {{120, 40, 20}, {30, 30, 170}, {40, 35, 30}, {50, 110, 30}};
  for (int i = 0; i < 9; ++i) {
    const cv::Scalar pen = pens[random.below(4)];
    const int tall = h / 8 + random.below(h / 8), wide = w / 6 + random.below(w / 8);
    const cv::Rect area(any_place(random, w * 3 / 4, h * 3 / 4), cv::Size(wide, tall));
    const int kind = random.below(3);
    if (kind == 0) write_block(image, area, std::max(10, h / 16), pen, random);
    if (kind == 1) {
      cv::rectangle(image, area, pen, 2, cv::LINE_AA);
      cv::putText(image, word(random), {area.x + 6, area.y + area.height / 2}, cv::FONT_HERSHEY_SCRIPT_SIMPLEX,
                  h / 380.0, pen, 1, cv::LINE_AA);
      cv::arrowedLine(image, {area.x + area.width, area.y + area.height / 2},
                      {area.x + area.width + w / 12, area.y + random.below(h / 5)}, pen, 2, cv::LINE_AA);
    }
    if (kind == 2) {
      cv::arrowedLine(image, {area.x, area.y + area.height}, {area.x + area.width, area.y + area.height}, pen, 2,
                      cv::LINE_AA, 0, 0.05);
      cv::arrowedLine(image, {area.x, area.y + area.height}, area.tl(), pen, 2, cv::LINE_AA, 0, 0.08);
      const double k = random.uniform(1, 4);
      for (int x = 0; x < area.width; x += 3) {
        const double y = 0.5 + 0.4 * std::sin(k * 6.28 * x / area.width) * std::exp(-1.5 * x / area.width);
        cv::circle(image, {area.x + x, area.y + static_cast<int>(y * area.height)}, 1, pen, cv::FILLED, cv::LINE_AA);
      }
    }
  }
  for (int i = 0; i < 5; ++i) {  // notes held by magnets
    const cv::Point at = any_place(random, w - w / 8, h - h / 6);
    cv::rectangle(image, {at.x, at.y, w / 14, w / 14}, any_colour(random, 0.7, 0.75, 1.0), cv::FILLED);
    write_block(image, {at.x + 3, at.y, w / 14 - 6, w / 14}, 9, {60, 60, 60}, random);
    cv::circle(image, {at.x + w / 28, at.y + 3}, 5, any_colour(random, 1, 0.3, 0.9), cv::FILLED, cv::LINE_AA);
  }
  add_grain(image, 0.06f, random.bits32());
  return image;
}

cv::Mat paint_outdoors(cv::Size size, std::uint64_t seed) {
  RandomStream random(seed);
  cv::Mat image(size, CV_8UC3);
  const int w = size.width, h = size.height;
  const auto s = random.bits32();
  for (int y = 0; y < h; ++y) {
    for (int x = 0; x < w; ++x) {
      const float cloud = fractal_noise(static_cast<float>(x) * 0.008f, static_cast<float>(y) * 0.018f, s, 4096, 5);
      const float a = smooth_step(0.45f, 0.7f, cloud), t = static_cast<float>(y) / static_cast<float>(h);
      const cv::Vec3f c = cv::Vec3f(250, 215 + 25 * t, 170 + 60 * t) * (1.f - a) + cv::Vec3f(252, 250, 248) * a;
      image.at<cv::Vec3b>(y, x) =
          cv::Vec3b(cv::saturate_cast<std::uint8_t>(c[0]), cv::saturate_cast<std::uint8_t>(c[1]),
                    cv::saturate_cast<std::uint8_t>(c[2]));
    }
  }
  for (int i = 0; i < 6; ++i) {  // houses
    const int bw = w / 8 + random.below(w / 8), bh = h / 4 + random.below(h / 4), x = random.below(w) - bw / 2,
              y = h - bh;
    cv::rectangle(image, {x, y, bw, bh}, any_colour(random, 0.35, 0.55, 0.85), cv::FILLED);
    const double value = random.uniform(0.35, 0.6);
    const cv::Scalar roof = scalar(hue_colour(random.uniform(0.0, 0.06), 0.6, value));
    cv::fillConvexPoly(image, std::vector<cv::Point>{{x - 4, y}, {x + bw + 4, y}, {x + bw / 2, y - bh / 4}}, roof,
                       cv::LINE_AA);
    for (int r = 0; r < 4; ++r) {
      for (int c = 0; c < 4; ++c) {
        cv::rectangle(image, {x + bw * (2 * c + 1) / 9, y + bh * (2 * r + 1) / 9, bw / 10, bh / 10},
                      cv::Scalar(110 + random.below(60), 90, 70), cv::FILLED);
      }
    }
  }
  for (int i = 0; i < 2600; ++i) {  // foliage: dark leaves first, lit ones over them
    const int r = 2 + random.below(w / 110);
    const double lit = static_cast<double>(i) / 2600;
    const double x = random.uniform() * w, crown = 0.62 + 0.18 * std::sin(x * 0.02) + 0.1 * std::sin(x * 0.053);
    const double value = random.uniform(0.15, 0.35) + 0.35 * lit, saturation = random.uniform(0.35, 0.65),
                 hue = random.uniform(0.2, 0.34);
    cv::circle(image, {static_cast<int>(x), static_cast<int>(h * random.uniform(crown, 1.05))}, r,
               scalar(hue_colour(hue, saturation, value)), cv::FILLED, cv::LINE_AA);
  }
  return image;
}

cv::Mat paint_cardboard(cv::Size size, std::uint64_t seed) {
  RandomStream random(seed);
  cv::Mat image(size, CV_8UC3, cv::Scalar(96, 138, 176));
  const int w = size.width, h = size.height;
  for (int y = 0; y < h; y += 4) cv::line(image, {0, y}, {w, y}, cv::Scalar(90, 132, 170), 1);
  cv::rectangle(image, {w * 9 / 20, 0, w / 10, h}, cv::Scalar(120, 165, 200), cv::FILLED);
  cv::putText(image, word(random), {w / 12, h / 3}, cv::FONT_HERSHEY_DUPLEX, w / 220.0, {40, 50, 70},
              std::max(1, w / 100), cv::LINE_AA);
  write_block(image, {w / 12, h / 2, w / 3, h / 3}, std::max(8, h / 18), {50, 60, 80}, random);
  cv::rectangle(image, {w * 6 / 10, h / 2, w / 4, h / 4}, cv::Scalar(225, 230, 232), cv::FILLED);
  for (int x = 0; x < w / 4 - 6; x += 3) {
    cv::rectangle(image, {w * 6 / 10 + 3 + x, h / 2 + 4, 1 + random.below(2), h / 8}, {30, 30, 30}, cv::FILLED);
  }
  add_grain(image, 0.4f, random.bits32());
  return image;
}

cv::Mat paint_leaf(cv::Size size, std::uint64_t seed) {
  RandomStream random(seed);
  const cv::Vec3f tone = hue_colour(random.uniform(0.26, 0.36), 0.65, 0.5);
  cv::Mat image(size, CV_8UC3, scalar(tone));
  const int w = size.width, h = size.height;
  for (int i = 0; i < 9; ++i) {
    const int y = h - i * h / 9;
    cv::line(image, {w / 2, y}, {0, y - h / 5}, scalar(tone * 1.35f), 1, cv::LINE_AA);
    cv::line(image, {w / 2, y}, {w, y - h / 5}, scalar(tone * 1.35f), 1, cv::LINE_AA);
  }
  cv::line(image, {w / 2, 0}, {w / 2, h}, scalar(tone * 1.6f), std::max(1, w / 24), cv::LINE_AA);
  add_grain(image, 0.6f, random.bits32());
  return image;
}

cv::Mat paint_keyboard(cv::Size size, std::uint64_t seed) {
  RandomStream random(seed);
  const bool dark = random.chance(0.6);
  cv::Mat image(size, CV_8UC3, dark ? cv::Scalar(30, 28, 28) : cv::Scalar(190, 194, 196));
  const int rows = 6, key = size.height / (rows + 1);
  for (int r = 0; r < rows; ++r) {
    int x = key / 2;
    while (x < size.width - key) {
      const int width = random.chance(0.1) ? key * 2 : key;
      const cv::Rect area(x, key / 2 + r * key, std::min(width, size.width - key / 2 - x) - 2, key - 2);
      cv::rectangle(image, area, dark ? cv::Scalar(62, 58, 56) : cv::Scalar(228, 230, 230), cv::FILLED);
      const std::string letter(1, static_cast<char>('A' + random.below(26)));
      cv::putText(image, letter, {area.x + 2, area.y + area.height - 3}, cv::FONT_HERSHEY_PLAIN, key / 22.0,
                  dark ? cv::Scalar(210, 210, 210) : cv::Scalar(60, 60, 60), 1, cv::LINE_AA);
      x += width;
    }
  }
  return image;
}

cv::Mat paint_label(cv::Size size, std::uint64_t seed) {
  RandomStream random(seed);
  cv::Mat image(size, CV_8UC3, any_colour(random, 0.8, 0.4, 0.95));
  const int w = size.width, h = size.height;
  cv::rectangle(image, {0, h / 6, w, h / 12}, any_colour(random, 0.8, 0.1, 0.9), cv::FILLED);
  cv::rectangle(image, {0, h * 3 / 4, w, h / 8}, any_colour(random, 0.8, 0.1, 0.9), cv::FILLED);
  for (int i = 0; i < 2; ++i) {
    const int x = i * w / 2;
    cv::circle(image, {x + w / 4, h / 2}, h / 5, any_colour(random, 0.9, 0.3, 1.0), cv::FILLED, cv::LINE_AA);
    const cv::Scalar ink = any_colour(random, 0.4, 0.0, 0.3);
    cv::putText(image, word(random), {x + w / 14, h * 9 / 16}, cv::FONT_HERSHEY_DUPLEX, w / 330.0, ink, 2, cv::LINE_AA);
  }
  add_grain(image, 0.15f, random.bits32());
  return image;
}

}  // namespace semvslam::render
