#include "semvslam/apps/dense_map.h"

#include <fmt/core.h>
#include <gmock/gmock.h>

#include <algorithm>
#include <cmath>
#include <set>

#include "semvslam/apps/render_scene.h"
#include "semvslam/base/temporary_folder_test_support.h"
#include "semvslam/data/file_io.h"

namespace semvslam {
namespace {

using testing::HasSubstr;
using testing::Not;
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

  Result<DenseMapSummary> make(const std::vector<fs::path>& files, const Trajectory& poses) const {
    return make_dense_map(folder_ / "room", {}, poses, {}, {}, files);
  }

  const testing_support::TemporaryFolder folder_;
  Trajectory poses_;
};

TEST_F(DenseMapTest, KeyFramesBecomeACloud) {
  const Result<DenseMapSummary> made = make({folder_ / "map.ply"}, {poses_[0], poses_[2]});
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
  const Result<DenseMapSummary> made = make({folder_ / "map.pcd"}, {poses_[0], between, poses_[3]});
  ASSERT_TRUE(made) << made.error().message;
  EXPECT_EQ(made->key_frames, 2u);
  EXPECT_EQ(made->absent, 1u);
  EXPECT_THAT(format_summary(*made), HasSubstr("1 key frames could not be read"));
}

TEST_F(DenseMapTest, AFolderThatIsNoneAndADiskThatRefusesAreErrors) {
  EXPECT_FALSE(make_dense_map(folder_ / "absent", {}, poses_, {}, {}, {folder_ / "map.ply"}));
  EXPECT_FALSE(make({folder_ / "absent" / "map.ply", folder_ / "map.bt"}, {poses_[0]}));
  EXPECT_TRUE(fs::exists(folder_ / "map.bt")) << "one file does not keep the next from being written";
}

TEST_F(DenseMapTest, PointsAndOctreesAreMadeAtOnceAndTwiceTheSame) {
  const std::vector<fs::path> files{folder_ / "a.ply", folder_ / "a.bt", folder_ / "a.ot", folder_ / "b.bt"};
  const Result<DenseMapSummary> made = make(files, {poses_[0], poses_[2]});
  ASSERT_TRUE(made) << made.error().message;
  EXPECT_GT(made->occupied, 500u);
  EXPECT_GT(made->free, 5 * made->occupied);
  EXPECT_THAT(format_summary(*made), HasSubstr(fmt::format("{} cubes occupied, {} free", made->occupied, made->free)));
  ASSERT_TRUE(make({folder_ / "again.ot"}, {poses_[0], poses_[2]}));
  const auto content = [&](const char* name) { return read_text_file(folder_ / name).value(); };
  EXPECT_EQ(content("a.bt"), content("b.bt"));
  EXPECT_EQ(content("a.ot"), content("again.ot"));
  EXPECT_THAT(format_summary(*make({folder_ / "map.ply"}, {poses_[0]})), Not(HasSubstr("octree")));
}

TEST_F(DenseMapTest, OfNoKeyFrameComeEmptyFiles) {
  const Result<DenseMapSummary> made = make({folder_ / "a.ply", folder_ / "a.bt", folder_ / "a.ot"}, {});
  ASSERT_TRUE(made) << made.error().message;
  EXPECT_EQ(made->points + made->occupied + made->free, 0u);
  for (const char* name : {"a.ply", "a.bt", "a.ot"}) EXPECT_GT(fs::file_size(folder_ / name), 0u);
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

  /// The octree's cubes in which the pictures show a surface, of a person or of the room.
  std::set<OctreeCode> surface_cubes(const std::vector<RenderedFrame>& views, bool of_people) const {
    std::set<OctreeCode> cubes;
    for (const RenderedFrame& view : views)
      for (int y = 0; y < camera_.height_px; ++y)
        for (int x = 0; x < camera_.width_px; ++x) {
          if ((view.instances.at<std::uint8_t>(y, x) != 0) != of_people) continue;
          const Eigen::Vector3d p = view.world_from_camera *
                                    camera_.back_project(camera_.undistort({x, y}), view.frame.depth.at<float>(y, x));
          cubes.insert(octree_code((p.array() / DenseOptions().octree_m).floor().cast<int>().matrix()).value());
        }
    return cubes;
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

TEST_F(RoomWithPeople, LabelsAgreeWithTheTruth) {
  VoxelMap map(camera_, {});
  for (const RenderedFrame& view : people_)
    ASSERT_TRUE(map.integrate(view.frame, {}, view.world_from_camera, view.instances > 0));
  std::size_t people = 0, room = 0, wrong = 0;
  for (const CloudPoint& point : map.points())
    for (const RenderedFrame& view : people_) {
      const Eigen::Vector3d p = view.world_from_camera.inverse() * point.position_m.cast<double>();
      if (p.z() < .3) continue;
      const Eigen::Vector2d pixel = camera_.distort(camera_.project(p));
      const cv::Point at(static_cast<int>(std::lround(pixel.x())), static_cast<int>(std::lround(pixel.y())));
      if (!cv::Rect(0, 0, camera_.width_px, camera_.height_px).contains(at)) continue;
      if (std::abs(view.frame.depth.at<float>(at) - p.z()) > .01) continue;  // hidden, or it has gone
      const bool is_person = view.instances.at<std::uint8_t>(at) != 0;
      ++(is_person ? people : room);
      wrong += is_person != (point.label != 0);
    }
  EXPECT_GT(people, 1000u);
  EXPECT_GT(room, 10000u);
  EXPECT_LE(wrong, (people + room) / 1000);
}

/// Cubes of a map, as codes.
std::set<OctreeCode> codes(const std::vector<OctreeLeaf>& leaves, bool occupied) {
  std::set<OctreeCode> out;
  for (const OctreeLeaf& leaf : leaves)
    if (leaf.occupied == occupied) out.insert(leaf.code);
  return out;
}

std::size_t count_common(const std::set<OctreeCode>& a, const std::set<OctreeCode>& b) {
  return static_cast<std::size_t>(std::ranges::count_if(a, [&](OctreeCode code) { return b.contains(code); }));
}

TEST_F(RoomWithPeople, TheOctreeKnowsTheRoomAndNotThePeople) {
  VoxelMap map(camera_, {}), room(camera_, {});
  for (const RenderedFrame& view : people_)
    ASSERT_TRUE(map.integrate(view.frame, view.instances, view.world_from_camera));
  for (const RenderedFrame& view : empty_) ASSERT_TRUE(room.integrate(view.frame, {}, view.world_from_camera));
  const std::vector<OctreeLeaf> leaves = map.octree(map.points());
  const std::set<OctreeCode> occupied = codes(leaves, true), free = codes(leaves, false);
  const std::set<OctreeCode> walls = surface_cubes(empty_, false), people = surface_cubes(people_, true);
  const std::set<OctreeCode> free_without_people = codes(room.octree(room.points()), false);
  EXPECT_GT(occupied.size(), 5000u);
  EXPECT_GT(free.size(), 100000u);
  // Of surfaces in the plane between two cubes, as the floor is, rounding decides.
  EXPECT_GE(count_common(occupied, walls), occupied.size() * 99 / 100) << "what is occupied lies on a surface";
  EXPECT_LE(count_common(free, walls), free.size() / 1000) << "what is free is empty";
  // Where people were seen, and without them nothing stands: free, but for what only the hidden part of a view shows.
  EXPECT_LE(count_common(people, occupied), people.size() / 200);
  EXPECT_GE(count_common(people, free), count_common(people, free_without_people) * 8 / 10);
}

}  // namespace
}  // namespace semvslam
