#include "semvslam/web/scene.h"

#include <gmock/gmock.h>

#include <nlohmann/json.hpp>

#include "semvslam/web/packing.h"
#include "semvslam/web/run_folder_test_support.h"

namespace semvslam {
namespace {

using testing::ElementsAre;
using testing::HasSubstr;
using testing::IsEmpty;
using testing::Not;
using testing_support::quarter_circle;

ViewedRun run_of(Trajectory trajectory) {
  ViewedRun run;
  run.name = "a";
  run.trajectory = std::move(trajectory);
  return run;
}

nlohmann::json json_of(Scene scene) { return nlohmann::json::parse(format_scene(scene)); }

TEST(UpOf, IsSquareToLevelCamerasThatLookDown) {
  Trajectory poses = quarter_circle(20);
  const SE3 tilt(Eigen::Quaterniond(Eigen::AngleAxisd(-0.6, Eigen::Vector3d::UnitX())), Eigen::Vector3d::Zero());
  for (StampedPose& p : poses) p.world_from_camera = p.world_from_camera * tilt;
  EXPECT_TRUE(up_of({run_of(poses)}).isApprox(-Eigen::Vector3d::UnitY(), 0.02));
}

TEST(UpOf, IsThatOfThePictureWhereTheCameraDidNotTurn) {
  const SE3 rolled(Eigen::Quaterniond(Eigen::AngleAxisd(M_PI, Eigen::Vector3d::UnitZ())), Eigen::Vector3d::Zero());
  EXPECT_TRUE(up_of({run_of({{{0}, rolled}, {{1}, rolled}})}).isApprox(Eigen::Vector3d::UnitY(), 1e-9));
  EXPECT_EQ(up_of({run_of({})}), Eigen::Vector3d(0, -1, 0));
}

TEST(Evenly, KeepsTheLastAndAtMostSoMany) {
  EXPECT_THAT(evenly(3, 5), ElementsAre(0, 1, 2));
  EXPECT_THAT(evenly(10, 4), ElementsAre(1, 4, 6, 9));
  EXPECT_THAT(evenly(0, 4), IsEmpty());
}

TEST(FormatScene, HoldsTimesFromTheStartAndPoses) {
  const nlohmann::json json = json_of({{run_of({{{5'000'000'000}, SE3()}, {{5'500'000'000}, SE3()}})}, false, {}});
  const nlohmann::json& track = json["runs"][0]["trajectory"];
  EXPECT_EQ(track["times"], packed(std::vector<float>{0, 0.5f}));
  EXPECT_EQ(track["poses"], packed(std::vector<float>{0, 0, 0, 0, 0, 0, 1, 0, 0, 0, 0, 0, 0, 1}));
  EXPECT_FALSE(json.contains("live"));
}

TEST(FormatScene, RunsOfOneRecordingShareAClockAndOthersDoNot) {
  const auto second_start = [](std::int64_t start_ns) {
    return json_of({{run_of(quarter_circle(20)), run_of(quarter_circle(1, start_ns))},
                    false,
                    {}})["runs"][1]["trajectory"]["times"];
  };
  EXPECT_EQ(second_start(2'000'000'000), packed(std::vector<float>{1}));
  EXPECT_EQ(second_start(9'000'000'000), packed(std::vector<float>{0}));
}

TEST(FormatScene, ThinsLongWays) {
  const Scene scene{{run_of(quarter_circle(3 * static_cast<int>(kMostShownPoses)))}, false, {}};
  EXPECT_EQ(json_of(scene)["runs"][0]["trajectory"]["times"].get<std::string>().size(),
            (4 * kMostShownPoses + 2) / 3 * 4);
}

TEST(FormatScene, CannotEndItsScriptElement) {
  Scene scene{{run_of({})}, false, {}};
  scene.runs[0].name = "</script><script>alert(1)\xff";
  const std::string text = format_scene(scene);
  EXPECT_THAT(text, Not(HasSubstr("<")));
  EXPECT_THAT(nlohmann::json::parse(text)["runs"][0]["name"].get<std::string>(), HasSubstr("</script>"));
}

TEST(FormatScene, SaysHowFarALiveRunIs) {
  const nlohmann::json json = json_of({{run_of({})}, false, LiveCursor{3, 17}});
  EXPECT_EQ(json["live"]["generation"], 3);
  EXPECT_EQ(json["live"]["poses"], 17);
}

TEST(FormatLivePose, IsEightNumbers) {
  const StampedPose pose{{3'250'000'000}, SE3(Eigen::Quaterniond::Identity(), {1, -2, 0.5})};
  EXPECT_EQ(nlohmann::json::parse(format_live_pose(pose, {3'000'000'000})),
            nlohmann::json({0.25, 1, -2, 0.5, 0, 0, 0, 1}));
}

}  // namespace
}  // namespace semvslam
