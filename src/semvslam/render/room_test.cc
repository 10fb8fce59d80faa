#include "semvslam/render/room.h"

#include <gtest/gtest.h>

#include <cmath>
#include <set>

#include "semvslam/render/camera_path.h"
#include "semvslam/render/cast.h"
#include "semvslam/render/contact_shadow.h"
#include "semvslam/render/light_bake.h"
#include "semvslam/render/paint.h"

namespace semvslam::render {
namespace {

/// True where anything stands nearer than `reach_m` to a point, seen in 16 horizontal directions.
bool touches(const ShadowTester& things, const Eigen::Vector3d& p, double reach_m) {
  for (int i = 0; i < 16; ++i) {
    const double a = 2 * M_PI * i / 16;
    if (things.blocked(p.cast<float>(),
                       Eigen::Vector3f(static_cast<float>(std::cos(a)), static_cast<float>(std::sin(a)), 0),
                       static_cast<float>(reach_m)))
      return true;
  }
  return false;
}

class FurnishedRoom : public testing::TestWithParam<int> {};

TEST_P(FurnishedRoom, LeavesRoomForWalkersAndCameras) {
  SceneBuilder builder;
  const Room room = build_room(builder, static_cast<std::uint64_t>(GetParam()));
  const ShadowTester things(builder.meshes());
  const PlanPath way = walkers_way();
  for (double s = 0; s < way.length_m(); s += 0.15) {
    const Eigen::Vector2d p = way.position(s);
    for (const double height_m : {0.15, 0.5, 0.9, 1.3, 1.7}) {
      ASSERT_FALSE(touches(things, {p.x(), p.y(), height_m}, 0.24))
          << "walker at " << p.transpose() << ", height " << height_m;
    }
  }
  for (const char* motion : {"xyz", "rpy", "halfsphere", "static", "tour"}) {
    const CameraPath camera(motion, static_cast<std::uint64_t>(GetParam()));
    const double duration_s = motion == std::string("tour") ? 150 : 60;
    for (double t = 0; t < duration_s; t += 0.5) {
      const Eigen::Vector3d p = camera.pose(t).translation();
      ASSERT_FALSE(touches(things, p, 0.2)) << motion << " at " << t << " s";
      ASSERT_GT(p.z(), 1.0);
      ASSERT_LT(p.z(), 1.9);
      double nearest = 9;
      for (double s = 0; s < way.length_m(); s += 0.1)
        nearest = std::min(nearest, (way.position(s) - p.head<2>()).norm());
      ASSERT_GT(nearest, 0.5) << motion << ": the camera is in the walkers' way at " << t << " s";
    }
  }
  for (const Seat& seat : room.seats) {
    // There is something to sit on.
    EXPECT_TRUE(things.blocked({static_cast<float>(seat.position.x()), static_cast<float>(seat.position.y()), 0.9f},
                               {0, 0, -1}, 0.6f));
  }
}
INSTANTIATE_TEST_SUITE_P(Seeds, FurnishedRoom, testing::Values(1, 2, 3, 4));

TEST(PersonLook, DiffersFromSeedToSeedWithinHumanLimits) {
  std::set<int> heights, tones, hair;
  int women = 0;
  for (std::uint64_t seed = 0; seed < 60; ++seed) {
    const PersonLook look = random_look(seed);
    EXPECT_GE(look.height_m, 1.5);
    EXPECT_LE(look.height_m, 1.98);
    EXPECT_TRUE(look.woman || !look.skirt);
    EXPECT_FALSE(look.woman && look.beard);
    heights.insert(static_cast<int>(look.height_m * 1000));
    tones.insert(static_cast<int>(look.top_tone[0]) * 1000 + static_cast<int>(look.top_tone[2]));
    hair.insert(static_cast<int>(look.hair_style));
    women += look.woman;
  }
  EXPECT_GT(heights.size(), 40u);
  EXPECT_GT(tones.size(), 50u);
  EXPECT_GE(hair.size(), 5u);
  EXPECT_GT(women, 12);
  EXPECT_LT(women, 48);
}

/// Where everything stands, in one number that feels the order of things.
double fingerprint(const std::vector<Mesh>& meshes) {
  double sum = 0;
  int place = 0;
  for (const Mesh& mesh : meshes)
    for (const auto& v : mesh.vertices) {
      sum += (1 + place % 97) * (v.x() + 2.0 * v.y() + 3.0 * v.z());
      ++place;
    }
  return sum / std::max(1, place);
}

// The numbers are GCC's; builds with other compilers must come to the same.
TEST(SameSeed, GivesTheSameThingsWithEveryCompiler) {
  SceneBuilder builder;
  build_room(builder, 1);
  EXPECT_NEAR(fingerprint(builder.meshes()), 239.07376, 1e-3);
  const PersonLook look = random_look(6);
  EXPECT_NEAR(cv::norm(look.top_tone, look.top_second), 197.5838, 1e-2);
  EXPECT_NEAR(cv::norm(look.bottom_tone, look.shoes), 179.7164, 1e-2);
  const double posters[] = {129.93, 116.85, 127.05};
  for (int kind = 0; kind < 3; ++kind)
    EXPECT_NEAR(cv::mean(paint_poster({200, 300}, static_cast<std::uint64_t>(kind)))[1], posters[kind], 0.5) << kind;
  EXPECT_NEAR(cv::mean(paint_screen({256, 160}, 3))[0], 101.16, 0.5);
  EXPECT_NEAR(cv::mean(paint_page({256, 362}, 3))[0], 207.64, 0.5);
  EXPECT_NEAR(cv::mean(paint_rug({512, 384}, 3))[2], 97.12, 0.5);
}

TEST(ContactShadow, DarkensUnderABallAndRecovers) {
  SceneBuilder builder;
  const auto grey = builder.add_texture([] { return cv::Mat(4, 4, CV_8UC3, cv::Scalar(128, 128, 128)); });
  builder.begin_mesh();
  builder.quad({-2, -2, 0}, {4, 0, 0}, {0, 4, 0}, Skin{grey, {1, 1}, {0, 0}, false}, 0.1);
  const StaticScene scene = builder.finish(1);
  const LightPatch& patch = scene.patches.at(0);
  ContactShadow shadow(scene.light);
  shadow.update(scene.patches, {{{0, 0, 0.15}, 0.15}});
  const float under = shadow.current().at(patch.column + patch.columns / 2, patch.row + patch.rows / 2)[1];
  const float far = shadow.current().at(patch.column, patch.row)[1];
  EXPECT_LT(under, 0.75f);
  EXPECT_EQ(far, 1.f);
  shadow.update(scene.patches, {{{0, 0, -0.15}, 0.15}});  // below the floor: behind its face
  for (const Colour4& texel : shadow.current().texels) EXPECT_EQ(texel[1], 1.f);
}

TEST(LightModel, LampsLightWhatFacesThemAndThingsThrowShadows) {
  AreaLight lamp{{0, 0, 2.5}, {0.5, 0, 0}, {0, 0.2, 0}, {0, 0, -1}, {10, 10, 10}};
  const LightModel model({lamp});
  const float up = model.at({0, 0, 0}, {0, 0, 1}, nullptr)[1], side = model.at({0, 0, 0}, {1, 0, 0}, nullptr)[1],
              down = model.at({0, 0, 0}, {0, 0, -1}, nullptr)[1];
  EXPECT_GT(up, side);
  EXPECT_GT(side, down);
  SceneBuilder builder;
  const auto grey = builder.add_texture([] { return cv::Mat(4, 4, CV_8UC3, cv::Scalar(128, 128, 128)); });
  builder.begin_mesh();
  builder.box(SE3(Eigen::Quaterniond::Identity(), {0, 0, 1}), {2, 2, 0.1}, Skin{grey, {1, 1}, {0, 0}, false});
  const ShadowTester tester(builder.meshes());
  const float unlit = LightModel({}).at({0, 0, 0}, {0, 0, 1}, nullptr)[1];
  EXPECT_FLOAT_EQ(model.at({0, 0, 0}, {0, 0, 1}, &tester)[1], unlit);
  EXPECT_GT(up, 1.05f * unlit);
  EXPECT_TRUE(tester.blocked({0, 0, 0}, {0, 0, 1}, 1.05f));
  EXPECT_FALSE(tester.blocked({0, 0, 0}, {0, 0, 1}, 0.95f));
  EXPECT_FALSE(tester.blocked({1.5f, 0, 0}, {0, 0, 1}, 5.f));
}

}  // namespace
}  // namespace semvslam::render
