#pragma once

#include <opencv2/core.hpp>
#include <vector>

#include "semvslam/feature/features.h"
#include "semvslam/feature/image_grid.h"
#include "semvslam/geometry/camera.h"
#include "semvslam/geometry/mask_runs.h"
#include "semvslam/solve/observation.h"

namespace semvslam {

/// How exact a measurement is; every weight and every gate of the system follows from these numbers.
struct NoiseModel {
  double pixel_sigma_px = 0.8;  // of a corner of pyramid level 0; grows with the level's scale
  double disparity_sigma_px =
      0.4;  // of the depth sensor, as disparity f b / z with the camera's baseline; sets the gate
  /// Share of the depth's information that is used. The errors of structured light are not independent: they bend the
  /// whole depth image by half a percent and more, so hundreds of points must not vote as hundreds of measurements. The
  /// depth fixes the scale and starts the landmarks; their shape comes from the pixels.
  double disparity_weight = 0.03;
  double depth_edge_ratio = 0.04;  // depth that spreads by more than this share around a corner is an edge: not used
  double min_depth_m = 0.1;
  double max_depth_m = 8.0;
};

/// The measurements of one image as tracking and mapping use them; entry i of every vector belongs to feature i.
struct FrameFeatures {
  OrbFeatures orb;                // as recorded
  std::vector<float> x_px, y_px;  // ideal (undistorted) pixel
  std::vector<float> depth_m;     // 0 = unknown
  ImageGrid grid;                 // over x_px, y_px
  MaskRuns moving;                // recorded pixels of what moves or may; kept for key frames only

  std::size_t size() const { return orb.size(); }
  bool has_depth(std::size_t i) const { return depth_m[i] > 0.f; }
};

/// Turns features into solver observations with the weights of the noise model.
class ObservationModel {
 public:
  ObservationModel(const Camera& camera, const NoiseModel& noise, std::vector<float> level_scales);

  PointObservation observation(const FrameFeatures& features, std::size_t i) const;
  /// Feature i as a point in the camera frame, metres. Needs has_depth(i).
  Eigen::Vector3d back_project(const FrameFeatures& features, std::size_t i) const;

  const Camera& camera() const { return camera_; }
  const Intrinsics& intrinsics() const { return intrinsics_; }
  const NoiseModel& noise() const { return noise_; }
  float level_scale(int level) const { return level_scales_[static_cast<std::size_t>(level)]; }
  int levels() const { return static_cast<int>(level_scales_.size()); }
  /// Pyramid level on which something seen at `scale` times its closest distance appears.
  int predict_level(float max_distance_over_distance) const;
  /// Gate for the weighted squared disparity residual: 95 % of what disparity_sigma_px explains.
  double chi2_disparity() const { return 3.841 * noise_.disparity_weight; }
  double inverse_variance_px(int level) const { return inverse_variance_px_[static_cast<std::size_t>(level)]; }

 private:
  Camera camera_;
  Intrinsics intrinsics_;
  NoiseModel noise_;
  std::vector<float> level_scales_;
  std::vector<double> inverse_variance_px_;
  double inverse_variance_disparity_;
  float inverse_log_factor_;
};

/// Fills the ideal pixels, depths and the grid of `features` from features.orb and the depth image.
/// A depth is the centre pixel's; it is dropped at depth edges (see NoiseModel), outside the range and where not
/// measured.
void measure(const ObservationModel& model, const cv::Mat& depth, FrameFeatures& features);

/// Drops the features i with keep[i] == 0; the order of the others stays. @param keep one per feature.
void keep_features(const std::vector<std::uint8_t>& keep, const Camera& camera, FrameFeatures& features);

}  // namespace semvslam
