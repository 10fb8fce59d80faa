#include "semvslam/map/landmark_view.h"

#include <gtest/gtest.h>

#include "semvslam/feature/orb_extractor.h"

namespace semvslam {
namespace {

Camera small_camera() {
  Camera camera;
  camera.width_px = 320;
  camera.height_px = 240;
  camera.fx_px = camera.fy_px = 300;
  camera.cx_px = 160;
  camera.cy_px = 120;
  return camera;
}

class LandmarkViewTest : public ::testing::Test {
 protected:
  ObservationModel model{small_camera(), NoiseModel{}, level_scales(OrbOptions{})};
  Eigen::Vector3d position{0.2, 0.1, 2};
  Eigen::Vector3f normal = position.cast<float>().normalized();

  std::optional<LandmarkView> view(const SE3& camera_from_world = SE3()) const {
    return LandmarkViewer(model, camera_from_world, 0.5).view({position, normal, 1.f, 3.f});
  }
};

TEST_F(LandmarkViewTest, GivesPixelDepthAndLevel) {
  const auto seen = view();
  ASSERT_TRUE(seen);
  EXPECT_NEAR(seen->pixel.x(), 190, 1e-9);
  EXPECT_NEAR(seen->pixel.y(), 135, 1e-9);
  EXPECT_NEAR(seen->in_camera.z(), 2, 1e-12);
  EXPECT_EQ(seen->level, model.predict_level(3.f / static_cast<float>(position.norm())));
}

TEST_F(LandmarkViewTest, NothingBehindOutsideOrTurnedAway) {
  const auto moved = [](double x, double y, double z) { return SE3(Eigen::Quaterniond::Identity(), {x, y, z}); };
  EXPECT_FALSE(view(moved(0, 0, -2.1))) << "behind";
  EXPECT_FALSE(view(moved(1.2, 0, 0))) << "beside the image";
  const SE3 from_behind(Eigen::Quaterniond(Eigen::AngleAxisd(M_PI, Eigen::Vector3d::UnitY())), {0, 0, 4});
  EXPECT_FALSE(view(from_behind)) << "turned away";
}

TEST_F(LandmarkViewTest, NothingMuchNearerOrFartherThanItWasSeen) {
  const auto backwards = [](double z) { return SE3(Eigen::Quaterniond::Identity(), {0, 0, z}); };
  EXPECT_TRUE(view(backwards(1.4)));
  EXPECT_FALSE(view(backwards(1.8)));
  EXPECT_TRUE(view(backwards(-1.1)));
  EXPECT_FALSE(view(backwards(-1.3)));
}

}  // namespace
}  // namespace semvslam
