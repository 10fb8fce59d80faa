#include "semvslam/semantic/mask_motion.h"

#include <Eigen/Core>
#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <vector>

#include "semvslam/base/ranked.h"
#include "semvslam/feature/lucas_kanade.h"

namespace semvslam {
namespace {

constexpr int kLeastPoints = 6;
constexpr float kReach = 14.f;  // half px over which a point tells of its neighbourhood

struct Pair {
  cv::Point2f from, to;
  float depth_change_m = 0;
  bool has_depth = false;
};

float median_of(std::vector<float> values) { return values.empty() ? 0 : median(std::span(values)); }

/// Of the grey gradient by Scharr's filter, |x| + |y|.
int gradient_strength(const cv::Mat& image, int x, int y) {
  const auto stride = static_cast<std::ptrdiff_t>(image.step[0]);
  const std::uint8_t *row = image.data + y * stride + x, *above = row - stride, *below = row + stride;
  const int gx = 3 * (above[1] + below[1] - above[-1] - below[-1]) + 10 * (row[1] - row[-1]);
  const int gy = 3 * (below[-1] + below[1] - above[-1] - above[1]) + 10 * (below[0] - above[0]);
  return std::abs(gx) + std::abs(gy);
}

/// Points spread evenly over the mask, in each cell of a grid the one with the strongest gradient, none at the rim:
/// there LK holds on to what is behind.
/// @param image with a readable margin (FlowPyramid); null = any point is as good.
std::vector<cv::Point2f> choose_points(const HalfMask& object, const cv::Mat* image, int wanted) {
  const int step = std::max(4, static_cast<int>(std::sqrt(static_cast<double>(object.pixels) / wanted)));
  const int rim = std::min(3, step / 3);
  std::vector<cv::Point2f> out;
  const auto inside = [&](int x, int y) {
    return x >= 0 && y >= 0 && x < object.mask.cols && y < object.mask.rows && object.mask.at<std::uint8_t>(y, x) != 0;
  };
  for (int top = 0; top < object.mask.rows; top += step)
    for (int left = 0; left < object.mask.cols; left += step) {
      int best = -1;
      cv::Point at;
      for (int y = top; y < std::min(top + step, object.mask.rows); y += 2)
        for (int x = left; x < std::min(left + step, object.mask.cols); x += 2) {
          if (!inside(x, y) || !inside(x - rim, y) || !inside(x + rim, y) || !inside(x, y - rim) || !inside(x, y + rim))
            continue;
          const int strength = image ? gradient_strength(*image, object.window.x + x, object.window.y + y) : 0;
          if (strength <= best) continue;
          best = strength;
          at = {x, y};
        }
      if (best >= 0) out.emplace_back(at + object.window.tl());
    }
  return out;
}

float depth_at(const cv::Mat& half_depth, cv::Point2f p) {
  if (half_depth.empty()) return 0;
  const int x = cvRound(p.x), y = cvRound(p.y);
  if (x < 0 || y < 0 || x >= half_depth.cols || y >= half_depth.rows) return 0;
  return half_depth.at<float>(y, x);
}

/// Where the camera's motion alone takes the points; the depth of points without one is `usual_m`.
std::vector<Pair> pairs_by_pose(const Camera& camera, const cv::Mat& half_depth, const std::vector<cv::Point2f>& points,
                                const SE3& to_from) {
  std::vector<float> depths;
  for (const cv::Point2f& p : points)
    if (const float d = depth_at(half_depth, p); d > 0) depths.push_back(d);
  const float usual_m = median_of(depths);
  std::vector<Pair> out;
  for (const cv::Point2f& p : points) {
    float d = depth_at(half_depth, p);
    const bool measured = d > 0;
    if (!measured) d = usual_m;
    if (!(d > 0)) continue;
    const Eigen::Vector3d x = to_from * camera.back_project(camera.undistort({2.0 * p.x + 0.5, 2.0 * p.y + 0.5}), d);
    if (x.z() < 0.05) continue;
    const Eigen::Vector2d q = camera.distort(camera.project(x));
    const cv::Point2f to(static_cast<float>((q.x() - 0.5) / 2), static_cast<float>((q.y() - 0.5) / 2));
    out.push_back({p, to, static_cast<float>(x.z()) - d, measured});
  }
  return out;
}

cv::Point2f median_shift(const std::vector<Pair>& pairs) {
  std::vector<float> x, y;
  for (const Pair& p : pairs) {
    x.push_back(p.to.x - p.from.x);
    y.push_back(p.to.y - p.from.y);
  }
  return {median_of(x), median_of(y)};
}

std::vector<Pair> pairs_by_flow(const CarryFrame& from, const CarryFrame& to, const std::vector<cv::Point2f>& points,
                                cv::Point2f start) {
  LucasKanadeOptions options;
  options.window_px = CarryFrame::kFlowWindowPx;
  options.levels = CarryFrame::kFlowLevels;
  options.epsilon_px = 0.05;
  const cv::Size size = to.pyramid().level(0).size();
  std::vector<Pair> found;
  std::vector<float> errors;
  for (const cv::Point2f& p : points) {
    cv::Point2f q = p + start;
    if (!follow_point(from.pyramid(), to.pyramid(), p, options, q)) continue;
    if (q.x < 0 || q.y < 0 || q.x > static_cast<float>(size.width) - 1 || q.y > static_cast<float>(size.height) - 1)
      continue;
    found.push_back({p, q});
    errors.push_back(patch_difference(from.pyramid(), p, to.pyramid(), q, options.window_px, false));
  }
  const float limit = std::max(8.f, 3.f * median_of(errors));  // grey levels
  std::vector<Pair> out;
  for (std::size_t i = 0; i < found.size(); ++i) {
    if (errors[i] > limit) continue;
    Pair pair = found[i];
    const float before = depth_at(from.half_depth_m(), pair.from), now = depth_at(to.half_depth_m(), pair.to);
    pair.has_depth = before > 0 && now > 0;
    if (pair.has_depth) pair.depth_change_m = now - before;
    out.push_back(pair);
  }
  return out;
}

/// Source position as an affine function of the target position, held close to a mere shift where the points say
/// little.
struct Affine {
  Eigen::Vector2d centre = Eigen::Vector2d::Zero();
  Eigen::Matrix<double, 3, 2> back = Eigen::Matrix<double, 3, 2>::Zero();  // (1, dx, dy) -> source minus target

