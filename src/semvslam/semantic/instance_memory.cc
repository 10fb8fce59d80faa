#include "semvslam/semantic/instance_memory.h"

#include <algorithm>
#include <cmath>
#include <opencv2/imgproc.hpp>
#include <span>

#include "semvslam/base/ranked.h"

namespace semvslam {
namespace {

constexpr int kGrid = 4;         // px: overlaps are counted on every 4th pixel of every 4th row
constexpr double kMerged = 0.5;  // share of a carried mask that others cover when it is no object of its own
constexpr double kHeld = 0.8;    // share of another's mask that a carried one holds when both are the same object
constexpr double kLeastMeasured = 0.5;    // share of a lost part that must have depth: without, nothing speaks for it
constexpr double kLeastAgreement = 0.85;  // share of the segmented rest that the carried mask must cover
constexpr double kHalfHidden = 0.5;       // share of the lost pixels behind something nearer that explains a loss
constexpr double kLeastPiece = 0.7;   // share of the smaller of two masks that the other covers if it is a piece of it
constexpr float kDepthReachM = 0.4f;  // change of an object's median depth from frame to frame
constexpr int kGapPx = 5;             // two outlines of one object differ by up to this

/// Pixels on the grid of masks, one of them moved, and in both.
struct Overlap {
  int first = 0, second = 0, both = 0;
  double iou() const {
    const int either = first + second - both;
    return either > 0 ? static_cast<double>(both) / either : 0;
  }
};

int count_on_grid(const cv::Rect& window, const cv::Mat& mask) {
  int n = 0;
  for (int y = (window.y + kGrid - 1) / kGrid * kGrid; y < window.y + window.height; y += kGrid)
    for (int x = (window.x + kGrid - 1) / kGrid * kGrid; x < window.x + window.width; x += kGrid)
      n += mask.at<std::uint8_t>(y - window.y, x - window.x) != 0;
  return n;
}

Overlap overlap(const cv::Rect& window_a, const cv::Mat& a, cv::Point shift_a, const cv::Rect& window_b,
                const cv::Mat& b) {
  // The shift is made a multiple of the grid so that both are counted on the same pixels.
  const cv::Point shift(shift_a.x / kGrid * kGrid, shift_a.y / kGrid * kGrid);
  Overlap out;
  const cv::Rect moved = window_a + shift, common = moved & window_b;
  if (common.empty()) return out;
  out.first = count_on_grid(window_a, a);
  out.second = count_on_grid(window_b, b);
  for (int y = (common.y + kGrid - 1) / kGrid * kGrid; y < common.y + common.height; y += kGrid)
    for (int x = (common.x + kGrid - 1) / kGrid * kGrid; x < common.x + common.width; x += kGrid)
      out.both +=
          a.at<std::uint8_t>(y - moved.y, x - moved.x) != 0 && b.at<std::uint8_t>(y - window_b.y, x - window_b.x) != 0;
  return out;
}

/// Of mass, of the pixels set. (cv::moments takes several times as long.)
cv::Point2f centre(const Instance& instance) {
  const cv::Mat& mask = instance.mask;
  std::vector<std::uint16_t> in_column(static_cast<std::size_t>(mask.cols), 0);
  double pixels = 0, sum_x = 0, sum_y = 0;
  for (int y = 0; y < mask.rows; ++y) {
    const std::uint8_t* row = mask.ptr<std::uint8_t>(y);
    int in_row = 0;
    for (int x = 0; x < mask.cols; ++x) {
      const int set = row[x] != 0;
      in_column[static_cast<std::size_t>(x)] = static_cast<std::uint16_t>(in_column[static_cast<std::size_t>(x)] + set);
      in_row += set;
    }
    pixels += in_row;
    sum_y += static_cast<double>(in_row) * y;
  }
  for (int x = 0; x < mask.cols; ++x) sum_x += static_cast<double>(in_column[static_cast<std::size_t>(x)]) * x;
  if (pixels <= 0) return cv::Point2f(instance.window.tl());
  return cv::Point2f(static_cast<float>(sum_x / pixels), static_cast<float>(sum_y / pixels)) +
         cv::Point2f(instance.window.tl());
}

bool at_border(const cv::Rect& window, cv::Size image) {
  return window.x <= 1 || window.y <= 1 || window.x + window.width >= image.width - 1 ||
         window.y + window.height >= image.height - 1;
}

void place(const cv::Rect& window, const cv::Mat& mask, Instance& out) {
  out.window = window;
  out.mask = mask;
  out.box = cv::Rect2f(window);
}

/// Takes from a mask what lies in another or next to it.
void subtract(const cv::Rect& window, cv::Mat& mask, const Instance& other, int margin_px) {
  const cv::Rect room(-margin_px, -margin_px, 2 * margin_px, 2 * margin_px);
  const cv::Rect common = window & cv::Rect(other.window.tl() + room.tl(), other.window.size() + room.size());
  if (common.empty()) return;
  cv::Mat covered = cv::Mat::zeros(window.size(), CV_8UC1);
  if (const cv::Rect both = window & other.window; !both.empty())
    other.mask(both - other.window.tl()).copyTo(covered(both - window.tl()));
  if (margin_px > 0)
    cv::dilate(covered, covered,
               cv::getStructuringElement(cv::MORPH_RECT, cv::Size(2 * margin_px + 1, 2 * margin_px + 1)));
  mask.setTo(0, covered);
}

/// Takes from a mask what lies in any of the instances that may move, or next to it. @return pixels left
int subtract_movers(const cv::Rect& window, cv::Mat& mask, std::span<const Instance> instances, int margin_px) {
  for (const Instance& other : instances)
    if (other.role == Role::kDynamic) subtract(window, mask, other, margin_px);
  return cv::countNonZero(mask);
}

/// Over every `step`-th pixel of the mask (even); 0 without any.
float median_depth_m(const cv::Rect& window, const cv::Mat& mask, const cv::Mat& half_depth, int step,
                     double* measured_share = nullptr) {
  if (half_depth.empty()) return 0;
  std::vector<float> depths;
  int n = 0;
  for (int y = (window.y + step - 1) / step * step; y < window.y + window.height; y += step)
    for (int x = (window.x + step - 1) / step * step; x < window.x + window.width; x += step) {
      if (mask.at<std::uint8_t>(y - window.y, x - window.x) == 0) continue;
      ++n;
      if (const float d = half_depth.at<float>(y / 2, x / 2); d > 0) depths.push_back(d);
    }
  if (measured_share) *measured_share = n > 0 ? static_cast<double>(depths.size()) / n : 0;
  return depths.empty() ? 0 : median(std::span(depths));
}

/// A lost part is measured, touches what is left of the object, and goes on at the depth it has there.
bool belongs(const cv::Rect& window, const cv::Mat& part, const Instance& rest, const cv::Mat& half_depth) {
  cv::Mat around, touching = cv::Mat::zeros(window.size(), CV_8UC1);
  constexpr int kReach = 2 * kGapPx + 2;
  cv::dilate(part, around, cv::getStructuringElement(cv::MORPH_RECT, cv::Size(2 * kReach + 1, 2 * kReach + 1)));
  if (const cv::Rect both = window & rest.window; !both.empty())
    rest.mask(both - rest.window.tl()).copyTo(touching(both - window.tl()));
  cv::bitwise_and(touching, around, touching);
  if (cv::countNonZero(touching) < 4 * kGapPx) return false;
  if (half_depth.empty()) return true;
  // The rim of the part on the side of the rest, not its middle: an arm may reach far forward.
  cv::Mat rim;
  cv::dilate(touching, rim, cv::getStructuringElement(cv::MORPH_RECT, cv::Size(2 * kReach + 1, 2 * kReach + 1)));
  cv::bitwise_and(rim, part, rim);
  double measured = 0;
  median_depth_m(window, part, half_depth, 2, &measured);
  const float there = median_depth_m(window, touching, half_depth, 2),
              here = median_depth_m(window, rim, half_depth, 2);
  constexpr float kStepM = 0.12f;
  return measured >= kLeastMeasured && here > 0 && there > 0 && std::abs(here - there) < kStepM;
}

/// Keeps the connected parts of a mask that are large enough and belong to an object. @return whether any is left
bool keep_lost_parts(const cv::Rect& window, cv::Mat& mask, const Instance& rest, const cv::Mat& half_depth,
                     int least_px) {
  cv::Mat labels, stats, centroids;
  const int n = cv::connectedComponentsWithStats(mask, labels, stats, centroids, 8, CV_32S);
  mask.setTo(0);
  bool any = false;
  for (int i = 1; i < n; ++i) {
    if (stats.at<int>(i, cv::CC_STAT_AREA) < least_px) continue;
    const cv::Mat part = labels == i;
    if (!belongs(window, part, rest, half_depth)) continue;
    mask.setTo(255, part);
    any = true;
  }
  return any;
}

}  // namespace

void InstanceMemoryOptions::add_to(ConfigSchema& schema) {
  schema.add("repair.least_overlap", &least_overlap, {0.01, 1.0},
             "IoU of two masks of one object in successive frames");
  schema.add("repair.confirmations", &confirmations, {1, 1000},
             "frames in which an object was seen before it is restored");
  schema.add("repair.longest_carry", &longest_carry, {0, 10000}, "frames in a row that an object is restored");
  schema.add("repair.least_px", &least_px, {1, 1000000}, "smallest restored object, px");
  schema.add("repair.limb_trigger", &limb_trigger, {0.0, 1.0},
             "loss of an object's area from frame to frame at which lost parts are looked for");
  schema.add("repair.least_limb", &least_limb, {0.0, 1.0}, "smallest lost part, as a share of the object");
}

InstanceMemory::InstanceMemory(const Camera& camera, const MaskCarryOptions& carry,
                               const InstanceMemoryOptions& options)
    : carry_(camera, carry), options_(options) {}

void InstanceMemory::reset() { tracks_.clear(); }

struct InstanceMemory::Step {
  const CarryFrame& present;
  const std::optional<SE3>& cur_from_prev;
  bool lacking;
  Segmentation& segmentation;
  std::size_t segmented;              // instances that the segmenter gave
  std::vector<std::size_t> track_of;  // per segmented instance; kNone = new
  std::vector<float> depths_m;        // per segmented instance; 0 = unknown
  std::vector<bool> found;            // per track
  MemoryReport report;
  static constexpr std::size_t kNone = static_cast<std::size_t>(-1);

