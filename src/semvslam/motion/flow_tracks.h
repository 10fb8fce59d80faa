#pragma once

#include <Eigen/Core>
#include <array>
#include <cstdint>
#include <opencv2/core.hpp>
#include <string_view>
#include <variant>
#include <vector>

#include "semvslam/base/config_schema.h"
#include "semvslam/feature/lucas_kanade.h"
#include "semvslam/geometry/camera.h"
#include "semvslam/motion/motion_frame.h"

namespace semvslam {

using PointTrackId = Id<struct PointTrackTag>;  // never used twice in one FlowTracks

/// Where one point of the scene was seen in one frame.
struct TrackSample {
  FrameId frame;
  double time_s = 0;
  Eigen::Vector2f pixel = Eigen::Vector2f::Zero();  // recorded
  Eigen::Vector2f ideal = Eigen::Vector2f::Zero();  // without lens distortion
  float depth_m = 0;                                // along z; 0 = not measured
  float depth_spread_m = 0;  // range of the depths around it beyond a slanted surface's: large at an edge of depth
  Eigen::Vector3f texture = Eigen::Vector3f::Zero();  // mean g g^T of the grey gradient around: xx, xy, yy
  bool excluded = false;                              // lay inside MotionFrame::excluded
};

/// A point followed through the images. The history is a ring: sample(0) is the newest.
class FlowTrack {
 public:
  static constexpr int kCapacity = 12;  // samples kept

  explicit FlowTrack(PointTrackId id) : id_(id) {}
  PointTrackId id() const { return id_; }
  /// Samples held, 1..kCapacity.
  int size() const { return size_; }
  /// @param age 0 = newest, size() - 1 = oldest. Samples of consecutive frames.
  const TrackSample& sample(int age) const {
    return samples_[static_cast<std::size_t>((head_ - age + kCapacity) % kCapacity)];
  }
  const TrackSample& newest() const { return sample(0); }
  void set_newest_excluded(bool excluded) { samples_[static_cast<std::size_t>(head_)].excluded = excluded; }
  /// Frames since the track began, also those no longer held.
  int length() const { return length_; }
  void push(const TrackSample& sample);

 private:
  PointTrackId id_;
  int head_ = -1, size_ = 0, length_ = 0;
  std::array<TrackSample, kCapacity> samples_;
};

/// Why a track ended.
enum class TrackLoss : std::uint8_t {
  kNotFound,    // optical flow did not converge
  kBorder,      // came too near to the border of the image
  kBackward,    // following it back does not lead to where it came from
  kAppearance,  // its surroundings no longer look alike
  kCrowded,     // ran into an older track
};
inline constexpr std::size_t kTrackLosses = 5;
std::string_view to_string(TrackLoss loss);

struct LostTrack {
  PointTrackId id;
  TrackLoss reason = TrackLoss::kNotFound;
};

struct FlowTrackOptions {
  int tracks = 350;                  // aimed at
  int cell_px = 40;                  // side of the cells over which they are spread
  int min_distance_px = 8;           // between tracks
  int window_px = 15;                // side of the patch that is followed (odd)
  int levels = 3;                    // of the pyramid, beside the image itself
  double max_backward_px = 0.7;      // forward-backward distance
  double max_patch_difference = 18;  // mean absolute difference in grey levels, brightness offset removed
  int border_px = 10;

  void add_to(ConfigSchema& schema);
};

/// Persistent point tracks: pyramidal Lucas-Kanade flow from frame to frame with checks, and new points where there are
/// few. The image pyramid of a frame is made once and serves as the previous one next time.
/// Pure computation; the same calls give the same tracks.
class FlowTracks {
 public:
  FlowTracks(const Camera& camera, const FlowTrackOptions& options);

  /// Follows all tracks into this frame and starts new ones. The frame's cur_from_prev, together with the depth of a
  /// track, gives where the search starts. A frame of another size than the camera's is a programming error (throws).
  void step(const MotionFrame& frame);
  /// The first half of step(), which needs no masks and no corners. Given beforehand, step() of the same frame does the
  /// second half only.
  void follow(const MotionFrame& frame);

  const std::vector<FlowTrack>& tracks() const { return tracks_; }
  /// Of the last step.
  const std::vector<LostTrack>& lost() const { return lost_; }
  /// Forgets everything but the ids given out.
  void reset();

 private:
  /// Far enough from the image's border to be followed.
  bool is_inside(cv::Point2f p) const;
  cv::Point2f predict(const MotionFrame& frame, const TrackSample& last) const;
  /// Where a point went, or why it is lost. @param start where it is searched for
  std::variant<cv::Point2f, TrackLoss> find(cv::Point2f from, cv::Point2f start) const;
  void follow_all(const MotionFrame& frame);
  void refill(const MotionFrame& frame);
  TrackSample make_sample(const MotionFrame& frame, const Eigen::Vector2f& pixel) const;

  Camera camera_;
  FlowTrackOptions options_;
  std::uint32_t next_id_ = 0;
  std::vector<FlowTrack> tracks_;
  std::vector<LostTrack> lost_;
  LucasKanadeOptions forward_, backward_;
  FlowPyramid pyramid_, previous_pyramid_;
  bool followed_ = false;  // into the frame that step() will be given
};

}  // namespace semvslam
