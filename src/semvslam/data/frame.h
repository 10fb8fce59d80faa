#pragma once

#include <opencv2/core.hpp>
#include <optional>
#include <string>
#include <vector>

#include "semvslam/base/ids.h"
#include "semvslam/base/result.h"
#include "semvslam/base/time_stamp.h"
#include "semvslam/geometry/camera.h"
#include "semvslam/geometry/depth_image.h"
#include "semvslam/geometry/se3.h"

namespace semvslam {

/// One moment of an RGB-D stream. Images are shared, never written to after construction.
struct RgbdFrame {
  FrameId id;
  TimeStamp stamp;
  cv::Mat gray;    // CV_8UC1, always there
  cv::Mat colour;  // CV_8UC3 BGR, or empty where nobody asked for it (decoding it costs)
  cv::Mat depth;   // CV_16UC1 in units of Camera::depth_units_per_m, or CV_32FC1 in metres; 0 or NaN = no measurement
  cv::Mat mask;    // optional CV_8UC1, non-zero = pixel of something that may move; empty = unknown
};

/// Where frames come from: a recording, a renderer, a camera.
class FrameSource {
 public:
  virtual ~FrameSource() = default;
  /// The next frame; an empty optional at the end of the stream. After an Error the stream may go on (a frame that
  /// could not be read is one Error) unless `fatal()` says otherwise.
  virtual Result<std::optional<RgbdFrame>> next() = 0;
  virtual bool fatal() const { return false; }
  virtual const Camera& camera() const = 0;
  /// Number of frames in all, where it is known.
  virtual std::optional<std::size_t> size() const { return std::nullopt; }
  /// One line for logs: what is read and how.
  virtual std::string description() const = 0;
};

/// A pose at a time: world_from_camera.
struct StampedPose {
  TimeStamp stamp;
  SE3 world_from_camera;
};
using Trajectory = std::vector<StampedPose>;

}  // namespace semvslam
