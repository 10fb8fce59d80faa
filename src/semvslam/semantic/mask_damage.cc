#include "semvslam/semantic/mask_damage.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <opencv2/imgproc.hpp>
#include <vector>

#include "semvslam/base/random.h"

namespace semvslam {
namespace {

/// Takes a share of the pixels away: those nearest to the mask's outermost one in a random direction, as where a head,
/// an arm or a leg is missed.
Instance without_limb(const Instance& whole, double share, double angle_rad) {
  std::vector<cv::Point> pixels;
  cv::findNonZero(whole.mask, pixels);
  const auto lost = static_cast<std::size_t>(share * static_cast<double>(pixels.size()));
  if (lost == 0 || lost >= pixels.size()) return whole;
  const double cos = std::cos(angle_rad), sin = std::sin(angle_rad);
  const auto along = [&](const cv::Point& p) { return cos * p.x + sin * p.y; };
  const cv::Point tip = *std::max_element(pixels.begin(), pixels.end(),
                                          [&](const cv::Point& a, const cv::Point& b) { return along(a) < along(b); });
  const auto middle = pixels.begin() + static_cast<std::ptrdiff_t>(lost);
  std::nth_element(pixels.begin(), middle, pixels.end(), [&](const cv::Point& a, const cv::Point& b) {
    return (a - tip).ddot(a - tip) < (b - tip).ddot(b - tip);
  });
  Instance out = whole;
  out.mask = whole.mask.clone();
  for (auto p = pixels.begin(); p != middle; ++p) out.mask.at<std::uint8_t>(*p) = 0;
  const cv::Rect left = cv::boundingRect(out.mask);
  out.mask = out.mask(left);
  out.window = left + whole.window.tl();
  out.box = cv::Rect2f(out.window);
  return out;
}

}  // namespace

void MaskDamageOptions::add_to(ConfigSchema& schema) {
  schema.add("semantic.damage_kind", &kind, {"none", "frames", "instances", "limbs"},
             "for experiments: what of the persons' segmentation gets lost");
  schema.add("semantic.damage_share", &share, {0.0, 1.0}, "share of the frames or instances that get damaged");
  schema.add("semantic.damage_run", &run, {1, 1000}, "so many frames in a row share their fate");
  schema.add("semantic.damage_seed", &seed, {0, 2147483647}, "of the damage");
  schema.add("semantic.damage_smallest_cut", &smallest_cut, {0.0, 0.9},
             "smallest share of its pixels that a limb takes");
  schema.add("semantic.damage_largest_cut", &largest_cut, {0.0, 0.9}, "largest share of its pixels that a limb takes");
}

MaskDamage::MaskDamage(const MaskDamageOptions& options) : options_(options) {}

std::optional<Segmentation> MaskDamage::apply(const Segmentation& whole) const {
  if (options_.kind == "none" || options_.share <= 0) return whole;
  const std::uint64_t block = whole.frame.value / static_cast<std::uint32_t>(std::max(1, options_.run));
  Random fate(static_cast<std::uint64_t>(options_.seed) * 0x9E3779B97F4A7C15ull + block, "semantic.damage");
  if (options_.kind == "frames") {
    if (fate.chance(options_.share)) return std::nullopt;
    return whole;
  }
  Random cut(static_cast<std::uint64_t>(options_.seed) * 0x9E3779B97F4A7C15ull + whole.frame.value, "semantic.cut");
  Segmentation out{whole.frame, whole.stamp, whole.size, {}};
  for (const Instance& i : whole.instances) {
    const bool hit = i.class_name == "person" && fate.chance(options_.share);
    if (hit && options_.kind == "instances") continue;
    if (hit) {
      const double share = cut.uniform(options_.smallest_cut, std::max(options_.smallest_cut, options_.largest_cut));
      const double angle = cut.uniform(0, 2 * std::numbers::pi);
      out.instances.push_back(without_limb(i, share, angle));
    } else {
      out.instances.push_back(i);
    }
    out.instances.back().id = InstanceId(static_cast<std::uint32_t>(out.instances.size() - 1));
  }
  return out;
}

}  // namespace semvslam