  std::span<const Instance> given() const { return std::span(segmentation.instances).first(segmented); }
};

MemoryReport InstanceMemory::step(const CarryFrame& present, const std::optional<SE3>& cur_from_prev, bool lacking,
                                  Segmentation& segmentation) {
  Step step{present, cur_from_prev, lacking, segmentation, segmentation.instances.size(), {}, {}, {}, {}};
  step.track_of.assign(step.segmented, Step::kNone);
  step.found.assign(tracks_.size(), false);
  for (const Instance& i : segmentation.instances)
    step.depths_m.push_back(median_depth_m(i.window, i.mask, present.half_depth_m(), 8));
  for (Track& t : tracks_) {
    ++t.known_age;
    t.present_from_whole = t.present_from_whole && cur_from_prev
                               ? std::optional<SE3>(*cur_from_prev * *t.present_from_whole)
                               : std::nullopt;
  }
  match(step);
  for (std::size_t i = 0; i < step.segmented; ++i)
    if (step.track_of[i] != Step::kNone) follow(step, tracks_[step.track_of[i]], i);
  std::vector<Track> kept;
  for (std::size_t t = 0; t < tracks_.size(); ++t)
    if (step.found[t] || restore(step, tracks_[t])) kept.push_back(std::move(tracks_[t]));
  for (std::size_t i = 0; i < step.segmented; ++i) {
    Instance& now = segmentation.instances[i];
    if (now.track.valid() || now.role != Role::kDynamic) continue;
    now.track = TrackId(next_track_++);
    Track fresh;
    fresh.id = now.track;
    fresh.confirmed = 1;
    fresh.depth_m = step.depths_m[i];
    fresh.known = now;
    renew(step, fresh, now, cv::countNonZero(now.mask));
    kept.push_back(std::move(fresh));
  }
  tracks_ = std::move(kept);
  return step.report;
}

void InstanceMemory::match(Step& step) {
  struct Candidate {
    double iou;
    std::size_t track, instance;
  };
  std::vector<Candidate> candidates;
  for (std::size_t t = 0; t < tracks_.size(); ++t)
    for (std::size_t i = 0; i < step.segmented; ++i) {
      const Track& track = tracks_[t];
      const Instance& now = step.segmentation.instances[i];
      if (now.role != Role::kDynamic || now.class_name != track.whole.class_name) continue;
      const Overlap o = overlap(track.last.window, track.last.mask, cv::Point(track.velocity_px), now.window, now.mask);
      const cv::Point2f shift = track.known_shift_px + track.velocity_px;
      const Overlap w = overlap(track.known.window, track.known.mask, cv::Point(shift), now.window, now.mask);
      const bool known = track.depth_m > 0 && step.depths_m[i] > 0;
      const bool same_depth = known && std::abs(track.depth_m - step.depths_m[i]) < kDepthReachM;
      // Half hidden, an object is a piece of what it was.
      const bool piece = same_depth && w.both > kLeastPiece * std::min(w.first, w.second);
      if (((o.iou() >= options_.least_overlap && !track.hidden) && (same_depth || !known)) || piece)
        candidates.push_back({std::max(track.hidden ? 0 : o.iou(), w.iou()), t, i});
    }
  std::stable_sort(candidates.begin(), candidates.end(),
                   [](const Candidate& a, const Candidate& b) { return a.iou > b.iou; });
  for (const Candidate& c : candidates) {
    if (step.found[c.track] || step.track_of[c.instance] != Step::kNone) continue;
    step.found[c.track] = true;
    step.track_of[c.instance] = c.track;
  }
}

void InstanceMemory::follow(Step& step, Track& track, std::size_t index) {
  Instance& now = step.segmentation.instances[index];
  const int segmented_px = cv::countNonZero(now.mask);
  const bool shrunk = segmented_px < (1 - options_.limb_trigger) * track.whole_px;
  const cv::Point2f moved = centre(now) - centre(track.last);
  track.half_hidden = false;
  const bool look = (shrunk || step.lacking) && track.confirmed >= options_.confirmations;
  const bool extended = look && track.extended < options_.longest_carry && extend(step, track, now);
  track.extended = extended ? track.extended + 1 : 0;
  track.carried = 0;
  track.hidden = false;
  if (step.depths_m[index] > 0) track.depth_m = step.depths_m[index];
  ++track.confirmed;
  now.track = track.id;
  if (!extended) {
    const bool by_flow = track.half_hidden && track.velocity_known;
    if (!by_flow) track.velocity_px = moved;
    renew(step, track, now, segmented_px);
  }
  // Half hidden, it stays known as a whole for a while, to be found again on the other side.
  if (track.half_hidden && track.known_age <= options_.longest_carry) {
    track.known_shift_px += track.velocity_px;
  } else {
    track.known = now;
    track.known_shift_px = {};
    track.known_age = 0;
  }
  track.last = now;
}

void InstanceMemory::renew(const Step& step, Track& track, const Instance& now, int pixels) {
  track.last = now;
  track.whole = now;
  track.whole_images = step.present;
  track.whole_px = pixels;
  track.present_from_whole = SE3();
  track.shift_px = {};
}

CarriedMask InstanceMemory::carry_whole(const Step& step, Track& track) const {
  CarriedMask out = carry_.carry(track.whole_images, step.present, track.whole.window, track.whole.mask,
                                 track.present_from_whole, track.shift_px + track.velocity_px);
  track.velocity_known = out.flow_points > 0;
  if (track.velocity_known) track.velocity_px = out.shift_px - track.shift_px;
  track.shift_px = out.shift_px;
  return out;
}

bool InstanceMemory::extend(Step& step, Track& track, Instance& now) {
  const CarriedMask carried = carry_whole(step, track);
  const double lost = 1 - static_cast<double>(cv::countNonZero(now.mask)) / std::max(1, track.whole_px);
  track.half_hidden = carried.outcome == CarryOutcome::kOccluded || carried.occluded > kHalfHidden * lost;
  if (carried.outcome != CarryOutcome::kVisible) return false;
  // What is still segmented shows whether the mask came to the right place.
  const Overlap agreement = overlap(carried.window, carried.mask, {}, now.window, now.mask);
  if (agreement.both < kLeastAgreement * agreement.second) return false;
  cv::Mat missing = carried.mask.clone();
  const int least = std::max(options_.least_px / 2, static_cast<int>(options_.least_limb * track.whole_px));
  if (subtract_movers(carried.window, missing, step.given(), kGapPx) < least) return false;
  cv::morphologyEx(missing, missing, cv::MORPH_OPEN, cv::getStructuringElement(cv::MORPH_RECT, cv::Size(5, 5)));
  if (!keep_lost_parts(carried.window, missing, now, step.present.half_depth_m(), least)) return false;
  // Back to where the segmented part ends.
  cv::dilate(missing, missing, cv::getStructuringElement(cv::MORPH_RECT, cv::Size(2 * kGapPx + 1, 2 * kGapPx + 1)));
  cv::bitwise_and(missing, carried.mask, missing);

  const cv::Rect united = now.window | carried.window;
  cv::Mat mask = cv::Mat::zeros(united.size(), CV_8UC1);
  now.mask.copyTo(mask(now.window - united.tl()));
  const int before = cv::countNonZero(mask);
  cv::Mat part = mask(carried.window - united.tl());
  cv::bitwise_or(part, missing, part);
  step.report.restored_px += cv::countNonZero(mask) - before;
  ++step.report.extended_instances;
  const cv::Rect set = cv::boundingRect(mask);
  place(set + united.tl(), mask(set), now);
  now.provenance = Provenance::kExtended;
  return true;
}

bool InstanceMemory::restore(Step& step, Track& track) {
  if (track.confirmed < options_.confirmations || track.carried >= options_.longest_carry) return false;
  CarriedMask carried = carry_whole(step, track);
  track.hidden = carried.outcome == CarryOutcome::kOccluded;
  track.known_shift_px += track.velocity_px;
  if (track.hidden) ++track.carried;
  if (carried.outcome != CarryOutcome::kVisible) return track.hidden;
  // Two masks of one object, the larger one often with furniture in it: with one of them here, nothing is missing.
  for (const Instance& other : step.given()) {
    if (other.class_name != track.whole.class_name) continue;
    const Overlap o = overlap(carried.window, carried.mask, {}, other.window, other.mask);
    if (o.second > 0 && o.both >= kHeld * o.second) return false;
  }
  const int carried_px = cv::countNonZero(carried.mask);
  const int left = subtract_movers(carried.window, carried.mask, step.given(), 0);
  if (left < options_.least_px || left < kMerged * carried_px) return false;
  // What fades at the border is leaving, not missed.
  if (at_border(carried.window, step.segmentation.size) && carried.inside < 0.5 && track.carried > 0) return false;

  Instance now = track.last;
  const cv::Rect set = cv::boundingRect(carried.mask);
  place(set + carried.window.tl(), carried.mask(set).clone(), now);
  now.id = InstanceId(static_cast<std::uint32_t>(step.segmentation.instances.size()));
  now.provenance = Provenance::kRestored;
  now.track = track.id;
  track.last = now;
  ++track.carried;
  track.extended = 0;
  ++step.report.restored_instances;
  step.report.restored_px += left;
  step.segmentation.instances.push_back(std::move(now));
  return true;
}

}  // namespace semvslam
