#include "semvslam/semantic/mask_carry.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <opencv2/imgproc.hpp>

#include "semvslam/base/ranked.h"
#include "semvslam/geometry/depth_image.h"
#include "semvslam/semantic/mask_motion.h"

namespace semvslam {
namespace {

/// What the present depth says about a pixel that the mask was carried to.
enum Verdict : std::uint8_t {
  kOutside,
  kKept,
  kKeptUnmeasured,  // no depth now, nor before
  kUnmeasured,      // no depth now, but before: kept only beside kept ones
  kNearer,
  kFarther
};

struct DepthRange {
  float low_m = 0, high_m = 0;
  bool known = false;
};

/// 5 and 95 percent of the object's depths.
DepthRange depth_range(const HalfMask& object, const cv::Mat& half_depth) {
  if (half_depth.empty() || object.pixels == 0) return {};
  const int step = std::max(1, static_cast<int>(std::sqrt(object.pixels / 2000.0)));
  std::vector<float> depths;
  for (int y = 0; y < object.mask.rows; y += step) {
    const std::uint8_t* m = object.mask.ptr<std::uint8_t>(y);
    const float* d = half_depth.ptr<float>(object.window.y + y) + object.window.x;
    for (int x = 0; x < object.mask.cols; x += step)
      if (m[x] && d[x] > 0) depths.push_back(d[x]);
  }
  if (depths.size() < 20) return {};
  const auto quantile = [&](double share) {
    return ranked(std::span(depths), static_cast<std::size_t>(share * static_cast<double>(depths.size() - 1)));
  };
  return {quantile(0.05), quantile(0.95), true};
}

struct Warped {
  cv::Mat verdicts;  // of the motion's window
  int kept = 0, unmeasured = 0, nearer = 0, farther = 0;
};

/// The rules of the depth check for one object.
struct DepthCheck {
  float tolerance_m, change_m;
  DepthRange range;  // already moved by change_m

