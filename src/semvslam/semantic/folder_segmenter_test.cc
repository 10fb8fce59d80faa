#include "semvslam/semantic/folder_segmenter.h"

#include <gmock/gmock.h>

#include <fstream>
#include <opencv2/imgcodecs.hpp>

namespace semvslam {
namespace {

namespace fs = std::filesystem;
using ::testing::HasSubstr;

class FolderSegmenterTest : public ::testing::Test {
 protected:
  FolderSegmenterTest() {
    fs::remove_all(folder_);
    fs::create_directories(folder_ / "mask");
    cv::Mat mask = cv::Mat::zeros(10, 20, CV_8UC1);
    mask(cv::Rect(3, 2, 4, 5)) = 1;
    mask(cv::Rect(10, 1, 2, 2)) = 2;
    cv::imwrite((folder_ / "mask" / "12.500000.png").string(), mask);
    std::ofstream(folder_ / "roles.json") << R"([{"number": 1, "label": "person"}, {"number": 2, "label": "cup"}])";
  }
  ~FolderSegmenterTest() override { fs::remove_all(folder_); }
  SegmentationRequest request(double stamp_s, cv::Size size = {20, 10}) const {
    return {FrameId(7), TimeStamp::from_seconds(stamp_s), cv::Mat(size, CV_8UC3, cv::Scalar::all(0)), ""};
  }
  const fs::path folder_ = fs::temp_directory_path() / ("folder_segmenter_" + std::to_string(::getpid()));
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
  EXPECT_FALSE(FolderSegmenter::open(folder_ / "absent", RoleTable()));
  EXPECT_FALSE(FolderSegmenter::open(folder_, RoleTable()));  // no PNG in it
  std::ofstream(folder_ / "roles.json") << "{";
  EXPECT_FALSE(FolderSegmenter::open(folder_ / "mask", RoleTable()));
}

TEST_F(FolderSegmenterTest, WithoutRolesEverythingIsAPerson) {
  fs::remove(folder_ / "roles.json");
  const auto segmenter = FolderSegmenter::open(folder_ / "mask", RoleTable());
  EXPECT_EQ((*segmenter)->segment(request(12.5))->pixels_of_class("person"), 24);
}

}  // namespace
}  // namespace semvslam
