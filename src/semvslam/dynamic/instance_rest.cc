#include "semvslam/dynamic/instance_rest.h"

#include <algorithm>

namespace semvslam {
namespace {

constexpr int kLeastPoints = 8;       // with a verdict: fewer say nothing of a whole person
constexpr int kMovingPoints = 2;      // one alone may be an error of the flow
constexpr double kMovingShare = 0.1;  // a hand is some of twenty points; errors are one in a hundred
constexpr double kForgetAfterS = 1;   // not seen for that long: whoever comes next is another
constexpr double kUnwatchedAfterS =
    0.5;  // after it was seen to move: points in a walker cost time and tell nothing new

}  // namespace

bool is_same_place(const cv::Rect& a, const cv::Rect& b) {
  const int both = (a & b).area();
  return both * 10 > 3 * (a.area() + b.area() - both);
}

const InstanceRest::Entry* InstanceRest::find(const Instance& instance) const {
  const auto found = std::find_if(entries_.begin(), entries_.end(), [&](const Entry& e) {
    if (e.track.valid() && instance.track.valid()) return e.track == instance.track;
    return e.class_name == instance.class_name && is_same_place(e.window, instance.window);
  });
  return found == entries_.end() ? nullptr : &*found;
}

bool InstanceRest::rests(const Instance& instance) const {
  if (rest_after_s_ <= 0) return false;
  const Entry* entry = find(instance);
  return entry != nullptr && time_s_ - entry->still_since_s >= rest_after_s_;
}

bool InstanceRest::is_worth_watching(const Instance& instance, double time_s) const {
  if (rest_after_s_ <= 0) return false;
  const Entry* entry = find(instance);
  return entry == nullptr || entry->moved_at_s <= 0 || time_s - entry->moved_at_s > kUnwatchedAfterS;
}

void InstanceRest::update(std::span<const Instance> instances, std::span<const InstanceMotion> motions, double time_s) {
  if (rest_after_s_ <= 0) return;
  time_s_ = time_s;
  for (std::size_t i = 0; i < instances.size(); ++i) {
    const Instance& instance = instances[i];
    if (instance.role != Role::kDynamic) continue;
    const Entry* known = find(instance);
    Entry& entry = known ? entries_[static_cast<std::size_t>(known - entries_.data())]
                         : entries_.emplace_back(Entry{{}, {}, {}, time_s, 0, time_s});
    entry.track = instance.track;
    entry.class_name = instance.class_name;
    entry.window = instance.window;
    entry.seen_at_s = time_s;
    const bool moves = motions[i].moving >= kMovingPoints && motions[i].moving_share() >= kMovingShare;
    const bool known_to_be_still = !moves && motions[i].moving + motions[i].at_rest >= kLeastPoints;
    if (moves) entry.moved_at_s = time_s;
    if (!known_to_be_still) entry.still_since_s = time_s;
  }
  std::erase_if(entries_, [&](const Entry& e) { return time_s - e.seen_at_s > kForgetAfterS; });
}

}  // namespace semvslam
