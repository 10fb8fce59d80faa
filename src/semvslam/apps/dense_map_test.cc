#include "semvslam/apps/dense_map.h"

#include <gmock/gmock.h>

#include <algorithm>
#include <cmath>

#include "semvslam/apps/render_scene.h"
#include "semvslam/base/temporary_folder_test_support.h"

namespace semvslam {
namespace {

using testing::HasSubstr;
namespace fs = std::filesystem;

/// A short rendered recording of an empty room, with its true poses.
class DenseMapTest : public testing::Test {
 protected:
  void SetUp() override {
    SceneOptions scene;
    scene.people = "none";
    scene.motion = "xyz";
    scene.frames = 4;
    scene.width_px = 160, scene.height_px = 120;
    ASSERT_TRUE(render_to_folder(scene, folder_ / "room", false, true));
    Result<Trajectory> truth = read_ground_truth(folder_ / "room");
    ASSERT_TRUE(truth) << truth.error().message;
    poses_ = *truth;
  }

  Result<DenseMapSummary> make(const fs::path& file, const Trajectory& poses) const {
    return make_dense_map(folder_ / "room", {}, poses, {}, {}, file);
  }

  const testing_support::TemporaryFolder folder_;
  Trajectory poses_;
};

TEST_F(DenseMapTest, KeyFramesBecomeACloud) {
  const Result<DenseMapSummary> made = make(folder_ / "map.ply", {poses_[0], poses_[2]});
  ASSERT_TRUE(made) << made.error().message;
  EXPECT_EQ(made->key_frames, 2u);
  EXPECT_EQ(made->absent, 0u);
  EXPECT_GT(made->points, 5000u);
  EXPECT_GT(fs::file_size(folder_ / "map.ply"), 15 * made->points);
  EXPECT_THAT(format_summary(*made), HasSubstr("of 2 key frames"));
}

TEST_F(DenseMapTest, AKeyFrameThatCannotBeReadAgainIsCountedAsAbsent) {
  StampedPose between = poses_[1];
  between.stamp.ns += 1'000'000;
  const Result<DenseMapSummary> made = make(folder_ / "map.pcd", {poses_[0], between, poses_[3]});
  ASSERT_TRUE(made) << made.error().message;
  EXPECT_EQ(made->key_frames, 2u);
  EXPECT_EQ(made->absent, 1u);
  EXPECT_THAT(format_summary(*made), HasSubstr("1 key frames could not be read"));
}

TEST_F(DenseMapTest, AFolderThatIsNoneAndADiskThatRefusesAreErrors) {
  EXPECT_FALSE(make_dense_map(folder_ / "absent", {}, poses_, {}, {}, folder_ / "map.ply"));
  EXPECT_FALSE(make(folder_ / "absent" / "map.ply", {poses_[0]}));
}

/// The same room without people and with them, exact pictures and poses.
class RoomWithPeople : public testing::Test {
 protected:
  void SetUp() override {
    empty_ = render("none");
    people_ = render("walking");
  }

  std::vector<RenderedFrame> render(const std::string& people) {
    SceneOptions options;
    options.people = people;
    options.frames = 10;
    options.frame_rate_hz = 2;
    options.width_px = 240, options.height_px = 180;
    options.noise = false;
    Result<RenderedScene> scene = RenderedScene::create(options);
    if (!scene) throw std::runtime_error(scene.error().message);
    camera_ = scene->camera();
    std::vector<RenderedFrame> frames;
    for (std::size_t k = 0; k < static_cast<std::size_t>(options.frames); ++k) frames.push_back(scene->render(k));
    return frames;
  }

  /// Share of the points that stand where the empty room's pictures look through.
  double ghosts(const std::vector<CloudPoint>& points) const {
    std::size_t count = 0;
    for (const CloudPoint& point : points)
      count += std::any_of(empty_.begin(), empty_.end(), [&](const RenderedFrame& view) {
        const Eigen::Vector3d p = view.world_from_camera.inverse() * point.position_m.cast<double>();
        if (p.z() < .3) return false;
        const Eigen::Vector2d pixel = camera_.distort(camera_.project(p));
        const cv::Rect around(static_cast<int>(std::lround(pixel.x())) - 1,
                              static_cast<int>(std::lround(pixel.y())) - 1, 3, 3);
        if ((around & cv::Rect(0, 0, camera_.width_px, camera_.height_px)) != around) return false;
        double nearest = 0;
        cv::minMaxLoc(view.frame.depth(around), &nearest);
        return nearest > p.z() + .1;
      });
    return static_cast<double>(count) / static_cast<double>(points.size());
  }

  Camera camera_;
  std::vector<RenderedFrame> empty_, people_;
};

TEST_F(RoomWithPeople, MasksKeepThemOutAndFreeSpaceClearsWhatMasksMissed) {
  DenseOptions trusting;
  trusting.seen_through = 1000;  // free space clears nothing
  VoxelMap neither(camera_, trusting), masked(camera_, trusting), cleared(camera_, {});
  for (const RenderedFrame& view : people_) {
    ASSERT_TRUE(neither.integrate(view.frame, {}, view.world_from_camera));
    ASSERT_TRUE(masked.integrate(view.frame, view.instances, view.world_from_camera));
    ASSERT_TRUE(cleared.integrate(view.frame, {}, view.world_from_camera));
  }
  const double with_people = ghosts(neither.points());
  EXPECT_GT(with_people, .02);
  EXPECT_LT(ghosts(masked.points()), .02 * with_people);
  // In half of the pictures somebody stands near the camera; what he hides is seen by few others.
  EXPECT_LT(ghosts(cleared.points()), .6 * with_people);
  VoxelMap room(camera_, {});
  for (const RenderedFrame& view : empty_) ASSERT_TRUE(room.integrate(view.frame, {}, view.world_from_camera));
  EXPECT_LT(ghosts(room.points()), 1e-3);
}

}  // namespace
}  // namespace semvslam
