#pragma once

#include <opencv2/core.hpp>
#include <string>
#include <vector>

#include "semvslam/base/ids.h"
#include "semvslam/base/time_stamp.h"
#include "semvslam/geometry/mask_runs.h"
#include "semvslam/semantic/roles.h"

namespace semvslam {

/// Where the pixels of an Instance come from.
enum class Provenance {
  kSegmented,  // as the segmenter gave it
  kExtended,   // segmented, with a lost part put back
  kRestored,   // the segmenter missed it: carried over from an earlier frame
};

using TrackId = Id<struct TrackTag>;  // one object over many images

/// One object of one image.
struct Instance {
  InstanceId id;        // position in its Segmentation
  int class_index = 0;  // into the segmenter's class names
  std::string class_name;
  Role role = Role::kStatic;
  float score = 0.f;  // 0..1; 1 where the source gives none
  cv::Rect2f box;     // px
  cv::Rect window;    // where `mask` lies in the image; inside it
  cv::Mat mask;       // CV_8UC1 of the window's size, 255 = the object. Shared, never written to after construction
  Provenance provenance = Provenance::kSegmented;
  TrackId track;  // set by SegmentationRepair, none before
};

/// Where a class is to be seen in an image, kept small.
struct ClassMask {
  int class_index = 0;  // as in Instance
  std::string class_name;
  MaskRuns pixels;
};

/// What is to be seen in one image. Late data: it names the frame that it was made from.
struct Segmentation {
  FrameId frame;
  TimeStamp stamp;
  cv::Size size;
  std::vector<Instance> instances;  // best first

  /// CV_8UC1 of the whole image: 255 where an instance of that role or a less trusted one is.
  cv::Mat mask_of(Role least) const;
  /// CV_8UC1: 255 where an instance of that class is.
  cv::Mat mask_of_class(std::string_view class_name) const;
  /// CV_16UC1: 0 = none, n = instance n - 1. Where two overlap the better one wins.
  cv::Mat labels() const;
  /// Of every class that is to be seen, ascending by class_index. A pixel belongs to one of them: where instances
  /// overlap, to the better one's.
  std::vector<ClassMask> class_masks() const;
  /// Number of pixels of the class, each counted once.
  int pixels_of_class(std::string_view class_name) const;
};

}  // namespace semvslam
