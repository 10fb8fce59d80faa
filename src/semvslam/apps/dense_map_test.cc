#include "semvslam/apps/dense_map.h"

#include <gmock/gmock.h>

#include "semvslam/apps/render_scene.h"

namespace semvslam {
namespace {

using testing::HasSubstr;
namespace fs = std::filesystem;

/// A short rendered recording of an empty room, with its true poses.
class DenseMapTest : public testing::Test {
 protected:
  void SetUp() override {
    fs::remove_all(folder_);
    fs::create_directories(folder_);
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
  void TearDown() override { fs::remove_all(folder_); }

  Result<DenseMapSummary> make(const fs::path& file, const Trajectory& poses) const {
    return make_dense_map(folder_ / "room", {}, poses, {}, {}, file);
  }

  fs::path folder_ = fs::path(testing::TempDir()) / "semvslam_dense_map";
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

}  // namespace
}  // namespace semvslam
