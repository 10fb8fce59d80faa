#pragma once

#include <cstdint>
#include <memory>
#include <opencv2/core.hpp>
#include <string>
#include <vector>

#include "semvslam/base/result.h"
#include "semvslam/data/frame.h"
#include "semvslam/geometry/camera.h"
#include "semvslam/geometry/se3.h"

namespace semvslam {

/// What to render. The same options give the same bytes, whatever the number of threads and the order of the frames.
struct SceneOptions {
  std::string people = "walking";     // walking | sitting | none | carrying
  std::string motion = "halfsphere";  // of the camera: xyz | rpy | halfsphere | static | tour
  int width_px = 640, height_px = 480;
  int frames = 300;
  double frame_rate_hz = 30;
  std::uint64_t seed = 1;  // of textures, clutter, persons, their ways, the camera's way and all noise
  /// true: 16-bit depth with structured-light noise, image noise and vignetting. false: the exact picture, depth
  /// CV_32FC1 in metres.
  bool noise = true;
  bool motion_blur = false;  // exposure of half a frame time around the stamp
  int threads = 2;

  /// The first broken rule, naming the option, its value and what is allowed.
  Status check() const;
};

/// One rendered moment with its truth.
struct RenderedFrame {
  RgbdFrame frame;  // gray, colour and depth; the mask is left empty
  SE3 world_from_camera;
  cv::Mat instances;  // CV_8UC1 at the pixel centres: 0 background, else 1 + index into RenderedScene::roles()
};

/// A thing that can be told from the room.
struct SceneRole {
  std::string name;  // "person_1", "suitcase_1", ...
  std::string kind;  // "person" or "object"
  bool moves = false;
};

/// A furnished room with people in it, seen by a moving RGB-D camera. World frame: metres, z up, floor at z = 0.
/// Depth is z in the camera frame along the ray through the centre of the pixel (pixel (0, 0) = centre of the top left
/// one).
class RenderedScene {
 public:
  /// Builds the room, the persons and the camera's way. @return an Error for options that break SceneOptions::check().
  static Result<RenderedScene> create(const SceneOptions& options);
  ~RenderedScene();
  RenderedScene(RenderedScene&&) noexcept;
  RenderedScene& operator=(RenderedScene&&) noexcept;

  const Camera& camera() const;
  const SceneOptions& options() const;
  const std::vector<SceneRole>& roles() const;
  /// Frame number `index` in [0, options().frames); any order gives the same bytes. Not to be called by two threads at
  /// once.
  RenderedFrame render(std::size_t index);
  /// The pose of every frame at its stamp.
  Trajectory ground_truth() const;

 private:
  struct Impl;
  explicit RenderedScene(std::unique_ptr<Impl> impl);
  std::unique_ptr<Impl> impl_;
};

/// The frames of a scene in order. @param truth_mask_as_frame_mask fills RgbdFrame::mask with 255 where a role that
/// moves is seen.
Result<std::unique_ptr<FrameSource>> open_scene(const SceneOptions& options, bool truth_mask_as_frame_mask = false);

}  // namespace semvslam
