#pragma once

#include <algorithm>
#include <map>
#include <opencv2/core.hpp>
#include <opencv2/imgproc.hpp>
#include <string>
#include <utility>
#include <vector>

#include "semvslam/semantic/segmentation_repair.h"

namespace semvslam {

/// A flat thing with a texture of its own, parallel to the image.
struct Cutout {
  std::string class_name;  // empty = in no segmentation
  cv::Point at;            // of its box
  cv::Size size;
  double depth_m = 2;
  int texture = 1;
  bool arm = false;  // stretched out to the right at a quarter of the height
};

inline Cutout moved(Cutout thing, int dx, int dy = 0, double dz_m = 0) {
  thing.at += cv::Point(dx, dy);
  thing.depth_m += dz_m;
  return thing;
}

struct TestView {
  cv::Mat gray, depth;  // 8 bit; 16 bit, 5000 per metre
  Segmentation truth;
};

/// A textured wall and cutouts before it, the nearest in front, with exact masks.
class TestScene {
 public:
  TestScene() {
    camera_.width_px = 320;
    camera_.height_px = 240;
    camera_.fx_px = camera_.fy_px = 260;
    camera_.cx_px = 159.5;
    camera_.cy_px = 119.5;
  }
  const Camera& camera() const { return camera_; }
  cv::Size size() const { return {camera_.width_px, camera_.height_px}; }

  /// @param wall_shift motion of the wall's texture, px.
  TestView view(int frame, std::vector<Cutout> things, cv::Point wall_shift = {}) const {
    TestView out;
    out.gray = texture(0)(cv::Rect(cv::Point(100, 100) - wall_shift, size())).clone();
    out.depth = cv::Mat(size(), CV_16UC1, cv::Scalar(3.0 * camera_.depth_units_per_m));
    out.truth = {FrameId(static_cast<std::uint32_t>(frame)), TimeStamp{frame * 33'333'333ll}, size(), {}};
    std::stable_sort(things.begin(), things.end(),
                     [](const Cutout& a, const Cutout& b) { return a.depth_m > b.depth_m; });
    std::vector<cv::Mat> masks;
    for (const Cutout& thing : things) {
      const cv::Mat mask = draw(thing, out);
      for (cv::Mat& farther : masks) farther.setTo(0, mask);
      masks.push_back(mask);
    }
    for (std::size_t i = 0; i < things.size(); ++i)
      if (!things[i].class_name.empty()) add_instance(things[i].class_name, masks[i], out.truth);
    return out;
  }

  static void add_instance(const std::string& class_name, const cv::Mat& mask, Segmentation& to) {
    const cv::Rect window = cv::boundingRect(mask);
    if (window.empty()) return;
    Instance i;
    i.id = InstanceId(static_cast<std::uint32_t>(to.instances.size()));
    i.class_name = class_name;
    i.role = RoleTable().role(class_name);
    i.score = 0.9f;
    i.box = cv::Rect2f(window);
    i.window = window;
    i.mask = mask(window).clone();
    to.instances.push_back(std::move(i));
  }

 private:
  static const cv::Mat& texture(int number) {
    static std::map<int, cv::Mat> made;
    cv::Mat& out = made[number];
    if (!out.empty()) return out;
    out.create(600, 800, CV_8UC1);
    cv::RNG random(static_cast<std::uint64_t>(number) + 77);
    random.fill(out, cv::RNG::UNIFORM, 0, 256);
    cv::GaussianBlur(out, out, cv::Size(0, 0), 2.5);
    cv::normalize(out, out, 0, 255, cv::NORM_MINMAX);
    return out;
  }
  cv::Mat draw(const Cutout& thing, TestView& view) const {
    cv::Mat mask = cv::Mat::zeros(size(), CV_8UC1);
    cv::rectangle(mask, cv::Rect(thing.at, thing.size), 255, cv::FILLED);
    if (thing.arm) {
      const cv::Point shoulder = thing.at + cv::Point(thing.size.width, thing.size.height / 4);
      cv::rectangle(mask, cv::Rect(shoulder, cv::Size(thing.size.width / 2, thing.size.height / 6)), 255, cv::FILLED);
    }
    const cv::Rect window = cv::boundingRect(mask);
    if (!window.empty()) {
      const cv::Mat own = texture(thing.texture)(cv::Rect(window.tl() - thing.at + cv::Point(300, 200), window.size()));
      own.copyTo(view.gray(window), mask(window));
      view.depth.setTo(cv::Scalar(thing.depth_m * camera_.depth_units_per_m), mask);
    }
    return mask;
  }
  Camera camera_;
};

inline double mask_iou(const cv::Mat& a, const cv::Mat& b) {
  const int either = cv::countNonZero(a | b);
  return either > 0 ? static_cast<double>(cv::countNonZero(a & b)) / either : 1;
}

inline cv::Mat whole_image(const cv::Rect& window, const cv::Mat& mask, cv::Size size) {
  cv::Mat out = cv::Mat::zeros(size, CV_8UC1);
  if (!window.empty()) mask.copyTo(out(window));
  return out;
}

}  // namespace semvslam
