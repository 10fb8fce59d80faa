#include "semvslam/pipeline/config.h"

#include "semvslam/pipeline/presets.h"

namespace semvslam {
namespace {

void describe(ConfigSchema& s, OrbOptions& o) {
  s.add("orb.features", &o.features, {50, 20000}, "features aimed at per image");
  s.add("orb.levels", &o.levels, {1, 16}, "levels of the image pyramid");
  s.add("orb.scale_factor", &o.scale_factor, {1.01, 2.0}, "size ratio of neighbouring pyramid levels");
  s.add("orb.fast_threshold", &o.fast_threshold, {1, 254}, "FAST corner threshold, grey levels");
  s.add("orb.fast_threshold_low", &o.fast_threshold_low, {1, 254},
        "FAST threshold where the first finds nothing, grey levels");
  s.add("orb.cell_px", &o.cell_px, {8, 512}, "side of the cells that corners are spread over, px");
  s.add("orb.subpixel", &o.subpixel, "refine corners to a fraction of a pixel");
}

void describe(ConfigSchema& s, NoiseModel& n) {
  s.add("noise.pixel_sigma_px", &n.pixel_sigma_px, {0.01, 20}, "standard deviation of a corner of pyramid level 0, px");
  s.add("noise.disparity_sigma_px", &n.disparity_sigma_px, {0.001, 20},
        "standard deviation of measured depth as disparity f b / z, px");
  s.add("noise.disparity_weight", &n.disparity_weight, {1e-6, 1},
        "share of the depth's information that is used; its errors are correlated over the image");
  s.add("noise.depth_edge_ratio", &n.depth_edge_ratio, {0.001, 10},
        "depth is not used where it spreads more than this share around a corner");
  s.add("noise.min_depth_m", &n.min_depth_m, {0, 100}, "nearer depth is not used, m");
  s.add("noise.max_depth_m", &n.max_depth_m, {0.1, 1000}, "farther depth is not used, m");
}

void describe(ConfigSchema& s, TrackingOptions& t) {
  s.add("tracking.min_initial_points", &t.min_initial_points, {10, 20000},
        "features with depth that the first key frame needs");
  s.add("tracking.min_inliers", &t.min_inliers, {6, 10000}, "fewer landmarks that agree with the pose: lost");
  s.add("tracking.motion_radius_px", &t.motion_radius_px, {1, 200},
        "search window of frame-to-frame matching at level 0, px");
  s.add("tracking.local_map_radius_px", &t.local_map_radius_px, {0.5, 100},
        "search window of local-map matching at level 0, px");
  s.add("tracking.max_distance_bits", &t.max_distance_bits, {1, 256},
        "descriptors that differ in more bits never match");
  s.add("tracking.min_view_cosine", &t.min_view_cosine, {-1, 1},
        "landmarks seen from a direction farther off are not searched");
  s.add("tracking.key_frame_ratio", &t.key_frame_ratio, {0, 1},
        "new key frame below this share of the reference's landmarks");
  s.add("tracking.min_tracked_close", &t.min_tracked_close, {0, 20000},
        "new key frame when fewer close landmarks are tracked ...");
  s.add("tracking.min_new_close", &t.min_new_close, {0, 20000},
        "... while more than this many close features have none");
  s.add("tracking.close_depth_m", &t.close_depth_m, {0.1, 1000}, "depth up to which a feature is close, m");
  s.add("tracking.max_frames_between", &t.max_frames_between, {1, 100000},
        "new key frame after so many frames in any case");
  s.add("tracking.min_frames_between", &t.min_frames_between, {0, 100000}, "frames between two key frames at least");
}

void describe(ConfigSchema& s, MappingOptions& m) {
  s.add("mapping.max_landmark_depth_m", &m.max_landmark_depth_m, {0.1, 1000},
        "landmarks are made from depth up to here, m");
  s.add("mapping.min_found_ratio", &m.min_found_ratio, {0, 1},
        "young landmarks found more seldom than this share of frames go");
  s.add("mapping.young_key_frames", &m.young_key_frames, {1, 100},
        "key frames within which a landmark needs three observations");
  s.add("mapping.fuse_key_frames", &m.fuse_key_frames, {0, 1000},
        "neighbours in which duplicate landmarks are searched");
  s.add("mapping.fuse_radius_px", &m.fuse_radius_px, {0.1, 100}, "search window of fusion at level 0, px");
  s.add("mapping.bundle_key_frames", &m.bundle_key_frames, {2, 60},
        "key frames optimised in a local bundle adjustment");
  s.add("mapping.bundle_fixed_key_frames", &m.bundle_fixed_key_frames, {0, 1000}, "key frames that hold it in place");
  s.add("mapping.final_bundles", &m.final_bundles, {0, 10}, "full bundle adjustments when the run ends");
  s.add("mapping.min_shared", &m.min_shared, {1, 10000}, "shared landmarks that make two key frames neighbours");
  s.add("mapping.seen_through", &m.seen_through, {1, 100000},
        "frames in which the depth looks through a landmark's place: it is gone");
  s.add("mapping.redundant_ratio", &m.redundant_ratio, {0.1, 1},
        "a key frame goes when this share of its landmarks is seen in three others");
  s.add("mapping.frozen", &m.frozen, "only localise in a saved map: nothing in it changes (run --localise)");
  m.revisit.add_to(s);
  m.loop.add_to(s);
  m.relocalise.add_to(s);
  m.sub_maps.add_to(s);
  LocalMapOptions& l = m.local_map;
  s.add("mapping.local_map.covisible_key_frames", &l.covisible_key_frames, {1, 1000},
        "covisible key frames that tracking searches");
  s.add("mapping.local_map.nearby_key_frames", &l.nearby_key_frames, {0, 1000},
        "nearby key frames that share nothing yet and are searched too");
  s.add("mapping.local_map.nearby_distance_m", &l.nearby_distance_m, {0, 1000}, "how near these are, m");
  s.add("mapping.local_map.nearby_angle_deg", &l.nearby_angle_deg, {0, 180},
        "and how far their viewing direction differs at most, deg");
  s.add("mapping.local_map.max_points", &l.max_points, {100, 1000000}, "landmarks of a local map at most");
}

}  // namespace

ConfigSchema Config::schema() {
  ConfigSchema s;
  s.add("mode", &mode, mode_names(), "preset that the other values begin with: which evidence of motion is used");
  s.add("deterministic", &deterministic, "the same steps in a fixed order on one thread: two runs give the same bytes");
  s.add("realtime", &realtime, "never wait, neither for a mask nor for mapping");
  s.add("segment.at_once", &segment_at_once, {1, 64},
        "frames of a recording that are segmented at the same time, each by a copy of the network; deterministic and "
        "real-time runs segment one");
  s.add("mapping_queue", &mapping_queue, {1, 100}, "key frames that may wait for mapping");
  describe(s, orb);
  describe(s, noise);
  describe(s, tracking);
  describe(s, mapping);
  segment.add_to(s);
  dynamic.add_to(s);
  damage.add_to(s);
  dense.add_to(s);
  return s;
}

Status Config::apply_mode(const std::string& name) {
  const Result<std::string_view> preset = preset_of(name);
  if (!preset) return preset.error();
  if (Status status = schema().load_yaml(std::string(*preset), "mode " + name); !status) return status;
  mode = name;
  return Status::success();
}

Status Config::check() const {
  if (Status status = dynamic.check(); !status) return status;
  return dense.check();
}

}  // namespace semvslam
