#include "semvslam/feature/matching.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <bit>
#include <cmath>
#include <limits>
#include <numbers>
#include <random>

namespace semvslam {
namespace {

using ::testing::ElementsAre;
using ::testing::IsEmpty;

/// `base` with the given bits flipped.
Descriptor flipped(Descriptor base, int first, int count) {
  for (int bit = first; bit < first + count; ++bit)
    base[static_cast<std::size_t>(bit / 64)] ^= std::uint64_t{1} << (bit % 64);
  return base;
}

Descriptor random_descriptor(std::mt19937_64& random) { return {random(), random(), random(), random()}; }

/// Features placed one by one, and the grid over them.
struct Scene {
  OrbFeatures features;
  int add(float x, float y, const Descriptor& descriptor, int level = 0, float angle_rad = 0) {
    features.keypoints.push_back({x, y, 0, angle_rad, static_cast<std::uint8_t>(level)});
    features.descriptors.push_back(descriptor);
    return static_cast<int>(features.size()) - 1;
  }
  std::vector<Match> match(const std::vector<ProjectedQuery>& queries, const MatchOptions& options = {}) const {
    std::vector<float> x, y;
    for (const Keypoint& k : features.keypoints) {
      x.push_back(k.x_px);
      y.push_back(k.y_px);
    }
    ImageGrid grid;
    grid.build(x, y, 640, 480);
    std::vector<Match> out{{9, 9, 9}};
    match_projected(queries, features, grid, options, out);
    return out;
  }
};

ProjectedQuery query_at(float x, float y, const Descriptor& descriptor, float radius = 10, float angle_rad = -1) {
  return {x, y, radius, 0, 7, descriptor, angle_rad};
}

TEST(MatchProjected, TakesTheNearestDescriptorInsideRadiusAndLevels) {
  Scene scene;
  scene.add(100, 100, flipped({}, 0, 40));
  const int near = scene.add(105, 95, flipped({}, 0, 20));
  scene.add(120, 100, Descriptor{});     // outside of the square
  scene.add(101, 101, Descriptor{}, 3);  // level outside of the range
  ProjectedQuery query = query_at(100, 100, {});
  query.max_level = 2;
  EXPECT_THAT(scene.match({query}), ElementsAre(Match{0, near, 20}));
}

TEST(MatchProjected, MaximumDistanceIsInclusive) {
  Scene scene;
  scene.add(100, 100, flipped({}, 0, 30));
  EXPECT_THAT(scene.match({query_at(100, 100, {})}, {.max_distance = 30}), ElementsAre(Match{0, 0, 30}));
  EXPECT_THAT(scene.match({query_at(100, 100, {})}, {.max_distance = 29}), IsEmpty());
}

TEST(MatchProjected, RatioTestRefusesAPlaceThatHasARival) {
  Scene scene;
  scene.add(100, 100, flipped({}, 0, 20));
  scene.add(106, 100, flipped({}, 0, 24));
  EXPECT_THAT(scene.match({query_at(100, 100, {})}, {.ratio = 0.8f}), IsEmpty());
  EXPECT_THAT(scene.match({query_at(100, 100, {})}, {.ratio = 0.9f}), ElementsAre(Match{0, 0, 20}));
  EXPECT_THAT(scene.match({query_at(100, 100, {})}, {.ratio = 1.0f}), ElementsAre(Match{0, 0, 20}));
}

TEST(MatchProjected, TheSameCornerOnAnotherLevelIsNoRival) {
  Scene scene;
  scene.add(100, 100, flipped({}, 0, 20), 2);
  scene.add(101, 99, flipped({}, 0, 21), 3);  // twin
  EXPECT_THAT(scene.match({query_at(100, 100, {})}), ElementsAre(Match{0, 0, 20}));
  scene.add(106, 100, flipped({}, 0, 21), 3);  // another place
  EXPECT_THAT(scene.match({query_at(100, 100, {})}), IsEmpty());
}

TEST(MatchProjected, AFeatureGoesToTheNearestQueryOnly) {
  Scene scene;
  scene.add(100, 100, {});
  const std::vector<ProjectedQuery> queries{query_at(100, 100, flipped({}, 0, 9)),
                                            query_at(101, 100, flipped({}, 0, 5)),
                                            query_at(102, 100, flipped({}, 0, 5))};
  EXPECT_THAT(scene.match(queries), ElementsAre(Match{1, 0, 5}));
}

TEST(MatchProjected, EqualDistancesTakeTheLowerIndexInWhicheverCellItLies) {
  Scene scene;
  scene.add(100, 110, flipped({}, 0, 10), 1);
  scene.add(100, 90, flipped({}, 20, 10), 0);
  EXPECT_THAT(scene.match({query_at(100, 100, {}, 15)}, {.ratio = 1}), ElementsAre(Match{0, 0, 10}));
}

TEST(MatchProjected, RotationCheckDropsOddOnesAcrossTheFullTurn) {
  constexpr float kTurn = 2 * std::numbers::pi_v<float>;
  std::mt19937_64 random(5);
  Scene scene;
  std::vector<ProjectedQuery> queries;
  for (int i = 0; i < 30; ++i) {
    const Descriptor descriptor = random_descriptor(random);
    const auto x = static_cast<float>(20 * i + 10);
    const float angle = 0.2f * static_cast<float>(i);
    // Right ones turn by about zero: changes lie on both sides of the seam of the circle.
    float seen = std::fmod(angle + (i % 2 ? 0.1f : -0.1f) + kTurn, kTurn);
    if (i == 7 || i == 20) seen = std::fmod(seen + 1.5f, kTurn);
    scene.add(x, 50, descriptor, 0, seen);
    queries.push_back(query_at(x, 50, descriptor, 5, i == 20 ? -1.f : angle));  // 20: angle unknown
  }
  const std::vector<Match> matches = scene.match(queries, {.check_rotation = true});
  EXPECT_EQ(matches.size(), 29u);
  EXPECT_TRUE(std::none_of(matches.begin(), matches.end(), [](const Match& m) { return m.query == 7; }));
  EXPECT_EQ(scene.match(queries).size(), 30u);
}

TEST(MatchProjected, NothingInNothingOut) {
  Scene scene;
  EXPECT_THAT(scene.match({query_at(1, 1, {})}, {.check_rotation = true}), IsEmpty());
  scene.add(100, 100, {});
  EXPECT_THAT(scene.match({}, {.check_rotation = true}), IsEmpty());
  EXPECT_THAT(scene.match({query_at(std::numeric_limits<float>::quiet_NaN(), 100, {})}), IsEmpty());
  EXPECT_THAT(scene.match({query_at(100, 100, {}, -1)}), IsEmpty());
}

/// The definition, written down without cleverness.
std::vector<Match> mutual_nearest(const std::vector<Descriptor>& a, const std::vector<Descriptor>& b,
                                  const MatchOptions& options) {
  const auto nearest = [](const Descriptor& d, const std::vector<Descriptor>& in) {
    std::size_t best = 0;
    for (std::size_t j = 1; j < in.size(); ++j) {
      if (hamming_distance(d, in[j]) < hamming_distance(d, in[best])) best = j;
    }
    return best;
  };
  std::vector<Match> matches;
  for (std::size_t i = 0; i < a.size() && !b.empty(); ++i) {
    const std::size_t j = nearest(a[i], b);
    const int distance = hamming_distance(a[i], b[j]);
    if (nearest(b[j], a) != i || distance > options.max_distance) continue;
    int second = 1000;
    for (std::size_t k = 0; k < b.size(); ++k) {
      if (k != j) second = std::min(second, hamming_distance(a[i], b[k]));
    }
    if (static_cast<float>(distance) > options.ratio * static_cast<float>(second)) continue;
    matches.push_back({static_cast<int>(i), static_cast<int>(j), distance});
  }
  return matches;
}

TEST(MatchBruteForce, AgreesWithTheDefinitionForEverySize) {
  std::mt19937_64 random(11);
  for (const std::size_t na : {0u, 1u, 2u, 7u, 8u, 9u, 33u, 130u}) {
    for (const std::size_t nb : {0u, 1u, 2u, 7u, 8u, 9u, 33u, 131u}) {
      std::vector<Descriptor> a, b;
      for (std::size_t i = 0; i < na; ++i) a.push_back(random_descriptor(random));
      for (std::size_t j = 0; j < nb; ++j) {
        // Half of them are noisy copies; few bits differ, so that equal distances occur too.
        const bool copy = na > 0 && random() % 2;
        b.push_back(copy ? flipped(a[random() % na], static_cast<int>(random() % 200), static_cast<int>(random() % 30))
                         : random_descriptor(random));
      }
      for (const MatchOptions& options : {MatchOptions{}, MatchOptions{.max_distance = 256, .ratio = 1.f}}) {
        std::vector<Match> out{{5, 5, 5}};
        match_brute_force(a, b, options, out);
        EXPECT_EQ(out, mutual_nearest(a, b, options)) << na << " " << nb;
      }
    }
  }
}

TEST(MatchBruteForce, EqualDescriptorsPairByTheLowestIndex) {
  const std::vector<Descriptor> same(20);
  std::vector<Match> out;
  match_brute_force(same, same, {.max_distance = 0, .ratio = 1.f}, out);
  EXPECT_THAT(out, ElementsAre(Match{0, 0, 0}));
}

}  // namespace
}  // namespace semvslam