  cv::Point2f operator()(cv::Point2f target) const {
    const Eigen::Vector2d b = back.transpose() * Eigen::Vector3d(1, target.x - centre.x(), target.y - centre.y());
    return {static_cast<float>(b.x()), static_cast<float>(b.y())};
  }
};

Affine fit_affine(const std::vector<Pair>& pairs) {
  Affine out;
  for (const Pair& p : pairs) out.centre += Eigen::Vector2d(p.to.x, p.to.y) / static_cast<double>(pairs.size());
  Eigen::Matrix3d n = Eigen::Matrix3d::Zero();
  Eigen::Matrix<double, 3, 2> r = Eigen::Matrix<double, 3, 2>::Zero();
  for (const Pair& p : pairs) {
    const Eigen::Vector3d row(1, p.to.x - out.centre.x(), p.to.y - out.centre.y());
    n += row * row.transpose();
    r += row * Eigen::RowVector2d(p.from.x - p.to.x, p.from.y - p.to.y);
  }
  constexpr double kHoldPx = 400;  // as if four points 10 px away saw no change of shape
  n(1, 1) += kHoldPx;
  n(2, 2) += kHoldPx;
  out.back = n.inverse() * r;
  return out;
}

float distance(cv::Point2f a, cv::Point2f b) { return std::sqrt((a - b).dot(a - b)); }

/// Drops what moves unlike the rest and unlike its neighbours, and what lands on another depth.
std::vector<Pair> consistent(std::vector<Pair> pairs, Affine& affine) {
  // Farther than a person comes in a few frames: LK held on to what is behind or in front of her.
  constexpr float kFarthestM = 0.3f, kSpreadM = 0.15f;
  std::erase_if(pairs, [&](const Pair& p) { return p.has_depth && std::abs(p.depth_change_m) > kFarthestM; });
  std::vector<float> changes;
  for (const Pair& p : pairs)
    if (p.has_depth) changes.push_back(p.depth_change_m);
  const float change = median_of(changes);
  std::erase_if(pairs, [&](const Pair& p) { return p.has_depth && std::abs(p.depth_change_m - change) > kSpreadM; });
  for (int round = 0; round < 2 && pairs.size() >= kLeastPoints; ++round) {
    affine = fit_affine(pairs);
    std::vector<cv::Point2f> rest;
    std::vector<float> sizes;
    for (const Pair& p : pairs) {
      rest.push_back(p.from - p.to - affine(p.to));
      sizes.push_back(std::sqrt(rest.back().dot(rest.back())));
    }
    const float limit = std::max(1.5f, 3.f * median_of(sizes));
    std::vector<Pair> kept;
    for (std::size_t i = 0; i < pairs.size(); ++i) {
      bool keep = sizes[i] <= limit;
      for (std::size_t j = 0; !keep && j < pairs.size(); ++j)  // a limb: another point near it does the same
        keep = j != i && distance(pairs[i].to, pairs[j].to) < kReach &&
               distance(rest[i], rest[j]) < 0.3f * sizes[i] + 0.5f;
      if (keep) kept.push_back(pairs[i]);
    }
    if (kept.size() == pairs.size()) break;
    pairs = std::move(kept);
  }
  return pairs;
}

void fill_field(const std::vector<Pair>& pairs, const Affine& affine, MaskMotion& motion) {
  const int columns = motion.window.width / MaskMotion::kCell + 2, rows = motion.window.height / MaskMotion::kCell + 2;
  motion.back.create(rows, columns);
  std::vector<cv::Point2f> rest;
  for (const Pair& p : pairs) rest.push_back(p.from - p.to - affine(p.to));
  for (int y = 0; y < rows; ++y)
    for (int x = 0; x < columns; ++x) {
      const cv::Point2f node = cv::Point2f(motion.window.tl() + cv::Point(x, y) * MaskMotion::kCell);
      cv::Point2f sum(0, 0);
      float weights = 0.5f;  // of the affine motion
      for (std::size_t i = 0; i < pairs.size(); ++i) {
        const cv::Point2f d = node - pairs[i].to;
        const float square = d.dot(d) / (kReach * kReach);
        if (square > 9) continue;
        const float w = std::exp(-0.5f * square);
        sum += w * rest[i];
        weights += w;
      }
      const cv::Point2f value = affine(node) + sum / weights;
      motion.back(y, x) = {value.x, value.y};
    }
}

}  // namespace

HalfMask half_mask(const cv::Rect& window, const cv::Mat& mask) {
  HalfMask out;
  const int left = (window.x + 1) / 2, top = (window.y + 1) / 2;
  const int right = (window.x + window.width + 1) / 2, bottom = (window.y + window.height + 1) / 2;
  out.window = {left, top, std::max(0, right - left), std::max(0, bottom - top)};
  out.mask.create(out.window.size(), CV_8UC1);
  for (int y = 0; y < out.mask.rows; ++y) {
    const std::uint8_t* from = mask.ptr<std::uint8_t>(2 * (top + y) - window.y) + 2 * left - window.x;
    std::uint8_t* to = out.mask.ptr<std::uint8_t>(y);
    for (int x = 0; x < out.mask.cols; ++x) {
      to[x] = from[2 * x];
      out.pixels += to[x] != 0;
    }
  }
  return out;
}

MaskMotion estimate_motion(const Camera& camera, const MaskCarryOptions& options, const CarryFrame& from,
                           const CarryFrame& to, const HalfMask& object, const std::optional<SE3>& to_from,
                           cv::Point2f guess) {
  const bool flow = options.motion == "flow" && !from.gray().empty() && !to.gray().empty();
  MaskMotion out;
  out.shift = options.motion == "none" ? cv::Point2f() : guess;
  std::vector<Pair> pairs;
  Affine affine;
  if (options.motion != "none") {
    const std::vector<cv::Point2f> points =
        choose_points(object, flow ? &from.pyramid().level(0) : nullptr, options.points);
    if (to_from) {
      pairs = pairs_by_pose(camera, from.half_depth_m(), points, *to_from);
      if (guess == cv::Point2f() && !pairs.empty()) out.shift = median_shift(pairs);
    }
    if (flow && points.size() >= kLeastPoints) {
      std::vector<Pair> followed = consistent(pairs_by_flow(from, to, points, out.shift), affine);
      if (followed.size() >= std::max<std::size_t>(kLeastPoints, points.size() / 5)) {
        pairs = std::move(followed);
        out.flow_points = static_cast<int>(pairs.size());
      }
    }
  }
  float spread = 0;
  if (pairs.size() >= kLeastPoints) {
    out.shift = median_shift(pairs);
    std::vector<float> changes;
    for (const Pair& p : pairs) {
      spread = std::max(spread, distance(p.to - p.from, out.shift));
      if (p.has_depth) changes.push_back(p.depth_change_m);
    }
    out.depth_change_m = median_of(changes);
    affine = fit_affine(pairs);
  } else {
    pairs.clear();
    affine.back.row(0) << -out.shift.x, -out.shift.y;
  }
  const cv::Size size = from.half_size();
  const int room = static_cast<int>(std::min(spread, 40.f)) + options.grow_px / 2 + 2;
  const cv::Point tl =
      object.window.tl() + cv::Point(cvFloor(out.shift.x), cvFloor(out.shift.y)) - cv::Point(room, room);
  out.window = cv::Rect(tl, object.window.size() + cv::Size(2 * room + 1, 2 * room + 1)) & cv::Rect({}, size);
  if (!out.window.empty()) fill_field(pairs, affine, out);
  return out;
}

}  // namespace semvslam
