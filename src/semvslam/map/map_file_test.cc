#include "semvslam/map/map_file.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cstring>
#include <fstream>
#include <limits>

#include "semvslam/base/temporary_folder_test_support.h"
#include "semvslam/data/file_io.h"
#include "semvslam/map/map_content.h"
#include "semvslam/map/map_file_test_support.h"

namespace semvslam {
namespace {

using ::testing::AllOf;
using ::testing::HasSubstr;
using testing_support::busy_map;
using testing_support::TemporaryFolder;

std::span<const std::uint8_t> bytes_of(const std::string& text) {
  return {reinterpret_cast<const std::uint8_t*>(text.data()), text.size()};
}

/// The Error's line; "" where there is none.
std::string fault_of_file(const std::string& file) {
  const Result<Map> map = parse_map(bytes_of(file), "room.map");
  if (map) return "";
  EXPECT_EQ(map.error().code, ErrorCode::kInvalidInput);
  return map.error().message;
}
std::string fault_of_content(const std::string& content) {
  const Result<Map> map = parse_map_content(bytes_of(content), "room.map");
  return map ? "" : map.error().message;
}

template <typename T>
std::string with(std::string bytes, std::size_t at, T value) {
  std::memcpy(bytes.data() + at, &value, sizeof(T));
  return bytes;
}

// Where things lie in the content of busy_map().
constexpr std::size_t kCamera = 0, kNoise = kCamera + 2 * 4 + 12 * 8, kLevels = kNoise + 6 * 8;
constexpr std::size_t kNextIds = kLevels + 4 + 8 * 4, kKeyFrames = kNextIds + 8, kFirstKeyFrame = kKeyFrames + 4;
constexpr std::size_t kPose = kFirstKeyFrame + 16, kFeatures = kPose + 56, kFirstFeature = kFeatures + 4;
constexpr std::size_t kFirstMask = kFirstFeature + 8 * 61;

TEST(MapFile, AMapComesBackToTheLastBit) {
  const Map map = busy_map();
  const std::string file = format_map(map);
  const Result<Map> again = parse_map(bytes_of(file), "f");
  ASSERT_TRUE(again.ok()) << again.error().message;
  EXPECT_EQ(format_map(*again), file);

  ASSERT_EQ(again->key_frames().size(), 3u);
  for (const auto& [id, expected] : map.key_frames()) {
    const KeyFrame& got = *again->key_frame(id);
    EXPECT_EQ(got.frame, expected.frame);
    EXPECT_EQ(got.stamp, expected.stamp);
    EXPECT_EQ(got.camera_from_world.rotation().coeffs(), expected.camera_from_world.rotation().coeffs());
    EXPECT_EQ(got.camera_from_world.translation(), expected.camera_from_world.translation());
    EXPECT_EQ(got.landmarks, expected.landmarks);
    EXPECT_EQ(got.features->orb.descriptors, expected.features->orb.descriptors);
    EXPECT_EQ(got.features->x_px, expected.features->x_px);
    EXPECT_EQ(got.features->depth_m, expected.features->depth_m);
    EXPECT_EQ(got.features->grid.size(), expected.features->size());
    ASSERT_EQ(got.features->moving.size(), expected.features->moving.size());
    if (expected.features->moving.is_set_anywhere()) {
      EXPECT_EQ(cv::norm(got.features->moving.mask(), expected.features->moving.mask(), cv::NORM_INF), 0);
    }
  }
  ASSERT_EQ(again->landmark_ids(), map.landmark_ids());
  for (const LandmarkId id : map.landmark_ids()) {
    const Landmark &got = *again->landmark(id), &expected = *map.landmark(id);
    EXPECT_EQ(got.position, expected.position);
    EXPECT_EQ(got.normal, expected.normal);
    EXPECT_EQ(got.max_distance_m, expected.max_distance_m);
    EXPECT_EQ(got.descriptor, expected.descriptor);
    EXPECT_EQ(got.observations, expected.observations);
    EXPECT_EQ(got.first_key_frame, expected.first_key_frame);
    EXPECT_EQ(std::pair(got.visible, got.found), std::pair(expected.visible, expected.found));
  }
  EXPECT_EQ(again->model().camera().distortion.k3, 0.003);
  EXPECT_EQ(again->model().noise().pixel_sigma_px, 0.7);
}

TEST(MapFile, IdsGoOnWhereTheyStopped) {
  const Map map = busy_map();
  Result<Map> again = parse_map(bytes_of(format_map(map)), "f");
  ASSERT_TRUE(again.ok());
  EXPECT_EQ(again->first_of_session(), map.next_key_frame());
  const KeyFrameId id = again->add_key_frame(FrameId(0), {}, SE3(), again->key_frames().begin()->second.features);
  EXPECT_EQ(id, map.next_key_frame());
  EXPECT_EQ(again->add_landmark({0, 0, 2}, id, 3), map.next_landmark());
}

TEST(MapFile, AnEmptyMapIsOne) {
  const Map empty(std::make_shared<ObservationModel>(vga(), NoiseModel{}, std::vector<float>{1.f}));
  const std::string file = format_map(empty);
  const Result<Map> again = parse_map(bytes_of(file), "f");
  ASSERT_TRUE(again.ok()) << again.error().message;
  EXPECT_EQ(again->key_frames().size(), 0u);
  EXPECT_EQ(format_map(*again), file);
}

TEST(MapFile, IsWrittenAndRead) {
  const TemporaryFolder folder;
  const Map map = busy_map();
  ASSERT_TRUE(write_map(folder / "room.map", map).ok());
  const Result<Map> again = read_map(folder / "room.map");
  ASSERT_TRUE(again.ok()) << again.error().message;
  EXPECT_EQ(format_map(*again), format_map(map));
  EXPECT_EQ(read_map(folder / "none.map").error().code, ErrorCode::kNotFound);
  EXPECT_THAT(read_map(folder.path()).error().message, HasSubstr("is not a file"));
  EXPECT_THAT(write_map(folder / "no/room.map", map).error().message, HasSubstr("room.map"));
}

TEST(MapFile, AFileOfAnotherKindIsRefusedByItsBeginningHoweverLarge) {
  const TemporaryFolder folder;
  std::ofstream(folder / "film.mkv") << "no map at all, but long";
  std::filesystem::resize_file(folder / "film.mkv", std::uintmax_t{1} << 40);  // sparse
  EXPECT_THAT(read_map(folder / "film.mkv").error().message, HasSubstr("film.mkv: is no map file"));
  const std::string beginning = format_map(busy_map()).substr(0, 24);
  std::ofstream(folder / "long.map", std::ios::binary) << beginning;
  std::filesystem::resize_file(folder / "long.map", std::uintmax_t{1} << 40);
  EXPECT_THAT(read_map(folder / "long.map").error().message, HasSubstr("bytes follow its end"));
}

TEST(MapFile, EveryBeginningOfAFileIsToldToBeOne) {
  const std::string file = format_map(busy_map());
  for (std::size_t size = 0; size < file.size(); ++size)
    ASSERT_THAT(fault_of_file(file.substr(0, size)), testing::AnyOf(HasSubstr("breaks off"), HasSubstr("truncated")))
        << size;
}

TEST(MapFile, NoFlippedByteGoesUnnoticed) {
  const std::string file = format_map(busy_map(7));
  for (std::size_t at = 0; at < file.size(); ++at)
    ASSERT_NE(fault_of_file(with(file, at, static_cast<char>(file[at] ^ 0x10))), "") << at;
}

TEST(MapFile, SaysWhatIsWrongWithTheWhole) {
  const std::string file = format_map(busy_map());
  EXPECT_EQ(fault_of_file(file), "");
  EXPECT_EQ(fault_of_file("ply\nformat binary"), "room.map: is no map file (run --save-map writes them)");
  EXPECT_THAT(fault_of_file(with(file, 8, 2u)), AllOf(HasSubstr("version 2"), HasSubstr("a newer program wrote it")));
  EXPECT_THAT(fault_of_file(with(file, 8, 0u)), HasSubstr("version 0, this program reads version 1"));
  EXPECT_THAT(fault_of_file(file + "x"), HasSubstr("1 bytes follow its end"));
  EXPECT_THAT(fault_of_file(with(file, file.size() - 1, 'x')), HasSubstr("damaged (checksum)"));
}

// What the checksum cannot tell: a file that somebody else made.
TEST(MapContent, SaysWhatIsWrongAndWhere) {
  constexpr double kNan = std::numeric_limits<double>::quiet_NaN();
  constexpr float kNanF = std::numeric_limits<float>::quiet_NaN();
  const std::string content = format_map_content(busy_map());
  ASSERT_EQ(fault_of_content(content), "");
  EXPECT_THAT(fault_of_content(with(content, kCamera, -640)), HasSubstr("room.map: camera: image size"));
  EXPECT_THAT(fault_of_content(with(content, kCamera + 8, kNan)), HasSubstr("focal lengths"));
  EXPECT_THAT(fault_of_content(with(content, kNoise, 0.0)), HasSubstr("noise model"));
  EXPECT_THAT(fault_of_content(with(content, kLevels + 4, kNanF)), HasSubstr("pyramid levels"));
  EXPECT_THAT(fault_of_content(with(content, kLevels + 8, 1.f)), HasSubstr("pyramid levels"));
  EXPECT_THAT(fault_of_content(with(content, kLevels, 0x7fffffffu)), HasSubstr("breaks off in its camera"));
  EXPECT_THAT(fault_of_content(with(content, kNextIds, 0xffffffffu)), HasSubstr("next ids are too large"));
  EXPECT_THAT(fault_of_content(with(content, kNextIds, 2u)), HasSubstr("key frame 3 has an id that was never"));
  EXPECT_THAT(fault_of_content(with(content, kNextIds + 4, 2u)), HasSubstr("landmark 2 has an id that was never"));
  EXPECT_THAT(fault_of_content(with(content, kKeyFrames, 0xfffffff0u)), HasSubstr("breaks off in its key frames"));
  EXPECT_THAT(fault_of_content(with(content, kFirstKeyFrame, 1u)), HasSubstr("key frame 1 is there twice"));
  EXPECT_THAT(fault_of_content(with(content, kFirstKeyFrame, 2u)), HasSubstr("of key frame 0, which is not there"));
  EXPECT_THAT(fault_of_content(with(content, kPose, kNan)), HasSubstr("key frame 0 has a pose that is none"));
  EXPECT_THAT(fault_of_content(with(content, kPose, 3.0)), HasSubstr("key frame 0 has a pose that is none"));
  EXPECT_THAT(fault_of_content(with(content, kPose + 32, kNan)), HasSubstr("key frame 0 has a pose that is none"));
  EXPECT_THAT(fault_of_content(with(content, kFeatures, 0x01000000u)), HasSubstr("breaks off in key frame 0"));
  EXPECT_THAT(fault_of_content(with(content, kFirstFeature, kNanF)),
              HasSubstr("feature 0 of key frame 0 lies outside"));
  EXPECT_THAT(fault_of_content(with(content, kFirstFeature, 640.f)),
              HasSubstr("feature 0 of key frame 0 lies outside"));
  EXPECT_THAT(fault_of_content(with(content, kFirstFeature + 16, std::uint8_t{8})), HasSubstr("pyramid level"));
  EXPECT_THAT(fault_of_content(with(content, kFirstFeature + 57, -1.f)), HasSubstr("has a depth that is none"));
  EXPECT_THAT(fault_of_content(with(content, kFirstMask, 7)), HasSubstr("mask of key frame 0 is not of the image's"));
  EXPECT_THAT(fault_of_content(content + "x"), HasSubstr("1 bytes follow the last landmark"));
}

TEST(MapContent, SaysWhatIsWrongWithLandmarks) {
  const std::string content = format_map_content(busy_map());
  const std::size_t last = content.size() - 4;  // the feature of the last observation of the last landmark
  const auto number = [&](std::size_t at) {
    std::uint32_t value = 0;
    std::memcpy(&value, content.data() + at, sizeof(value));
    return value;
  };
  ASSERT_EQ(number(last), 5u);
  ASSERT_EQ(number(last - 4), 3u) << "its key frame";
  EXPECT_THAT(fault_of_content(with(content, last, 8u)), HasSubstr("feature 8 of key frame 3, which is not there"));
  EXPECT_THAT(fault_of_content(with(content, last, 4u)), HasSubstr("feature 4 of key frame 3, which is another's"));
  EXPECT_THAT(fault_of_content(with(content, last - 4, 1u)), HasSubstr("observations that are not in order"));
  EXPECT_THAT(fault_of_content(with(content, last - 4, 9u)), HasSubstr("of key frame 9, which is not there"));
}

TEST(MapContent, NoBytesBringItDown) {
  const std::string content = format_map_content(busy_map(7));
  for (std::size_t size = 0; size < content.size(); ++size)
    ASSERT_NE(fault_of_content(content.substr(0, size)), "") << size;
  for (std::size_t at = 0; at < content.size(); ++at)
    for (const int value : {0, 0x7f, 0x80, 0xff}) (void)fault_of_content(with(content, at, static_cast<char>(value)));
}

}  // namespace
}  // namespace semvslam
