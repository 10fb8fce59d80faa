#pragma once

#include <filesystem>
#include <optional>
#include <string>

#include "semvslam/base/result.h"
#include "semvslam/data/file_io.h"
#include "semvslam/data/frame.h"
#include "semvslam/data/trajectory_io.h"

namespace semvslam {

struct SequenceWriterOptions {
  bool jpeg = false;        // colour images as JPEG instead of PNG (smaller, lossy)
  int jpeg_quality = 95;    // 1..100
  int png_compression = 1;  // 0 fastest .. 9 smallest
};

/// Writes a recording in TUM layout, as open_sequence reads it: rgb/STAMP.png (or .jpg), depth/STAMP.png,
/// mask/STAMP.png where a frame has a mask, rgb.txt, depth.txt, groundtruth.txt where poses are given, camera.yaml.
/// STAMP is the exact time stamp with nine decimals. Lists grow line by line behind the images they name: a recording
/// that is cut off is readable up to its last whole frame.
class SequenceWriter {
 public:
  /// Makes the folder where needed. Errors: not writable; one that already holds a recording (rgb.txt) is refused.
  static Result<SequenceWriter> create(const std::filesystem::path& folder, const Camera& camera,
                                       const SequenceWriterOptions& options = {});

  /// @param frame its colour image is written where there is one, else the grey one. Depth must be CV_16UC1.
  /// @param world_from_camera ground truth, where it is known. Errors: disk full; images that are not the camera's size
  /// or not of the types of RgbdFrame; a stamp not after the one before.
  Status write(const RgbdFrame& frame, const std::optional<SE3>& world_from_camera);

 private:
  SequenceWriter(std::filesystem::path folder, const Camera& camera, const SequenceWriterOptions& options);
  Status open_lists();
  Status check(const RgbdFrame& frame) const;
  Status write_image(const std::string& file, const cv::Mat& image);

  std::filesystem::path folder_;
  Camera camera_;
  SequenceWriterOptions options_;
  OutputFile colour_list_, depth_list_;
  std::optional<AppendingTrajectoryWriter> ground_truth_;
  std::optional<TimeStamp> last_stamp_;
};

}  // namespace semvslam
