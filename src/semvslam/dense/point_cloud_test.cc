#include "semvslam/dense/point_cloud.h"

#include <gmock/gmock.h>

#include <cstring>
#include <set>
#include <vector>

namespace semvslam {
namespace {

using testing::EndsWith;
using testing::HasSubstr;
using testing::Not;
using testing::StartsWith;

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

const std::vector<CloudPoint> kLabelled{{{1, 2, 3}, {255, 128, 1}, 20}, {{-4, 5.5f, 0}, {0, 8, 200}, 0}};
const LabelNames kNames{{20, "chair"}, {22, "a\ncup"}};

TEST(PointCloud, LabelsAreAFieldWhoseNamesStandInTheHeader) {
  const std::string ply = format_ply(kLabelled, kNames);
  EXPECT_THAT(ply, HasSubstr("comment label 20 'chair'\n"));
  EXPECT_THAT(ply, HasSubstr("property uchar blue\nproperty uchar label\nend_header\n"));
  std::size_t body = ply.find("end_header\n") + 11;
  ASSERT_EQ(ply.size(), body + 2 * 16);
  EXPECT_EQ(read_at<std::uint8_t>(ply, body + 15), 20);
  EXPECT_EQ(read_at<float>(ply, body + 16), -4);
  EXPECT_EQ(read_at<std::uint8_t>(ply, body + 16 + 15), 0);

  const std::string pcd = format_pcd(kLabelled, kNames);
  EXPECT_THAT(pcd, HasSubstr("# label 20 'chair'\n"));
  EXPECT_THAT(pcd, HasSubstr("FIELDS x y z rgb label\nSIZE 4 4 4 4 4\nTYPE F F F F U\nCOUNT 1 1 1 1 1\n"));
  body = pcd.find("DATA binary\n") + 12;
  ASSERT_EQ(pcd.size(), body + 2 * 20);
  EXPECT_EQ(read_at<std::uint32_t>(pcd, body + 16), 20u);
  EXPECT_EQ(read_at<float>(pcd, body + 20), -4);
  for (const std::string& text : {ply, pcd}) EXPECT_THAT(text, Not(HasSubstr("\ncup"))) << "a name stays on its line";
}

TEST(PointCloud, NoClassAtAllIsAFieldToo) {
  EXPECT_THAT(format_ply(kLabelled, LabelNames()), HasSubstr("property uchar label\n"));
  EXPECT_THAT(format_ply(kLabelled), Not(HasSubstr("label")));
  EXPECT_THAT(format_pcd(kLabelled), Not(HasSubstr("label")));
}

TEST(PointCloud, ByLabelEveryClassHasItsColourAndTheRestIsGrey) {
  std::vector<CloudPoint> points(256);
  for (std::size_t k = 0; k < points.size(); ++k) points[k].label = static_cast<std::uint8_t>(k);
  points[0].rgb = {10, 20, 30};
  const std::vector<CloudPoint> coloured = coloured_by_label(points);
  EXPECT_EQ(coloured[0].rgb, (std::array<std::uint8_t, 3>{20, 20, 20}));
  std::set<std::array<std::uint8_t, 3>> colours;
  for (const CloudPoint& p : coloured) colours.insert(p.rgb);
  EXPECT_EQ(colours.size(), 256u);
  EXPECT_EQ(coloured[20].label, 20);
}

TEST(PointCloud, NoPointsAreAFileToo) {
  EXPECT_THAT(format_ply({}), EndsWith("end_header\n"));
  EXPECT_THAT(format_pcd({}), EndsWith("DATA binary\n"));
}

}  // namespace
}  // namespace semvslam
