#include "semvslam/map/local_map.h"

#include <gtest/gtest.h>

#include <numbers>

#include "semvslam/map/map_file.h"
#include "semvslam/map/map_file_test_support.h"

namespace semvslam {
namespace {

SE3 camera(double x_m, double turned_deg) {
  const Eigen::Quaterniond turn(Eigen::AngleAxisd(turned_deg * std::numbers::pi / 180, Eigen::Vector3d::UnitY()));
  return SE3(turn, {x_m, 0, 0}).inverse();
}

TEST(LocalMap, TheNearestKeyFrameIsNearInPlaceAndDirection) {
  LocalMap local;
  local.key_frames = {
      {KeyFrameId(0), camera(0, 0), 9}, {KeyFrameId(3), camera(0, 80), 9}, {KeyFrameId(7), camera(2, 0), 9}};
  EXPECT_EQ(local.nearest(camera(0.3, 10)), KeyFrameId(0));
  EXPECT_EQ(local.nearest(camera(0.3, 60)), KeyFrameId(3));
  EXPECT_EQ(local.nearest(camera(1.5, 0)), KeyFrameId(7));
  EXPECT_FALSE(LocalMap{}.nearest(SE3()).valid());
}

TEST(LocalMap, AReferenceOfAnEarlierSessionIsNoFrameOfThisOne) {
  const Map map = testing_support::busy_map();
  const KeyFrameId id = map.key_frames().rbegin()->first;
  EXPECT_EQ(make_local_map(map, id, {})->reference_frame, map.key_frame(id)->frame);
  const std::string file = format_map(map);
  const Result<Map> again = parse_map({reinterpret_cast<const std::uint8_t*>(file.data()), file.size()}, "f");
  ASSERT_TRUE(again.ok());
  EXPECT_FALSE(make_local_map(*again, id, {})->reference_frame.valid());
}

}  // namespace
}  // namespace semvslam
