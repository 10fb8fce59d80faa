#include "semvslam/feature/matching.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <numbers>

namespace semvslam {
namespace {

constexpr int kNoDistance = 257;     // above every Hamming distance
constexpr float kSamePlacePx = 3.f;  // corners of other levels this near are the same physical point
constexpr int kAngleBins = 36;       // of 10 degrees
constexpr float kAngleTolerance_rad = 30.f * std::numbers::pi_v<float> / 180.f;

bool passes_ratio(int best, int rival, float ratio) {
  return rival == kNoDistance || static_cast<float>(best) <= ratio * static_cast<float>(rival);
}

/// A feature and its distance in one number: the least is the nearest, and the lowest index among equally near ones.
struct Candidate {
  std::uint64_t key;
  Candidate(std::uint32_t feature, int distance) : key(static_cast<std::uint64_t>(distance) << 32 | feature) {}
  std::uint32_t feature() const { return static_cast<std::uint32_t>(key); }
  int distance() const { return static_cast<int>(key >> 32); }
};

/// Finds the candidates of one query after the other: the features in its square and level range. Which those are is
/// hardly predictable, so they are sorted out without branches.
class CandidateFinder {
 public:
  CandidateFinder(const OrbFeatures& features, const ImageGrid& grid)
      : features_(features), grid_(grid), near_(grid.size()) {}

  std::span<const Candidate> find(const ProjectedQuery& query) {
    const std::size_t near = grid_.find_near(query.x_px, query.y_px, query.radius_px, near_);
    std::size_t kept = 0;
    for (std::size_t k = 0; k < near; ++k) {
      const std::uint32_t i = near_[k];
      const int level = features_.keypoints[i].level;
      near_[kept] = i;
      kept += static_cast<std::size_t>((level >= query.min_level) & (level <= query.max_level));
    }
    candidates_.clear();
    for (std::size_t k = 0; k < kept; ++k)
      candidates_.emplace_back(near_[k], hamming_distance(query.descriptor, features_.descriptors[near_[k]]));
    return candidates_;
  }

 private:
  const OrbFeatures& features_;
  const ImageGrid& grid_;
  std::vector<std::uint32_t> near_;
  std::vector<Candidate> candidates_;
};

bool is_same_place(const Keypoint& a, const Keypoint& b) {
  return a.level != b.level && std::abs(a.x_px - b.x_px) <= kSamePlacePx && std::abs(a.y_px - b.y_px) <= kSamePlacePx;
}

/// Whether another place of the image looks nearly as good as the best one.
bool has_rival(const Candidate& best, std::span<const Candidate> candidates, const OrbFeatures& features, float ratio) {
  const Keypoint& place = features.keypoints[best.feature()];
  return std::any_of(candidates.begin(), candidates.end(), [&](const Candidate& c) {
    return c.key != best.key && !passes_ratio(best.distance(), c.distance(), ratio) &&
           !is_same_place(place, features.keypoints[c.feature()]);
  });
}

/// Change of angle from query to feature in [0, 2 pi).
float angle_change_rad(const ProjectedQuery& query, const Keypoint& keypoint) {
  constexpr float kTurn = 2 * std::numbers::pi_v<float>;
  const float change = std::fmod(keypoint.angle_rad - query.angle_rad, kTurn);
  return change < 0 ? change + kTurn : change;
}

/// Keeps matches whose change of angle lies near the peak of all changes. An image turns as a whole, so right matches
/// agree and wrong ones spread over the circle.
void drop_odd_rotations(std::span<const ProjectedQuery> queries, const OrbFeatures& features,
                        std::vector<Match>& matches) {
  constexpr float kTurn = 2 * std::numbers::pi_v<float>;
  const auto change_of = [&](const Match& m) {
    return angle_change_rad(queries[static_cast<std::size_t>(m.query)],
                            features.keypoints[static_cast<std::size_t>(m.feature)]);
  };
  const auto known = [&](const Match& m) { return queries[static_cast<std::size_t>(m.query)].angle_rad >= 0; };

  std::array<int, kAngleBins> histogram{};
  for (const Match& m : matches) {
    if (known(m)) ++histogram[static_cast<std::size_t>(change_of(m) * (kAngleBins / kTurn)) % kAngleBins];
  }
  const auto around = [&](int bin) {  // three neighbouring bins: the peak may straddle a border
    return histogram[static_cast<std::size_t>((bin + kAngleBins - 1) % kAngleBins)] +
           histogram[static_cast<std::size_t>(bin)] + histogram[static_cast<std::size_t>((bin + 1) % kAngleBins)];
  };
  int peak = 0;
  for (int bin = 1; bin < kAngleBins; ++bin) {
    if (around(bin) > around(peak)) peak = bin;
  }
  // Centre of the peak: mean of its members, relative to the middle of the bin.
  const float middle = (static_cast<float>(peak) + 0.5f) * (kTurn / kAngleBins);
  float sum = 0;
  int members = 0;
  for (const Match& m : matches) {
    if (!known(m)) continue;
    const float offset = std::remainder(change_of(m) - middle, kTurn);
    if (std::abs(offset) > 1.5f * (kTurn / kAngleBins)) continue;
    sum += offset;
    ++members;
  }
  const float centre = middle + (members > 0 ? sum / static_cast<float>(members) : 0.f);
  std::erase_if(matches, [&](const Match& m) {
    return known(m) && std::abs(std::remainder(change_of(m) - centre, kTurn)) > kAngleTolerance_rad;
  });
}

/// Leaves each feature to its nearest query.
void make_one_to_one(std::size_t features, std::vector<Match>& matches) {
  std::vector<int> owner(features, -1);  // position in matches
  for (std::size_t i = 0; i < matches.size(); ++i) {
    int& o = owner[static_cast<std::size_t>(matches[i].feature)];
    if (o < 0 || matches[i].distance < matches[static_cast<std::size_t>(o)].distance) o = static_cast<int>(i);
  }
  std::size_t kept = 0;
  for (std::size_t i = 0; i < matches.size(); ++i) {
    if (owner[static_cast<std::size_t>(matches[i].feature)] == static_cast<int>(i)) matches[kept++] = matches[i];
  }
  matches.resize(kept);
}

/// Descriptors word by word: words w of neighbours stand side by side, as vector registers want them.
class WordColumns {
 public:
  explicit WordColumns(std::span<const Descriptor> descriptors) {
    for (std::size_t w = 0; w < words_.size(); ++w) {
      words_[w].resize(descriptors.size());
      for (std::size_t j = 0; j < descriptors.size(); ++j) words_[w][j] = descriptors[j][w];
    }
  }