  Verdict operator()(float now, float before) const {
    if (!(now > 0)) return before > 0 ? kUnmeasured : kKeptUnmeasured;
    if (before > 0) {
      const float off = now - before - change_m;
      if (std::abs(off) <= tolerance_m) return kKept;
      return off > 0 ? kFarther : kNearer;
    }
    if (!range.known) return kKeptUnmeasured;
    if (now < range.low_m - tolerance_m) return kNearer;
    return now > range.high_m + tolerance_m ? kFarther : kKept;
  }
};

/// Looks up for every pixel of the target window where it comes from, and compares the depths.
Warped warp(const HalfMask& object, const MaskMotion& motion, const cv::Mat& before, const cv::Mat& now,
            const DepthCheck& check) {
  Warped out;
  out.verdicts = cv::Mat::zeros(motion.window.size(), CV_8UC1);
  const bool depth = !before.empty() && !now.empty();
  std::vector<cv::Vec2f> nodes(static_cast<std::size_t>(motion.back.cols));
  for (int y = 0; y < motion.window.height; ++y) {
    const int row = y / MaskMotion::kCell;
    const float down = static_cast<float>(y % MaskMotion::kCell) / MaskMotion::kCell;
    for (int n = 0; n < motion.back.cols; ++n)
      nodes[static_cast<std::size_t>(n)] = motion.back(row, n) * (1 - down) + motion.back(row + 1, n) * down;
    std::uint8_t* verdicts = out.verdicts.ptr<std::uint8_t>(y);
    const float* now_row = depth ? now.ptr<float>(motion.window.y + y) + motion.window.x : nullptr;
    const float source_y = static_cast<float>(motion.window.y + y - object.window.y) + 0.5f;
    const float source_x = static_cast<float>(motion.window.x - object.window.x) + 0.5f;
    for (int x = 0; x < motion.window.width; ++x) {
      const auto node = static_cast<std::size_t>(x / MaskMotion::kCell);
      const float right = static_cast<float>(x % MaskMotion::kCell) / MaskMotion::kCell;
      const cv::Vec2f back = nodes[node] * (1 - right) + nodes[node + 1] * right;
      const int sx = cvFloor(source_x + static_cast<float>(x) + back[0]), sy = cvFloor(source_y + back[1]);
      if (sx < 0 || sy < 0 || sx >= object.mask.cols || sy >= object.mask.rows) continue;
      if (object.mask.at<std::uint8_t>(sy, sx) == 0) continue;
      const Verdict v =
          depth ? check(now_row[x], before.at<float>(object.window.y + sy, object.window.x + sx)) : kKeptUnmeasured;
      verdicts[x] = v;
      out.kept += v == kKept;
      out.unmeasured += v == kKeptUnmeasured || v == kUnmeasured;
      out.nearer += v == kNearer;
      out.farther += v == kFarther;
    }
  }
  return out;
}

/// Takes in pixels beside the kept ones, `steps` wide at most, whose depth goes on from theirs and fits the object.
void grow(cv::Mat& verdicts, const cv::Mat& now, const cv::Point& origin, const DepthCheck& check, int steps) {
  constexpr float kStepM = 0.03f;  // per half pixel
  std::vector<cv::Point> front, next;
  const cv::Rect area({}, verdicts.size());
  constexpr std::array<std::pair<int, int>, 4> kSides{{{1, 0}, {-1, 0}, {0, 1}, {0, -1}}};
  for (int y = 0; y < verdicts.rows; ++y) {
    const std::uint8_t* row = verdicts.ptr<std::uint8_t>(y);
    for (int x = 0; x < verdicts.cols; ++x) {
      if (row[x] != kKept) continue;
      const bool rim = (x > 0 && row[x - 1] != kKept) || (x + 1 < verdicts.cols && row[x + 1] != kKept) ||
                       (y > 0 && verdicts.at<std::uint8_t>(y - 1, x) != kKept) ||
                       (y + 1 < verdicts.rows && verdicts.at<std::uint8_t>(y + 1, x) != kKept);
      if (rim) front.emplace_back(x, y);
    }
  }
  for (int step = 0; step < steps && !front.empty(); ++step) {
    next.clear();
    for (const cv::Point& p : front) {
      const float here = now.at<float>(p + origin);
      for (const auto& [dx, dy] : kSides) {
        const cv::Point q = p + cv::Point(dx, dy);
        if (!area.contains(q)) continue;
        std::uint8_t& verdict = verdicts.at<std::uint8_t>(q);
        if (verdict == kKept) continue;
        const float there = now.at<float>(q + origin);
        if (!(there > 0) || std::abs(there - here) > kStepM * std::max(1.f, here / 2)) continue;
        if (there < check.range.low_m - check.tolerance_m / 2 || there > check.range.high_m + check.tolerance_m / 2)
          continue;
        verdict = kKept;
        next.push_back(q);
      }
    }
    std::swap(front, next);
  }
}

/// 255 where a pixel is kept: with fitting depth, without depth now and before, or without depth near fitting ones.
cv::Mat kept_mask(const cv::Mat& verdicts) {
  constexpr int kNear = 6;  // half px
  cv::Mat fitting, out, unmeasured;
  cv::inRange(verdicts, kKept, kKept, fitting);
  cv::inRange(verdicts, kKept, kKeptUnmeasured, out);
  cv::inRange(verdicts, kUnmeasured, kUnmeasured, unmeasured);
  cv::dilate(fitting, fitting, cv::getStructuringElement(cv::MORPH_RECT, cv::Size(2 * kNear + 1, 2 * kNear + 1)));
  out |= fitting & unmeasured;
  cv::medianBlur(out, out, 3);
  return out;
}

/// The half-size mask in full size, cut to what is set.
void finish(const cv::Mat& half, const cv::Rect& half_window, cv::Size image, CarriedMask& out) {
  cv::Mat full;
  cv::resize(half, full, half.size() * 2, 0, 0, cv::INTER_LINEAR);
  cv::threshold(full, full, 127, 255, cv::THRESH_BINARY);
  const cv::Rect placed(half_window.tl() * 2, full.size());
  const cv::Rect visible = placed & cv::Rect({}, image);
  full = full(visible - placed.tl());
  const cv::Rect set = cv::boundingRect(full);
  if (set.empty()) return;
  out.window = set + visible.tl();
  out.mask = full(set).clone();
}

float share_inside(const HalfMask& object, cv::Point2f shift, cv::Size half_size) {
  if (object.pixels == 0) return 0;
  const cv::Point moved(cvRound(shift.x), cvRound(shift.y));
  const cv::Rect visible = ((object.window + moved) & cv::Rect({}, half_size)) - moved;
  if (visible.empty()) return 0;
  return static_cast<float>(cv::countNonZero(object.mask(visible - object.window.tl()))) /
         static_cast<float>(object.pixels);
}

}  // namespace

struct CarryFrame::Cache {
  cv::Mat half_depth_m;
  FlowPyramid pyramid;
};

CarryFrame::CarryFrame(const Camera& camera, cv::Mat gray, cv::Mat depth)
    : gray_(std::move(gray)),
      depth_(std::move(depth)),
      size_(camera.width_px, camera.height_px),
      metres_per_unit_(static_cast<float>(1 / camera.depth_units_per_m)),
      cache_(std::make_shared<Cache>()) {}

const cv::Mat& CarryFrame::half_depth_m() const {
  cv::Mat& half = cache_->half_depth_m;
  if (!half.empty() || depth_.empty()) return half;
  half = semvslam::half_depth_m(depth_, metres_per_unit_, cv::Rect({}, half_size()));
  return half;
}

const FlowPyramid& CarryFrame::pyramid() const {
  FlowPyramid& pyramid = cache_->pyramid;
  if (!pyramid.empty() || gray_.empty()) return pyramid;
  cv::Mat half;
  cv::resize(gray_, half, half_size(), 0, 0, cv::INTER_AREA);
  pyramid.build(half, kFlowLevels, kFlowWindowPx);
  return pyramid;
}

std::string_view to_string(CarryOutcome outcome) {
  switch (outcome) {
    case CarryOutcome::kVisible:
      return "visible";
    case CarryOutcome::kOccluded:
      return "occluded";
    case CarryOutcome::kLeft:
      return "left";
    case CarryOutcome::kGone:
      break;
  }
  return "gone";
}

void MaskCarryOptions::add_to(ConfigSchema& schema) {
  schema.add("repair.motion", &motion, {"flow", "pose", "none"}, "what moves a mask into the present frame");
  schema.add("repair.points", &points, {8, 10000}, "points per object that the optical flow follows");
  schema.add("repair.depth_tolerance_m", &depth_tolerance_m, {0.01, 10.0},
             "largest change of depth of a carried pixel that belongs to the object, m");
  schema.add("repair.grow_px", &grow_px, {0, 100}, "how far a carried mask grows into fitting depth, px");
  schema.add("repair.least_support", &least_support, {0.0, 1.0},
             "share of the carried pixels that must fit the present depth");
  schema.add("repair.least_inside", &least_inside, {0.0, 1.0},
             "share of the carried pixels that must lie in the image, else the object has left");
}

MaskCarry::MaskCarry(const Camera& camera, const MaskCarryOptions& options) : camera_(camera), options_(options) {}

CarriedMask MaskCarry::carry(const CarryFrame& from, const CarryFrame& to, const cv::Rect& window, const cv::Mat& mask,
                             const std::optional<SE3>& to_from, cv::Point2f guess_px) const {
  CarriedMask out;
  const HalfMask object = half_mask(window, mask);
  if (object.pixels == 0) return out;
  const MaskMotion motion = estimate_motion(camera_, options_, from, to, object, to_from, guess_px / 2);
  out.shift_px = motion.shift * 2;
  out.depth_change_m = motion.depth_change_m;
  out.flow_points = motion.flow_points;
  out.inside = share_inside(object, motion.shift, to.half_size());
  if (motion.window.empty() || out.inside < options_.least_inside) {
    out.outcome = CarryOutcome::kLeft;
    return out;
  }
  const cv::Mat &before = from.half_depth_m(), &now = to.half_depth_m();
  DepthCheck check{static_cast<float>(options_.depth_tolerance_m), motion.depth_change_m, depth_range(object, before)};
  check.range.low_m += motion.depth_change_m;
  check.range.high_m += motion.depth_change_m;
  Warped warped = warp(object, motion, before, now, check);
  const int judged = warped.kept + warped.nearer + warped.farther;
  out.support = judged > 0 ? static_cast<float>(warped.kept) / static_cast<float>(judged) : 1.f;
  out.occluded = judged > 0 ? static_cast<float>(warped.nearer) / static_cast<float>(judged) : 0.f;
  if (warped.kept + warped.unmeasured == 0 || out.support < options_.least_support) {
    out.outcome = warped.nearer > warped.farther ? CarryOutcome::kOccluded : CarryOutcome::kGone;
    return out;
  }
  if (check.range.known && !now.empty()) grow(warped.verdicts, now, motion.window.tl(), check, options_.grow_px / 2);
  finish(kept_mask(warped.verdicts), motion.window, cv::Size(camera_.width_px, camera_.height_px), out);
  out.outcome = out.window.empty() ? CarryOutcome::kGone : CarryOutcome::kVisible;
  return out;
}

}  // namespace semvslam
