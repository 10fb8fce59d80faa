#pragma once

#include <filesystem>
#include <memory>
#include <opencv2/core.hpp>
#include <string>
#include <vector>

#include "semvslam/base/config_schema.h"
#include "semvslam/base/result.h"
#include "semvslam/base/stage_timer.h"
#include "semvslam/semantic/roles.h"
#include "semvslam/semantic/segmentation.h"

namespace semvslam {

/// An image to segment and where it comes from: sources that look masks up need the stamp, networks only the pixels.
struct SegmentationRequest {
  FrameId frame;
  TimeStamp stamp;
  cv::Mat image;     // CV_8UC3 BGR, CV_8UC4 BGRA or CV_8UC1; 16-bit images are scaled down
  std::string name;  // file name without folder, where there is one
};

/// Finds the objects of an image. One call at a time per object: not safe for concurrent use; make one per thread.
class Segmenter {
 public:
  virtual ~Segmenter() = default;
  Segmenter() = default;
  Segmenter(const Segmenter&) = delete;
  Segmenter& operator=(const Segmenter&) = delete;

  /// Errors: an empty image, a type that is none, a network that gives no finite numbers, a mask file that is damaged.
  /// An image without any object is a Segmentation without instances.
  virtual Result<Segmentation> segment(const SegmentationRequest& request) = 0;
  virtual const std::vector<std::string>& class_names() const = 0;
  /// 10^9 operations (two to a multiply-add) of an image with so many proposals and masks; 0 = none or not known.
  static constexpr int kCostProposals = 100, kCostMasks = 5;
  virtual double gflops() const { return 0; }
  /// Least score of an instance beside a camera: even odds, and a mask as sure as good ones are (0.9).
  static constexpr double kLeastScore = 0.45;
  /// The same of single pictures. Beside a camera it is less: there a person that is missed costs more than a thing
  /// taken for one, and other frames and motion see both.
  static constexpr double kLeastScoreOfStills = 0.55;
  /// One line for logs.
  virtual std::string description() const = 0;
};

struct SegmenterOptions {
  std::string source = "network";  // network, folder, none
  std::string model;               // folder of the network's model.json; empty: the one that comes with semvslam
  std::string backend = "auto";    // auto, openvino, opencv
  std::string precision = "auto";  // auto: by keep_up; f32: the same everywhere; int8: eight bits
  int input_width_px = 0;          // of the image that the network sees; 0 = by keep_up
  // With a camera: the fastest numbers of the machine, the model's width, on slow machines less. Without one: floats,
  // and more than that width.
  bool keep_up = true;
  std::string mask_folder;  // of source `folder`
  double score = Segmenter::kLeastScore;
  int threads = 2;  // of the network; 0 = what suits the machine beside tracking

  void add_to(ConfigSchema& schema);
};

/// Errors: model or folder missing or damaged, a backend that this build lacks.
Result<std::unique_ptr<Segmenter>> make_segmenter(const SegmenterOptions& options, const RoleTable& roles,
                                                  StageTimers* timers = nullptr);

}  // namespace semvslam
