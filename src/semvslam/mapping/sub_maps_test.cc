#include "semvslam/mapping/sub_maps.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <optional>

#include "semvslam/mapping/mapper.h"
#include "semvslam/mapping/round_room_test_support.h"

namespace semvslam {
namespace {

using testing_support::RoundRoom;

constexpr SubMapId kFirst{0}, kSecond{1};
constexpr double kStep = 1. / 60;  // turns between key frames

/// A camera turns in the middle of a round room, in two sub-maps: the world of each is its first camera.
class SubMapsTest : public testing::Test {
 protected:
  /// Where the camera is that looks so many turns aside, in the sub-map's world.
  SE3 pose(double turns, SubMapId sub_map) const { return RoundRoom::turned(turns - begin.at(sub_map)); }

  /// A key frame at the camera's place. @param shown where the image is from, if from elsewhere.
  std::shared_ptr<const LocalMap> enter(double turns, SubMapId sub_map, std::optional<double> shown = {}) {
    begin.try_emplace(sub_map, turns);
    std::vector<std::size_t> corners;
    const auto features = room.look(RoundRoom::turned(shown.value_or(turns)), corners);
    std::vector<LandmarkId>& known = known_in[sub_map];
    known.resize(room.corners.size());
    NewKeyFrame key_frame{FrameId(frames++), TimeStamp{}, pose(turns, sub_map), features, {}, sub_map};
    for (const std::size_t c : corners) key_frame.landmarks.push_back(shown ? LandmarkId() : known[c]);
    const auto local = mapper.step(key_frame);
    const KeyFrame& newest = mapper.map().key_frames().rbegin()->second;
    if (!shown)
      for (std::size_t i = 0; i < corners.size(); ++i) known[corners[i]] = newest.landmarks[i];
    const Status status = mapper.map().check_invariants();
    EXPECT_TRUE(status.ok()) << status.error().message;
    turns_of[newest.id] = turns;
    return local;
  }
  /// From here to there. @return the last snapshot.
  std::shared_ptr<const LocalMap> turn(double from, double to, SubMapId sub_map) {
    const int steps = static_cast<int>(std::lround(std::abs(to - from) / kStep));
    std::shared_ptr<const LocalMap> local;
    for (int i = 0; i <= steps && mapper.joins() == 0; ++i) local = enter(from + (to > from ? i : -i) * kStep, sub_map);
    return local;
  }
  /// Of all key frames there are, in the world of the first sub-map.
  double worst_error() const {
    double worst = 0;
    for (const auto& [id, key_frame] : mapper.map().key_frames())
      worst = std::max(worst,
                       (key_frame.camera_from_world * pose(turns_of.at(id), key_frame.sub_map).inverse()).log().norm());
    return worst;
  }

