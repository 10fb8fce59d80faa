#include "semvslam/semantic/segmentation_score.h"

#include <algorithm>
#include <cmath>
#include <numeric>

namespace semvslam {
namespace {

constexpr int kMostDetections = 100;  // of one class in one image, as COCO counts
constexpr int kRecallPoints = 101;
constexpr double kNearArea = 96.0 * 96.0;

cv::Mat full_mask(const Instance& i, cv::Size size) {
  cv::Mat out = cv::Mat::zeros(size, CV_8UC1);
  i.mask.copyTo(out(i.window));
  return out;
}

double overlap(const cv::Mat& found, const cv::Mat& truth, bool crowd) {
  cv::Mat both;
  cv::bitwise_and(found, truth, both);
  const int common = cv::countNonZero(both), own = cv::countNonZero(found);
  const int whole = crowd ? own : own + cv::countNonZero(truth) - common;
  return whole > 0 ? static_cast<double>(common) / whole : 0;
}

}  // namespace

SegmentationScorer::SegmentationScorer(const CocoDataset& dataset, double sure)
    : categories_(dataset.categories), sure_(sure) {}

void SegmentationScorer::add(const CocoImage& image, const Segmentation& found) {
  ++images_;
  for (const auto& [id, name] : categories_) {
    std::vector<cv::Mat> truth;
    std::vector<bool> crowd;
    for (const CocoObject& o : image.objects)
      if (o.category == id) {
        truth.push_back(o.region.mask(image.size));
        crowd.push_back(o.crowd);
      }
    std::vector<const Instance*> mine;
    for (const Instance& i : found.instances)
      if (i.class_name == name && std::ssize(mine) < kMostDetections) mine.push_back(&i);
    add_class(name, truth, crowd, mine, image.size);
    if (name == "person") add_person_pixels(truth, crowd, mine, image.size);
  }
}

void SegmentationScorer::add_class(const std::string& name, const std::vector<cv::Mat>& truth,
                                   const std::vector<bool>& crowd, const std::vector<const Instance*>& found,
                                   cv::Size size) {
  ClassRecord& record = classes_[name];
  record.objects += static_cast<int>(std::count(crowd.begin(), crowd.end(), false));
  std::vector<std::size_t> order(truth.size());
  std::iota(order.begin(), order.end(), std::size_t{0});
  std::stable_sort(order.begin(), order.end(), [&](std::size_t a, std::size_t b) { return crowd[a] < crowd[b]; });

  std::vector<std::vector<bool>> taken(kOverlaps, std::vector<bool>(truth.size(), false));
  for (const Instance* i : found) {
    const cv::Mat mask = full_mask(*i, size);
    std::vector<double> iou(truth.size());
    for (std::size_t t = 0; t < truth.size(); ++t) iou[t] = overlap(mask, truth[t], crowd[t]);
    Detection detection;
    detection.score = i->score;
    for (int k = 0; k < kOverlaps; ++k) {
      double best = 0.5 + 0.05 * k - 1e-10;
      std::ptrdiff_t match = -1;
      for (const std::size_t t : order) {
        if (taken[k][t] && !crowd[t]) continue;
        if (match >= 0 && !crowd[match] && crowd[t]) break;  // an object is better than a crowd
        if (iou[t] < best) continue;
        best = iou[t];
        match = static_cast<std::ptrdiff_t>(t);
      }
      if (match < 0) continue;
      detection.matched[k] = true;
      detection.ignored[k] = crowd[match];
      taken[k][match] = true;
    }
    record.detections.push_back(detection);
  }
}

void SegmentationScorer::add_person_pixels(const std::vector<cv::Mat>& truth, const std::vector<bool>& crowd,
                                           const std::vector<const Instance*>& found, cv::Size size) {
  cv::Mat person = cv::Mat::zeros(size, CV_8UC1), unsure = person.clone(), mine = person.clone();
  for (std::size_t t = 0; t < truth.size(); ++t)
    cv::bitwise_or(crowd[t] ? unsure : person, truth[t], crowd[t] ? unsure : person);
  std::vector<cv::Mat> masks;
  for (const Instance* i : found)
    if (i->score >= sure_) {
      masks.push_back(full_mask(*i, size));
      cv::bitwise_or(mine, masks.back(), mine);
    }
  mine.setTo(0, unsure & ~person);  // crowds count neither way
  both_ += cv::countNonZero(mine & person);
  either_ += cv::countNonZero(mine | person);
  truth_pixels_ += cv::countNonZero(person);
  found_pixels_ += cv::countNonZero(mine);

  std::vector<std::pair<int, std::size_t>> near;
  for (std::size_t t = 0; t < truth.size(); ++t)
    if (const int area = cv::countNonZero(truth[t]); !crowd[t] && area > kNearArea) near.emplace_back(-area, t);
  std::sort(near.begin(), near.end());
  near_ += static_cast<int>(near.size());
  for (const auto& [area, t] : near) {
    const auto better = [&, index = t](const cv::Mat& a, const cv::Mat& b) {
      return overlap(a, truth[index], false) < overlap(b, truth[index], false);
    };
    const auto best = std::max_element(masks.begin(), masks.end(), better);
    if (best == masks.end()) continue;
    const double iou = overlap(*best, truth[t], false);
    if (iou < 0.5) continue;
    near_ious_.push_back(iou);
    masks.erase(best);
  }
}

double SegmentationScorer::average_precision(const ClassRecord& record, int overlap_index) {
  std::vector<const Detection*> order;
  for (const Detection& d : record.detections)
    if (!d.ignored[overlap_index]) order.push_back(&d);
  std::stable_sort(order.begin(), order.end(),
                   [](const Detection* a, const Detection* b) { return a->score > b->score; });
  std::vector<double> recall, precision;
  int hits = 0;
  for (std::size_t n = 0; n < order.size(); ++n) {
    hits += order[n]->matched[overlap_index];
    recall.push_back(static_cast<double>(hits) / record.objects);
    precision.push_back(static_cast<double>(hits) / static_cast<double>(n + 1));
  }
  for (std::size_t n = precision.size(); n-- > 1;) precision[n - 1] = std::max(precision[n - 1], precision[n]);
  double sum = 0;
  for (int p = 0; p < kRecallPoints; ++p) {
    const auto at = std::lower_bound(recall.begin(), recall.end(), p / (kRecallPoints - 1.0));
    if (at != recall.end()) sum += precision[static_cast<std::size_t>(at - recall.begin())];
  }
  return sum / kRecallPoints;
}

SegmentationScore SegmentationScorer::score() const {
  const auto share = [](std::int64_t a, std::int64_t b) {
    return b > 0 ? static_cast<double>(a) / static_cast<double>(b) : -1.0;
  };
  SegmentationScore out;
  out.images = images_;
  out.person_pixel_iou = share(both_, either_);
  out.person_pixel_recall = share(both_, truth_pixels_);
  out.person_pixel_precision = share(both_, found_pixels_);
  out.near_persons = near_;
  out.near_person_recall = share(std::ssize(near_ious_), near_);
  if (!near_ious_.empty())
    out.near_person_mean_iou =
        std::accumulate(near_ious_.begin(), near_ious_.end(), 0.0) / static_cast<double>(near_ious_.size());
  double sum = 0, sum50 = 0;
  int present = 0;
  for (const auto& [name, record] : classes_) {
    if (record.objects == 0) continue;
    double mean = 0;
    for (int k = 0; k < kOverlaps; ++k) mean += average_precision(record, k) / kOverlaps;
    const double at50 = average_precision(record, 0);
    ++present;
    sum += mean;
    sum50 += at50;
    if (name == "person") {
      out.person_mask_ap = mean;
      out.person_mask_ap50 = at50;
    }
  }
  if (present > 0) {
    out.mask_ap = sum / present;
    out.mask_ap50 = sum50 / present;
  }
  return out;
}

}  // namespace semvslam
