#include "semvslam/web/ply_reader.h"

#include <gmock/gmock.h>

#include <sstream>
#include <vector>

#include "semvslam/base/temporary_folder_test_support.h"
#include "semvslam/web/ply_test_support.h"

namespace semvslam {
namespace {

using testing::HasSubstr;
using testing_support::landmark_ply;
using testing_support::raw;

const std::vector<Eigen::Vector3f> kPoints{{1, 2, 3}, {-4, 5.5f, 0}};

std::vector<PlyVertex> vertices_of(const std::string& text, PlyHeader& header) {
  std::istringstream in(text);
  std::vector<PlyVertex> out;
  const Result<PlyHeader> result = read_ply(in, "f", [&](const PlyVertex& v) { out.push_back(v); });
  EXPECT_TRUE(result) << result.error().message;
  if (result) header = *result;
  return out;
}

std::string error_of(const std::string& text) {
  std::istringstream in(text);
  const Result<PlyHeader> result = read_ply(in, "f", [](const PlyVertex&) {});
  return result ? "" : result.error().message;
}

TEST(ReadPly, ReadsLandmarks) {
  PlyHeader header;
  const std::vector<PlyVertex> vertices = vertices_of(landmark_ply(kPoints), header);
  ASSERT_EQ(vertices.size(), 2);
  EXPECT_EQ(header.vertices, 2);
  EXPECT_FALSE(header.has_colours);
  EXPECT_EQ(vertices[1].position_m, kPoints[1]);
}

TEST(ReadPly, TakesWhatItKnowsFromForeignFiles) {
  const std::string text =
      "ply\r\nformat binary_little_endian 1.0\r\nobj_info x\r\nelement vertex 1\r\nproperty uchar red\r\nproperty "
      "uint8 "
      "green\r\nproperty uchar blue\r\nproperty double x\r\nproperty short label\r\nproperty double y\r\nproperty "
      "float z\r\n"
      "element face 3\r\nproperty list uchar int vertex_indices\r\nend_header\r\n" +
      std::string("\x01\xfe\x03") + raw(1.5) + raw(std::int16_t{7}) + raw(-2.5) + raw(3.5f);
  PlyHeader header;
  const std::vector<PlyVertex> vertices = vertices_of(text, header);
  ASSERT_EQ(vertices.size(), 1);
  EXPECT_TRUE(header.has_colours);
  EXPECT_EQ(vertices[0].position_m, Eigen::Vector3f(1.5f, -2.5f, 3.5f));
  EXPECT_EQ(vertices[0].rgb, (std::array<std::uint8_t, 3>{1, 254, 3}));
}

TEST(ReadPly, ReadsMoreThanAChunk) {
  std::vector<Eigen::Vector3f> many(20'000);
  for (std::size_t i = 0; i < many.size(); ++i) many[i].setConstant(static_cast<float>(i));
  PlyHeader header;
  const std::vector<PlyVertex> vertices = vertices_of(landmark_ply(many), header);
  ASSERT_EQ(vertices.size(), many.size());
  for (std::size_t i = 0; i < many.size(); ++i) ASSERT_EQ(vertices[i].position_m, many[i]) << i;
}

TEST(ReadPly, SaysWhatIsWrongWithAFile) {
  const std::string good = landmark_ply(kPoints);
  EXPECT_THAT(error_of(good.substr(0, good.size() - 1)), HasSubstr("holds 1 of the 2 vertices"));
  EXPECT_THAT(error_of("ply\nformat binary_little_endian 1.0\nelement vertex 2\n"), HasSubstr("no end"));
  EXPECT_THAT(error_of("ply\nformat ascii 1.0\nend_header\n"), HasSubstr("little-endian"));
  EXPECT_THAT(error_of("{}"), HasSubstr("no PLY"));
  EXPECT_THAT(error_of(""), HasSubstr("no PLY"));
  const std::string begin = "ply\nformat binary_little_endian 1.0\n";
  EXPECT_THAT(error_of(begin + "element vertex 1\nproperty float x\nend_header\n"), HasSubstr("no 'y'"));
  EXPECT_THAT(error_of(begin + "element vertex 1\nproperty list uchar int x\n"), HasSubstr("lists"));
  EXPECT_THAT(error_of(begin + "element vertex 1\nproperty quad x\n"), HasSubstr("'quad'"));
  EXPECT_THAT(error_of(begin + "element face 1\n"), HasSubstr("begin with their vertices"));
  EXPECT_THAT(error_of(begin + "element vertex -1\n"), HasSubstr("number of vertices"));
  EXPECT_THAT(error_of("ply\n" + std::string(1 << 20, 'x')), HasSubstr("no end"));
}

TEST(ReadPly, APromiseOfEverythingCostsNothing) {
  const std::string text =
      "ply\nformat binary_little_endian 1.0\nelement vertex 18446744073709551615\nproperty float x\nproperty float y\n"
      "property float z\nend_header\nabc";
  EXPECT_THAT(error_of(text), HasSubstr("holds 0 of the 18446744073709551615"));
}

TEST(ReadPly, MissingFilesAndFoldersAreNamed) {
  const testing_support::TemporaryFolder folder;
  const auto error_at = [](const std::filesystem::path& file) {
    return read_ply(file, [](const PlyVertex&) {}).error();
  };
  EXPECT_EQ(error_at(folder / "none.ply").code, ErrorCode::kNotFound);
  EXPECT_THAT(error_at(folder.path()).message, HasSubstr("is not a file"));
}

}  // namespace
}  // namespace semvslam
