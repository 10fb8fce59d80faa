#include "semvslam/mapping/relocalise.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <numbers>
#include <random>

#include "semvslam/feature/orb_extractor.h"
#include "semvslam/map/vga_testing.h"

namespace semvslam {
namespace {

/// A round room with landmarks all around; key frames look at parts of it.
class RelocaliseTest : public testing::Test {
 protected:
  RelocaliseTest()
      : model(std::make_shared<ObservationModel>(vga(), NoiseModel{}, level_scales(OrbOptions{}))), map(model) {
    std::mt19937_64 random(5);
    std::uniform_real_distribution<double> angle(-std::numbers::pi, std::numbers::pi), y(-1.2, 1.2), radius(2.5, 3.5);
    for (int i = 0; i < 1500; ++i) {
      const double a = angle(random), r = radius(random);
      points.push_back({r * std::sin(a), y(random), r * std::cos(a)});
      descriptors.push_back({random(), random(), random(), random()});
    }
    landmarks.resize(points.size());
    for (int turn = 0; turn < 12; ++turn) add_key_frame(turn);
  }

  /// The camera in the middle, turned by so many twelfths.
  static SE3 pose(double twelfths, const Eigen::Vector3d& centre = Eigen::Vector3d::Zero()) {
    const Eigen::Quaterniond turn(Eigen::AngleAxisd(-2 * std::numbers::pi * twelfths / 12, Eigen::Vector3d::UnitY()));
    return {turn, -(turn * centre)};
  }

  /// What is seen of the room; bits of each descriptor are flipped at random.
  std::shared_ptr<FrameFeatures> look(const SE3& camera_from_world, int flipped_bits,
                                      std::vector<std::size_t>& points_seen) {
    auto f = std::make_shared<FrameFeatures>();
    points_seen.clear();
    for (std::size_t k = 0; k < points.size(); ++k) {
      const Eigen::Vector3d p = camera_from_world * points[k];
      if (p.z() < 0.5) continue;
      const Eigen::Vector2d pixel = model->camera().project(p);
      if (!model->camera().sees(pixel)) continue;
      Descriptor d = descriptors[k];
      for (int b = 0; b < flipped_bits; ++b) d[noise() % 4] ^= std::uint64_t{1} << noise() % 64;
      f->orb.keypoints.push_back({static_cast<float>(pixel.x()), static_cast<float>(pixel.y()), 1, 0, 0});
      f->orb.descriptors.push_back(d);
      f->x_px.push_back(static_cast<float>(pixel.x()));
      f->y_px.push_back(static_cast<float>(pixel.y()));
      f->depth_m.push_back(static_cast<float>(p.z()));
      points_seen.push_back(k);
    }
    f->grid.build(f->x_px, f->y_px, 640, 480);
    return f;
  }

  void add_key_frame(int turn) {
    const auto f = look(pose(turn), 0, seen);
    const KeyFrameId id = map.add_key_frame(FrameId(static_cast<std::uint32_t>(turn)), TimeStamp{turn}, pose(turn), f);
    for (std::uint32_t n = 0; n < seen.size(); ++n) {
      LandmarkId& landmark = landmarks[seen[n]];
      if (landmark.valid())
        map.add_observation(landmark, id, n);
      else
        landmark = map.add_landmark(points[seen[n]], id, n);
    }
    for (const LandmarkId l : map.landmark_ids()) map.refresh_landmark(l);
  }

  std::shared_ptr<const ObservationModel> model;
  Map map;
  std::vector<Eigen::Vector3d> points;
  std::vector<Descriptor> descriptors;
  std::vector<LandmarkId> landmarks;
  std::vector<std::size_t> seen;
  std::mt19937_64 noise{9};
};

TEST_F(RelocaliseTest, AFrameIsFoundWhereverItLooks) {
  for (const double twelfths : {0.4, 3.3, 7.5, 11.}) {
    const SE3 truth = pose(twelfths, {0.2, -0.05, 0.1});
    const std::optional<Relocalisation> found = relocalise(map, *look(truth, 15, seen), {});
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
  for (Descriptor& d : descriptors) d = {noise(), noise(), noise(), noise()};
  EXPECT_FALSE(relocalise(map, *look(pose(2.2), 0, seen), {}));
}

TEST_F(RelocaliseTest, TheRightDescriptorsInTheWrongPlacesAreNoPose) {
  const auto f = look(pose(2.2), 5, seen);
  std::shuffle(f->orb.descriptors.begin(), f->orb.descriptors.end(), noise);
  EXPECT_FALSE(relocalise(map, *f, {}));
}

TEST_F(RelocaliseTest, AFewFeaturesAreNotEnough) {
  const auto f = look(pose(2.2), 0, seen);
  std::vector<std::uint8_t> keep(f->size(), 0);
  std::fill_n(keep.begin(), 25, std::uint8_t{1});
  keep_features(keep, model->camera(), *f);
  EXPECT_FALSE(relocalise(map, *f, {}));
  EXPECT_FALSE(relocalise(map, FrameFeatures{}, {}));
}

}  // namespace
}  // namespace semvslam
