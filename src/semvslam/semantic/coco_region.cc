#include "semvslam/semantic/coco_region.h"

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <nlohmann/json.hpp>
#include <optional>
#include <utility>

#include "semvslam/semantic/json_integer.h"

namespace semvslam {
namespace {

constexpr double kFarthest = 1e5;  // px; no corner of a polygon lies farther out

struct Point {
  int x, y;
};

/// Visits the pixels of a polygon's outline on a grid so many times as fine, in order. They are not stored: corners far
/// outside make very many.
template <typename Visit>
void walk_outline(const std::vector<double>& polygon, double scale, const Visit& visit) {
  const std::size_t n = polygon.size() / 2;
  std::vector<Point> corners;
  for (std::size_t i = 0; i < n; ++i)
    corners.push_back(
        {static_cast<int>(scale * polygon[2 * i] + .5), static_cast<int>(scale * polygon[2 * i + 1] + .5)});
  corners.push_back(corners[0]);
  for (std::size_t i = 0; i < n; ++i) {
    Point a = corners[i], b = corners[i + 1];
    const int dx = std::abs(b.x - a.x), dy = std::abs(b.y - a.y);
    const bool flip = (dx >= dy && a.x > b.x) || (dx < dy && a.y > b.y);
    if (flip) std::swap(a, b);
    const int steps = std::max(dx, dy);
    const double slope = steps == 0 ? 0
                         : dx >= dy ? static_cast<double>(b.y - a.y) / dx
                                    : static_cast<double>(b.x - a.x) / dy;
    for (int d = 0; d <= steps; ++d) {
      const int t = flip ? steps - d : d;
      visit(dx >= dy ? Point{t + a.x, static_cast<int>(a.y + slope * t + .5)}
                     : Point{static_cast<int>(a.x + slope * t + .5), t + a.y});
    }
  }
}

/// Fills a polygon as the COCO tools do (their rleFrPoly): where the outline crosses a column of pixel centres, the
/// state below flips. Written after their description; the same pixels matter because scores are compared.
void fill(const std::vector<double>& polygon, cv::Mat& mask) {
  constexpr double kScale = 5;
  std::vector<std::size_t> flips;
  const auto height = static_cast<std::size_t>(mask.rows);
  std::optional<Point> last;
  walk_outline(polygon, kScale, [&](const Point& p) {
    const Point q = std::exchange(last, p).value_or(p);
    if (p.x == q.x) return;
    const double x = ((p.x < q.x ? p.x : p.x - 1) + .5) / kScale - .5;
    if (std::floor(x) != x || x < 0 || x > mask.cols - 1) return;
    const double y = std::clamp((std::min(p.y, q.y) + .5) / kScale - .5, 0., static_cast<double>(mask.rows));
    flips.push_back(static_cast<std::size_t>(x) * height + static_cast<std::size_t>(std::ceil(y)));
  });
  std::sort(flips.begin(), flips.end());
  for (std::size_t i = 0; i + 1 < flips.size(); i += 2)
    for (std::size_t at = flips[i]; at < flips[i + 1]; ++at)
      mask.at<std::uint8_t>(static_cast<int>(at % height), static_cast<int>(at / height)) = 255;
}

/// COCO's compressed run lengths: six bits a character, each run from the third on as a difference to the one before
/// last.
std::vector<std::uint32_t> unpack_runs(const std::string& text) {
  std::vector<std::uint32_t> out;
  for (std::size_t p = 0; p < text.size();) {
    std::int64_t x = 0;
    int k = 0;
    bool more = true;
    while (more && p < text.size() && k < 7) {
      const std::int64_t c = text[p] - 48;
      x |= (c & 0x1f) << (5 * k);
      more = (c & 0x20) != 0;
      ++p;
      ++k;
      if (!more && (c & 0x10) != 0) x |= -(std::int64_t{1} << (5 * k));
    }
    if (out.size() > 2) x += out[out.size() - 2];
    out.push_back(static_cast<std::uint32_t>(x));
  }
  return out;
}

std::vector<double> parse_polygon(const nlohmann::json& json) {
  auto polygon = json.get<std::vector<double>>();
  for (const double v : polygon)
    if (!(std::abs(v) <= kFarthest)) throw std::invalid_argument("a corner of a polygon lies far outside");
  return polygon;
}

/// One run in COCO's text form: five bits a character, the lowest first, the sixth says that more follow.
void append_packed(std::int64_t x, std::string& text) {
  for (bool more = true; more;) {
    std::int64_t c = x & 0x1f;
    x >>= 5;
    more = (c & 0x10) != 0 ? x != -1 : x != 0;
    if (more) c |= 0x20;
    text.push_back(static_cast<char>(c + 48));
  }
}

}  // namespace

CocoRegion CocoRegion::parse(const nlohmann::json& json) {
  CocoRegion out;
  if (json.is_array()) {
    for (const nlohmann::json& p : json)
      if (auto polygon = parse_polygon(p); polygon.size() >= 6) out.polygons.push_back(std::move(polygon));
  } else {
    const nlohmann::json& counts = json.at("counts");
    out.runs = counts.is_string() ? unpack_runs(counts.get<std::string>()) : integers_at<std::uint32_t>(json, "counts");
  }
  return out;
}

cv::Mat CocoRegion::mask(cv::Size size) const {
  cv::Mat out = cv::Mat::zeros(size, CV_8UC1);
  for (const std::vector<double>& p : polygons) fill(p, out);
  std::size_t at = 0;
  const std::size_t height = static_cast<std::size_t>(size.height), end = height * static_cast<std::size_t>(size.width);
  for (std::size_t i = 0; i < runs.size(); ++i) {
    const std::size_t until = std::min<std::size_t>(end, at + runs[i]);
    if (i % 2 == 1)
      for (std::size_t k = at; k < until; ++k)
        out.at<std::uint8_t>(static_cast<int>(k % height), static_cast<int>(k / height)) = 255;
    at = until;
  }
  return out;
}

std::string pack_region(const cv::Mat& mask, const cv::Rect& window, cv::Size size) {
  std::vector<std::int64_t> runs;
  std::int64_t run = 0;
  bool inside = false;
  const auto add = [&](bool object, std::int64_t pixels) {
    if (object != inside) {
      runs.push_back(run);
      run = 0;
      inside = object;
    }
    run += pixels;
  };
  const std::int64_t height = size.height;
  add(false, window.x * height);
  for (int x = 0; x < window.width; ++x) {
    add(false, window.y);
    for (int y = 0; y < window.height; ++y) add(mask.at<std::uint8_t>(y, x) != 0, 1);
    add(false, height - window.br().y);
  }
  add(false, (size.width - window.br().x) * height);
  runs.push_back(run);
  std::string text;
  for (std::size_t i = 0; i < runs.size(); ++i) append_packed(i > 2 ? runs[i] - runs[i - 2] : runs[i], text);
  return text;
}

}  // namespace semvslam