  RoundRoom room;
  Mapper mapper{MappingOptions{}, room.model};
  std::map<SubMapId, double> begin;  // turns of its first camera
  std::map<SubMapId, std::vector<LandmarkId>> known_in;
  std::map<KeyFrameId, double> turns_of;
  std::uint32_t frames = 0;
};

TEST_F(SubMapsTest, ASecondBeginsAndStaysApart) {
  (void)turn(0, 0.2, kFirst);
  const std::vector<LandmarkId> before = mapper.map().landmark_ids();
  const std::vector<KeyFrameId> key_frames = mapper.map().key_frames_of(kFirst);
  // Its camera is, in its own world, where the first one's was: only the worlds keep them apart.
  const auto local = turn(0.5, 0.55, kSecond);
  const Map& map = mapper.map();
  EXPECT_EQ(map.sub_maps().size(), 2u);
  EXPECT_EQ(mapper.joins(), 0);
  EXPECT_EQ(local->sub_map, kSecond);
  EXPECT_EQ(local->key_frames.size(), 4u);
  for (const LocalMap::KeyFramePose& k : local->key_frames) EXPECT_EQ(map.sub_map_of(k.id), kSecond);
  for (const LocalMap::Point& p : local->points) EXPECT_EQ(map.sub_map_of(*map.landmark(p.id)), kSecond);
  EXPECT_EQ(map.key_frames_of(kFirst), key_frames);
  EXPECT_EQ(map.landmark_ids(kFirst), before) << "the young ones too: nobody looks for them any more";
  EXPECT_EQ(map.landmark_ids().size(), before.size() + map.landmark_ids(kSecond).size());
  EXPECT_LT(worst_error(), 1e-3);
}

TEST_F(SubMapsTest, TheYoungerBecomesAPartOfTheOlderWhenItsPlaceIsRecognised) {
  (void)turn(0, 0.2, kFirst);
  const auto local = turn(0.5, 0.2, kSecond);
  ASSERT_EQ(mapper.joins(), 1);
  ASSERT_TRUE(mapper.joined());
  EXPECT_EQ(mapper.joined()->from, kSecond);
  EXPECT_EQ(mapper.joined()->into, kFirst);
  const Map& map = mapper.map();
  EXPECT_EQ(map.sub_maps().size(), 1u);
  EXPECT_EQ(map.next_sub_map(), SubMapId(2)) << "its number is not given out again";
  EXPECT_EQ(local->sub_map, kFirst);
  EXPECT_NE(local->find(turns_of.rbegin()->first), nullptr);
  EXPECT_NE(local->find(std::prev(turns_of.end(), 2)->first), nullptr) << "tracking comes from there";
  EXPECT_LT(worst_error(), 2e-3);
  // What both have seen is one landmark now.
  std::size_t both = 0, fused = 0;
  for (std::size_t c = 0; c < room.corners.size(); ++c) {
    const LandmarkId a = map.resolve(known_in[kFirst][c]), b = map.resolve(known_in[kSecond][c]);
    if (!a.valid() || !b.valid()) continue;
    ++both;
    fused += a == b;
  }
  EXPECT_GT(both, 80u);
  EXPECT_GT(static_cast<double>(fused), 0.9 * static_cast<double>(both));
  mapper.adjust_all();
  EXPECT_LT(worst_error(), 1e-3);
}

TEST_F(SubMapsTest, SoItDoesWhenTheOlderComesToItsPlace) {
  (void)turn(0, 0.2, kFirst);
  (void)turn(0.45, 0.5, kSecond);
  const auto local = turn(0.2, 0.5, kFirst);
  ASSERT_EQ(mapper.joins(), 1);
  EXPECT_EQ(mapper.joined()->from, kSecond);
  EXPECT_EQ(local->sub_map, kFirst);
  EXPECT_EQ(mapper.map().sub_maps().size(), 1u);
  EXPECT_LT(worst_error(), 2e-3);
}

TEST_F(SubMapsTest, WhatIsLeftForAnotherStaysAsItIs) {
  (void)turn(0, 0.2, kFirst);
  (void)turn(0.5, 0.53, kSecond);
  const std::vector<LandmarkId> before = mapper.map().landmark_ids(kSecond);
  for (int i = 0; i < 5; ++i) (void)enter(0.2 - i * kStep, kFirst);
  EXPECT_EQ(mapper.map().landmark_ids(kSecond), before);
}

TEST_F(SubMapsTest, OneKeyFrameThatLooksLikeAnotherPlaceJoinsNothing) {
  (void)turn(0, 0.2, kFirst);
  (void)turn(0.5, 0.53, kSecond);
  (void)enter(0.54, kSecond, 0.1);
  PlaceIndex places;
  for (const auto& [id, key_frame] : mapper.map().key_frames()) places.add(id, key_frame.features->orb.descriptors);
  EXPECT_EQ(JoinFinder({.agreeing_key_frames = 1}, {}, {}).find(mapper.map(), places, KeyFrameId(frames - 1)).size(),
            1u)
      << "or it proves nothing";
  (void)turn(0.55, 0.6, kSecond);
  EXPECT_EQ(mapper.joins(), 0);
  EXPECT_EQ(mapper.map().sub_maps().size(), 2u);
}

TEST_F(SubMapsTest, APictureThatIsCarriedAlongJoinsNothing) {
  (void)turn(0, 0.2, kFirst);
  for (int i = 0; i < 6; ++i) (void)enter(0.5 + i * kStep, kSecond, 0.1);
  EXPECT_EQ(mapper.joins(), 0) << "each finds it, but from another place every time";
  EXPECT_EQ(mapper.map().sub_maps().size(), 2u);
}

TEST_F(SubMapsTest, EachIsAdjustedInItsOwnWorld) {
  (void)turn(0, 0.1, kFirst);
  (void)turn(0.5, 0.6, kSecond);
  const SE3 first = mapper.map().key_frame(mapper.map().sub_maps().at(kSecond))->camera_from_world;
  mapper.adjust_all();
  EXPECT_EQ(first.translation(),
            mapper.map().key_frame(mapper.map().sub_maps().at(kSecond))->camera_from_world.translation());
  EXPECT_LT(worst_error(), 1e-3);
  EXPECT_EQ(mapper.map().sub_maps().size(), 2u);
}

}  // namespace
}  // namespace semvslam
