#include "semvslam/semantic/folder_segmenter.h"

#include <gmock/gmock.h>

#include <fstream>
#include <opencv2/imgcodecs.hpp>

#include "semvslam/base/temporary_folder_test_support.h"
#include "semvslam/semantic/segmentation_files.h"

namespace semvslam {
namespace {

namespace fs = std::filesystem;
using ::testing::HasSubstr;

class FolderSegmenterTest : public ::testing::Test {
 protected:
  FolderSegmenterTest() {
    fs::create_directories(folder_ / "mask");
    cv::Mat mask = cv::Mat::zeros(10, 20, CV_8UC1);
    mask(cv::Rect(3, 2, 4, 5)) = 1;
    mask(cv::Rect(10, 1, 2, 2)) = 2;
    cv::imwrite((folder_ / "mask" / "12.500000.png").string(), mask);
    std::ofstream(folder_ / "roles.json") << R"([{"number": 1, "label": "person"}, {"number": 2, "label": "cup"}])";
  }
  SegmentationRequest request(double stamp_s, cv::Size size = {20, 10}) const {
    return {FrameId(7), TimeStamp::from_seconds(stamp_s), cv::Mat(size, CV_8UC3, cv::Scalar::all(0)), ""};
  }
  const testing_support::TemporaryFolder folder_;
};

TEST_F(FolderSegmenterTest, FindsTheMaskByStampAndNamesItsClasses) {
  const auto segmenter = FolderSegmenter::open(folder_ / "mask", RoleTable());
  ASSERT_TRUE(segmenter) << segmenter.error().message;
  const Result<Segmentation> s = (*segmenter)->segment(request(12.51));
  ASSERT_TRUE(s);
  ASSERT_EQ(s->instances.size(), 2u);
  EXPECT_EQ(s->frame, FrameId(7));
  EXPECT_EQ(s->instances[0].class_name, "person");
  EXPECT_EQ(s->instances[0].window, cv::Rect(3, 2, 4, 5));
  EXPECT_EQ(s->instances[1].role, Role::kMovable);
  EXPECT_EQ(s->pixels_of_class("person"), 20);
}

TEST_F(FolderSegmenterTest, NoMaskNearTheStampMeansNoInstance) {
  const auto segmenter = FolderSegmenter::open(folder_ / "mask", RoleTable());
  const Result<Segmentation> s = (*segmenter)->segment(request(13));
  ASSERT_TRUE(s);
  EXPECT_TRUE(s->instances.empty());
}

TEST_F(FolderSegmenterTest, AMaskOfAnotherSizeIsAnErrorThatNamesTheFile) {
  const auto segmenter = FolderSegmenter::open(folder_ / "mask", RoleTable());
  const Result<Segmentation> s = (*segmenter)->segment(request(12.5, {21, 10}));
  ASSERT_FALSE(s);
  EXPECT_THAT(s.error().message, HasSubstr("12.500000.png"));
}

TEST_F(FolderSegmenterTest, DamagedFilesAndMissingFoldersAreErrors) {
  std::ofstream(folder_ / "mask" / "20.0.png") << "no picture";
  const auto segmenter = FolderSegmenter::open(folder_ / "mask", RoleTable());
  EXPECT_FALSE((*segmenter)->segment(request(20)));
  std::ofstream(folder_ / "mask" / "20.0.png", std::ios::trunc);  // 0 bytes
  EXPECT_FALSE((*segmenter)->segment(request(20)));
  EXPECT_FALSE(FolderSegmenter::open(folder_ / "absent", RoleTable()));
  EXPECT_FALSE(FolderSegmenter::open(folder_.path(), RoleTable()));  // nothing in it but roles.json
  std::ofstream(folder_ / "roles.json") << "{";
  EXPECT_FALSE(FolderSegmenter::open(folder_ / "mask", RoleTable()));
}

TEST_F(FolderSegmenterTest, WithoutRolesEverythingIsAPerson) {
  fs::remove(folder_ / "roles.json");
  const auto segmenter = FolderSegmenter::open(folder_ / "mask", RoleTable());
  EXPECT_EQ((*segmenter)->segment(request(12.5))->pixels_of_class("person"), 24);
}

TEST_F(FolderSegmenterTest, ReadsWhatTheSegmentCommandWrites) {
  Segmentation written{FrameId(0), TimeStamp{}, {20, 10}, {}};
  for (const auto& [name, window] : {std::pair("cup", cv::Rect(0, 0, 3, 4)), {"person", cv::Rect(12, 3, 8, 7)}}) {
    Instance i;
    i.class_name = name;
    i.score = 0.75f;
    i.window = window;
    i.box = cv::Rect2f(window);
    i.mask = cv::Mat(window.size(), CV_8UC1, cv::Scalar(255));
    written.instances.push_back(i);
  }
  written.instances[1].mask.at<std::uint8_t>(6, 7) = 0;
  const cv::Mat picture(10, 20, CV_8UC3, cv::Scalar::all(9));
  ASSERT_TRUE(write_segmentation(folder_ / "mask", "12.500000", picture, written));  // beside a PNG of that image
  ASSERT_TRUE(write_segmentation(folder_ / "mask", "14", picture, written));
  const auto segmenter = FolderSegmenter::open(folder_ / "mask", RoleTable());
  ASSERT_TRUE(segmenter) << segmenter.error().message;
  for (const double stamp_s : {12.5, 14.}) {
    const Result<Segmentation> s = (*segmenter)->segment(request(stamp_s));
    ASSERT_TRUE(s) << s.error().message;
    ASSERT_EQ(s->instances.size(), 2u);
    EXPECT_EQ(s->instances[0].class_name, "cup");
    EXPECT_EQ((*segmenter)->class_names()[static_cast<std::size_t>(s->instances[0].class_index)], "cup");
    EXPECT_FLOAT_EQ(s->instances[0].score, 0.75f);
    EXPECT_EQ(s->instances[1].window, cv::Rect(12, 3, 8, 7));
    EXPECT_EQ(cv::norm(s->instances[1].mask, written.instances[1].mask, cv::NORM_INF), 0);
  }
}

TEST_F(FolderSegmenterTest, JsonWithPolygonsAndWithoutScores) {
  std::ofstream(folder_ / "mask" / "3.json") << R"({"width": 20, "height": 10, "instances": [
    {"class": "dog", "segmentation": [[2, 2, 8, 2, 8, 6, 2, 6]]}, {"class": "cup", "segmentation": []}]})";
  const auto segmenter = FolderSegmenter::open(folder_ / "mask", RoleTable());
  const Result<Segmentation> s = (*segmenter)->segment(request(3));
  ASSERT_TRUE(s) << s.error().message;
  ASSERT_EQ(s->instances.size(), 1u);  // an empty region is none
  EXPECT_EQ(s->instances[0].score, 1.f);
  EXPECT_EQ(s->instances[0].role, Role::kDynamic);
  EXPECT_EQ(s->pixels_of_class("dog"), 24);
}

TEST_F(FolderSegmenterTest, DamagedJsonIsAnErrorThatNamesTheFile) {
  for (const char* text :
       {"", "{", "[]", R"({"width": 20, "height": 10})", R"({"width": 21, "height": 10, "instances": []})",
        R"({"width": 20, "height": 10, "instances": [{"class": "dog"}]})",
        R"({"width": 20, "height": 10, "instances": [{"class": 4, "segmentation": [[2, 2, 8, 2, 8, 6]]}]})"}) {
    std::ofstream(folder_ / "mask" / "3.json") << text;
    const auto segmenter = FolderSegmenter::open(folder_ / "mask", RoleTable());
    const Result<Segmentation> s = (*segmenter)->segment(request(3));
    ASSERT_FALSE(s) << text;
    EXPECT_THAT(s.error().message, HasSubstr("3.json"));
  }
}

}  // namespace
}  // namespace semvslam
