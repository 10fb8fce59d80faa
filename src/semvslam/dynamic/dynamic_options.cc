#include "semvslam/dynamic/dynamic_filter.h"

namespace semvslam {

void DynamicOptions::add_to(ConfigSchema& s) {
  s.add("dynamic.masks", &masks, {"off", "boxes", "masks"},
        "what of instances of dynamic classes is left out: nothing, their boxes, their pixels");
  s.add("dynamic.motion", &motion, "motion consistency: find what moves without knowing its class");
  s.add("dynamic.fit_band_px", &fit.band_px, {0, 100},
        "the outline of a mask may move by this to fit the depth image, px; 0 = it stays");
  s.add("dynamic.fit_tolerance_m", &fit.tolerance_m, {0.01, 10},
        "depth that is that near to a thing's belongs to it, m");
  s.add("dynamic.fit_reach_px", &fit.reach_px, {4, 1000}, "window over which the depth of a thing is averaged, px");
  s.add("dynamic.dilate_px", &dilate_px, {0, 50},
        "so far from the outline of a mask, inwards and outwards, features only find known landmarks, px");
  s.add("dynamic.reach_m", &reach_m, {0, 5},
        "no landmark comes from an untested feature that near, along the surface, to something that moves, m; 0 = off");
  s.add("dynamic.rest_reach_m", &rest_reach_m, {0, 5}, "the same for features that were seen to be at rest, m");
  s.add("dynamic.least_features", &least_features, {0, 20000},
        "features with depth below which the filter opens: motion first, then the weakest masks");
  s.add("dynamic.movable_share", &movable_share, {0, 1},
        "share of the points of a movable instance (chair, book, cup) that move: it is moving");
  s.add("dynamic.movable_points", &movable_points, {1, 1000}, "and so many must");
  s.add("dynamic.movable_hold_s", &movable_hold_s, {0, 60}, "it counts as moving for that long after it stopped, s");
  s.add("dynamic.rest_after_s", &rest_after_s, {0, 3600},
        "a person of whom nothing has moved for that long counts as static until she moves, s; 0 = never");
  restoration.add_to(s);
  motion_options.add_to(s);
}

Status DynamicOptions::check() const { return restoration.check(); }

}  // namespace semvslam
