#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <opencv2/core.hpp>
#include <span>
#include <string_view>
#include <unordered_map>
#include <vector>

#include "semvslam/geometry/image_pool.h"
#include "semvslam/motion/depth_seeds.h"
#include "semvslam/motion/motion_check.h"
#include "semvslam/motion/region_growth.h"

namespace semvslam {

using RegionId = Id<struct RegionTag>;

enum class RegionState : std::uint8_t {
  kMoving,
  kPaused,  // moved a moment ago; its points are not trusted yet
};
std::string_view to_string(RegionState state);

/// A thing that moves and belongs to no known instance.
struct MovingRegion {
  RegionId id;
  RegionState state = RegionState::kMoving;
  cv::Rect window;        // where `mask` lies in the image; inside it
  cv::Mat mask;           // CV_8UC1 of the window's size, 255 = the thing
  int tracks = 0;         // moving tracks in it now
  int seeds = 0;          // places where the surface is nearer than it should be
  float depth_m = 0;      // median
  double moved_at_s = 0;  // when it was last seen to move
  Eigen::Vector3f velocity_m_s = Eigen::Vector3f::Zero();
};

struct MovingRegionOptions {
  int min_tracks = 3;       // moving tracks (and depth seeds) that make a new region
  double cluster_px = 60;   // tracks farther apart in the image ...
  double cluster_m = 0.35;  // ... or in space are in different regions
  /// A region may reach that far from its tracks: half a cell of FlowTrackOptions, over which tracks are spread.
  /// Farther, it takes the static surface beside a thing along with it.
  double margin_px = 20;
  double hold_s = 1.0;      // it is kept for that long after it stopped
  bool depth_seeds = true;  // use surfaces nearer than predicted as further evidence
  int seed_step_px = 8;     // raster on which they are looked for

  void add_to(ConfigSchema& schema);
};

/// Groups moving tracks into things, gives them a mask by growing over the depth image, and follows them over time.
class MovingRegions {
 public:
  MovingRegions(const Camera& camera, const MovingRegionOptions& options, const MotionCheckOptions& check_options);

  /// @param motion of this frame, as the tracks. Tracks inside frame.excluded or frame.instances make no regions.
  void step(const MotionFrame& frame, std::span<const FlowTrack> tracks, const MotionCheckResult& motion);

  const std::vector<MovingRegion>& regions() const { return regions_; }
  /// CV_8UC1 of the image's size: 255 = inside a region, moving or paused. All zero where there is none.
  const cv::Mat& mask() const { return mask_; }
  void reset();

 private:
  struct Evidence {  // a moving track or a depth seed
    cv::Point2f pixel;
    float depth_m = 0;
    PointTrackId track;  // invalid: a depth seed
    Eigen::Vector3f velocity_m_s = Eigen::Vector3f::Zero();
    int moving_frames = 0;
    float depth_spread_m = 0;
  };
  struct Kept {
    MovingRegion region;
    std::unordered_map<PointTrackId, double> members;  // when each was last seen to move, s
    std::vector<Evidence> fresh;                       // of this frame
    std::vector<Evidence> anchors;                     // fresh ones and members that rest
    cv::Mat cells;                                     // CV_8UC1 on the raster of CellGrid
  };
  std::vector<Evidence> collect(const MotionFrame& frame, std::span<const FlowTrack> tracks,
                                const MotionCheckResult& motion);
  bool is_unclaimed(const MotionFrame& frame, const cv::Point2f& pixel) const;
  bool belong_together(const Evidence& a, const Evidence& b) const;
  void carry(const MotionFrame& frame, const CellGrid& before, const MotionCheckResult& motion);
  bool move_alike(std::span<const Evidence> evidence) const;
  bool rests(std::span<const Evidence> evidence, std::span<const FlowTrack> tracks,
             const MotionCheckResult& motion) const;
  void assign(const MotionFrame& frame, std::span<const FlowTrack> tracks, const MotionCheckResult& motion,
              const std::vector<Evidence>& evidence);
  std::vector<Evidence> without_strays(const std::vector<Evidence>& anchors) const;
  void update(Kept& kept, const MotionFrame& frame, std::span<const FlowTrack> tracks, const MotionCheckResult& motion);
  void merge();
  void draw();

  Camera camera_;
  MovingRegionOptions options_;
  DepthSeeds depth_seeds_;
  std::uint32_t next_id_ = 0;
  double last_time_s_ = 0;
  CellGrid grid_;  // of the last frame
  std::vector<Kept> kept_;
  std::vector<MovingRegion> regions_;
  cv::Mat mask_;
  ImagePool masks_;
};

/// How the tracks inside one instance fare.
struct InstanceMotion {
  InstanceId instance;
  int moving = 0, at_rest = 0, unknown = 0;
  /// Share of moving ones among those with a verdict; 0 without any.
  double moving_share() const { return moving + at_rest > 0 ? static_cast<double>(moving) / (moving + at_rest) : 0; }
};

/// @param instances one per track: where it lies, 0 = in none, n = in instance n - 1. Entry i is instance i; as many as
/// asked.
std::vector<InstanceMotion> count_instance_motion(std::span<const TrackMotion> motion,
                                                  std::span<const std::uint16_t> instances, std::size_t count);

}  // namespace semvslam
