#include "semvslam/mapping/relocalise.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "semvslam/mapping/round_room_test_support.h"

namespace semvslam {
namespace {

/// Key frames look at all parts of a round room.
class RelocaliseTest : public testing::Test {
 protected:
  RelocaliseTest() {
    for (int turn = 0; turn < 12; ++turn) add_key_frame(turn);
  }

  static SE3 pose(double twelfths, const Eigen::Vector3d& centre = Eigen::Vector3d::Zero()) {
    return testing_support::RoundRoom::turned(twelfths / 12, centre);
  }

  std::shared_ptr<FrameFeatures> look(const SE3& camera_from_world, int flipped_bits) {
    return room.look(camera_from_world, seen, flipped_bits);
  }

  void add_key_frame(int turn) {
    const auto f = look(pose(turn), 0);
    const KeyFrameId id = map.add_key_frame(FrameId(static_cast<std::uint32_t>(turn)), TimeStamp{turn}, pose(turn), f);
    for (std::uint32_t n = 0; n < seen.size(); ++n) {
      LandmarkId& landmark = landmarks[seen[n]];
      if (landmark.valid())
        map.add_observation(landmark, id, n);
      else
        landmark = map.add_landmark(room.corners[seen[n]], id, n);
    }
    for (const LandmarkId l : map.landmark_ids()) map.refresh_landmark(l);
    places.add(id, f->orb.descriptors);
  }

  std::optional<Relocalisation> find(const FrameFeatures& features, const SearchScope& scope = {}) const {
    return relocalise(map, places, features, {}, scope);
  }

  testing_support::RoundRoom room;
  Map map{room.model};
  PlaceIndex places;
  std::vector<LandmarkId> landmarks = std::vector<LandmarkId>(room.corners.size());
  std::vector<std::size_t> seen;  // the corners of the last look
};

TEST_F(RelocaliseTest, AFrameIsFoundWhereverItLooks) {
  for (const double twelfths : {0.4, 3.3, 7.5, 11.}) {
    const SE3 truth = pose(twelfths, {0.2, -0.05, 0.1});
    const std::optional<Relocalisation> found = find(*look(truth, 15));
    ASSERT_TRUE(found) << twelfths;
    EXPECT_LT((found->camera_from_world * truth.inverse()).log().norm(), 0.01);
    const double to_key_frame = std::abs(twelfths - found->key_frame.value);
    EXPECT_LT(std::min(to_key_frame, 12 - to_key_frame), 1.1);
    int right = 0;
    for (std::size_t i = 0; i < seen.size(); ++i) {
      if (!found->landmarks[i].valid()) continue;
      EXPECT_EQ(found->landmarks[i], landmarks[seen[i]]);
      ++right;
    }
    EXPECT_EQ(right, found->inliers);
    EXPECT_GE(right, 30);
  }
}

TEST_F(RelocaliseTest, AnotherRoomIsNotFound) {
  for (Descriptor& d : room.descriptors) d = {room.noise(), room.noise(), room.noise(), room.noise()};
  EXPECT_FALSE(find(*look(pose(2.2), 0)));
}

TEST_F(RelocaliseTest, TheRightDescriptorsInTheWrongPlacesAreNoPose) {
  const auto f = look(pose(2.2), 5);
  std::shuffle(f->orb.descriptors.begin(), f->orb.descriptors.end(), room.noise);
  EXPECT_FALSE(find(*f));
}

TEST_F(RelocaliseTest, AThingOfTheRoomAloneIsNotThePlace) {
  const auto f = look(pose(7), 5);
  for (std::size_t i = 0; i < f->size(); ++i)
    if (std::hypot(f->x_px[i] - 200, f->y_px[i] - 200) > 85)
      f->orb.descriptors[i] = {room.noise(), room.noise(), room.noise(), room.noise()};
  const RelocaliseOptions strict = {.min_inliers = 15};
  EXPECT_FALSE(relocalise(map, places, *f, strict));
  EXPECT_TRUE(relocalise(map, places, *f, {.min_inliers = 15, .min_seen_share = 0})) << "or it proves nothing";
}

TEST_F(RelocaliseTest, TheScopeLeavesOutKeyFramesAndWhatTheySee) {
  const auto f = look(pose(7), 5);
  ASSERT_TRUE(find(*f));
  EXPECT_EQ(find(*f)->key_frame, KeyFrameId(7));
  EXPECT_FALSE(find(*f, {.apart_from = {KeyFrameId(7)}})) << "its neighbours share landmarks with it";
  EXPECT_TRUE(find(*f, {.apart_from = {KeyFrameId(1)}}));
  EXPECT_FALSE(find(*f, {.before = KeyFrameId(5)}));
  const std::optional<Relocalisation> earlier = find(*look(pose(4), 5), {.before = KeyFrameId(5)});
  ASSERT_TRUE(earlier);
  for (const LandmarkId l : earlier->landmarks)
    EXPECT_TRUE(!l.valid() || map.landmark(l)->observations.back().key_frame < KeyFrameId(5));
}

TEST_F(RelocaliseTest, TheScopeMayBeOneSubMapOrLeaveOneOut) {
  const auto f = look(pose(7), 5);
  EXPECT_TRUE(find(*f, {.within = SubMapId(0)}));
  EXPECT_FALSE(find(*f, {.within = SubMapId(1)}));
  EXPECT_TRUE(find(*f, {.without = SubMapId(1)}));
  EXPECT_FALSE(find(*f, {.without = SubMapId(0)}));
}

TEST_F(RelocaliseTest, AFewFeaturesAreNotEnough) {
  const auto f = look(pose(2.2), 0);
  std::vector<std::uint8_t> keep(f->size(), 0);
  std::fill_n(keep.begin(), 25, std::uint8_t{1});
  keep_features(keep, room.model->camera(), *f);
  EXPECT_FALSE(find(*f));
  EXPECT_FALSE(find(FrameFeatures{}));
}

}  // namespace
}  // namespace semvslam
