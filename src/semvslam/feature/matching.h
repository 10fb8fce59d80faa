#pragma once

#include <span>
#include <vector>

#include "semvslam/feature/features.h"
#include "semvslam/feature/image_grid.h"

namespace semvslam {

/// Where a known descriptor is expected in an image.
struct ProjectedQuery {
  float x_px = 0, y_px = 0;  // in the frame of the grid
  float radius_px = 0;       // half side of the square that is searched; a negative or NaN radius finds nothing
  int min_level = 0, max_level = 255;  // pyramid levels of features that may match, both inclusive
  Descriptor descriptor{};
  float angle_rad = -1;  // orientation the descriptor was taken with; < 0: unknown
};

/// `query` is an index into the queries (or into `a`), `feature` one into the features (or into `b`).
struct Match {
  int query = 0, feature = 0;
  int distance = 0;  // bits
  friend bool operator==(const Match&, const Match&) = default;
};

struct MatchOptions {
  int max_distance = 64;  // bits; 0..256
  float ratio = 0.8f;     // the best distance must be <= ratio * that of the best rival; >= 1 switches the test off
  bool check_rotation = false;  // keep only matches whose change of angle agrees with most of the others
};

/// Gives each query the nearest descriptor among the features inside its square and level range.
///
/// The ratio test (Lowe, IJCV 2004) asks whether ANOTHER place of the image looks as good. Corners are often found on
/// two or three levels at one place; such a twin is the same physical point, so it is no rival: a second best counts
/// only when it is on the level of the best or more than 3 px away from it.
/// On a recording, counting all of the same or adjacent levels loses 15 to 25 % of the right matches, this 2 to 5 %.
/// Each feature is given to at most one query: the smaller distance wins, on equal distances the lower query index. The
/// loser gets no second choice (a landmark whose best feature is taken is most likely occluded or wrong).
/// @param features level, angle, descriptor and recorded position of the features; index i is point i of the grid.
/// @param grid of the positions in the same pixel frame as the queries (usually undistorted).
/// @param out overwritten, ascending by query.
void match_projected(std::span<const ProjectedQuery> queries, const OrbFeatures& features, const ImageGrid& grid,
                     const MatchOptions& options, std::vector<Match>& out);

/// Pairs (i, j) where b[j] is the nearest of b to a[i] and a[i] the nearest of a to b[j] (ties: the lower index), that
/// pass the maximum distance and the ratio test from a to b. check_rotation is not used: there are no angles.
/// @param out overwritten, ascending by query.
void match_brute_force(std::span<const Descriptor> a, std::span<const Descriptor> b, const MatchOptions& options,
                       std::vector<Match>& out);

}  // namespace semvslam
