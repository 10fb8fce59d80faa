#include "semvslam/dense/point_cloud.h"

#include <gmock/gmock.h>

#include <cstring>
#include <fstream>
#include <iterator>

#include "semvslam/base/temporary_folder_test_support.h"

namespace semvslam {
namespace {

using testing::EndsWith;
using testing::HasSubstr;
using testing::StartsWith;
namespace fs = std::filesystem;

const std::vector<CloudPoint> kPoints{{{1, 2, 3}, {255, 128, 1}}, {{-4, 5.5f, 0}, {0, 7, 200}}};

template <typename T>
T read_at(const std::string& text, std::size_t at) {
  T value;
  std::memcpy(&value, text.data() + at, sizeof value);
  return value;
}

TEST(PointCloud, PlyHoldsPlacesAndColours) {
  const std::string text = format_ply(kPoints);
  EXPECT_THAT(text, StartsWith("ply\nformat binary_little_endian 1.0\n"));
  EXPECT_THAT(text, HasSubstr("element vertex 2\n"));
  const std::size_t body = text.find("end_header\n") + 11;
  ASSERT_EQ(text.size(), body + 2 * 15);
  EXPECT_EQ(read_at<float>(text, body + 15), -4);
  EXPECT_EQ(read_at<float>(text, body + 4), 2);
  EXPECT_EQ(read_at<std::uint8_t>(text, body + 12), 255);
  EXPECT_EQ(read_at<std::uint8_t>(text, body + 15 + 14), 200);
}

TEST(PointCloud, PcdPacksTheColour) {
  const std::string text = format_pcd(kPoints);
  EXPECT_THAT(text, HasSubstr("FIELDS x y z rgb\n"));
  EXPECT_THAT(text, HasSubstr("POINTS 2\n"));
  const std::size_t body = text.find("DATA binary\n") + 12;
  ASSERT_EQ(text.size(), body + 2 * 16);
  EXPECT_EQ(read_at<float>(text, body + 8), 3);
  EXPECT_EQ(read_at<std::uint32_t>(text, body + 12), 0xff8001u);
}

TEST(PointCloud, NoPointsAreAFileToo) {
  EXPECT_THAT(format_ply({}), EndsWith("end_header\n"));
  EXPECT_THAT(format_pcd({}), EndsWith("DATA binary\n"));
}

TEST(PointCloud, TheNameSaysTheFormat) {
  const testing_support::TemporaryFolder folder;
  for (const char* name : {"a.ply", "a.pcd"}) {
    ASSERT_TRUE(write_cloud(folder / name, kPoints));
    std::ifstream in(folder / name, std::ios::binary);
    const std::string text{std::istreambuf_iterator<char>(in), {}};
    EXPECT_EQ(text, std::string(name) == "a.ply" ? format_ply(kPoints) : format_pcd(kPoints));
  }
  const Status other = write_cloud(folder / "a.xyz", kPoints);
  ASSERT_FALSE(other);
  EXPECT_THAT(other.error().message, HasSubstr(".ply or .pcd"));
  EXPECT_FALSE(write_cloud(folder / "absent/a.ply", kPoints));
}

}  // namespace
}  // namespace semvslam