  /// Distances to all, as keys with the index j of the column's descriptor; lowers nearest[j] to the key with index i.
  /// @return the least of keys. Compiled to VPOPCNTQ where the target has it.
  std::uint64_t keys_of(const Descriptor& d, std::uint64_t i, std::span<std::uint64_t> keys,
                        std::span<std::uint64_t> nearest) const {
    const std::uint64_t *w0 = words_[0].data(), *w1 = words_[1].data(), *w2 = words_[2].data(), *w3 = words_[3].data();
    const std::uint64_t d0 = d[0], d1 = d[1], d2 = d[2], d3 = d[3];
    std::uint64_t* __restrict key = keys.data();
    std::uint64_t* __restrict column = nearest.data();
    std::uint64_t best = std::numeric_limits<std::uint64_t>::max();
    const std::size_t n = keys.size();
    for (std::size_t j = 0; j < n; ++j) {
      const auto distance = static_cast<std::uint64_t>(std::popcount(w0[j] ^ d0) + std::popcount(w1[j] ^ d1) +
                                                       std::popcount(w2[j] ^ d2) + std::popcount(w3[j] ^ d3))
                            << 32;
      key[j] = distance + j;
      best = std::min(best, distance + j);
      column[j] = std::min(column[j], distance + i);
    }
    return best;
  }

 private:
  std::array<std::vector<std::uint64_t>, 4> words_;
};

}  // namespace

void match_projected(std::span<const ProjectedQuery> queries, const OrbFeatures& features, const ImageGrid& grid,
                     const MatchOptions& options, std::vector<Match>& out) {
  out.clear();
  CandidateFinder finder(features, grid);
  for (std::size_t q = 0; q < queries.size(); ++q) {
    const std::span<const Candidate> candidates = finder.find(queries[q]);
    const auto best = std::ranges::min_element(candidates, {}, &Candidate::key);
    if (best == candidates.end() || best->distance() > options.max_distance) continue;
    if (options.ratio < 1.f && has_rival(*best, candidates, features, options.ratio)) continue;
    out.push_back({static_cast<int>(q), static_cast<int>(best->feature()), best->distance()});
  }
  if (options.check_rotation) drop_odd_rotations(queries, features, out);
  make_one_to_one(features.size(), out);
}

void match_brute_force(std::span<const Descriptor> a, std::span<const Descriptor> b, const MatchOptions& options,
                       std::vector<Match>& out) {
  out.clear();
  if (b.empty()) return;
  const WordColumns columns(b);
  // A key is distance * 2^32 + index: the least key is the nearest, and the lowest index among equally near ones.
  std::vector<std::uint64_t> keys(b.size()), nearest_to_b(b.size(), std::numeric_limits<std::uint64_t>::max());
  for (std::size_t i = 0; i < a.size(); ++i) {
    const std::uint64_t best = columns.keys_of(a[i], i, keys, nearest_to_b);
    const auto distance = static_cast<int>(best >> 32);
    if (distance > options.max_distance) continue;
    // The least key above the best one: the best itself wraps round to the largest number there is.
    std::uint64_t excess = std::numeric_limits<std::uint64_t>::max();
    for (std::size_t j = 0; j < keys.size(); ++j) excess = std::min(excess, keys[j] - best - 1);
    const bool alone = keys.size() == 1;
    const int second = alone ? kNoDistance : static_cast<int>((best + 1 + excess) >> 32);
    if (!passes_ratio(distance, second, options.ratio)) continue;
    out.push_back({static_cast<int>(i), static_cast<int>(best & 0xffffffffu), distance});
  }
  std::erase_if(out, [&](const Match& m) {
    return (nearest_to_b[static_cast<std::size_t>(m.feature)] & 0xffffffffu) != static_cast<std::uint64_t>(m.query);
  });
}

}  // namespace semvslam
