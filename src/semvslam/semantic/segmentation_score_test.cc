#include "semvslam/semantic/segmentation_score.h"

#include <gmock/gmock.h>

#include <filesystem>
#include <fstream>
#include <nlohmann/json.hpp>

#include "semvslam/base/temporary_folder_test_support.h"

namespace semvslam {
namespace {

namespace fs = std::filesystem;
using ::testing::HasSubstr;

/// Random labels and detections with the scores that pycocotools gives (training/golden_coco.py).
class SegmentationScoreTest : public ::testing::Test {
 protected:
  SegmentationScoreTest() {
    std::ifstream file(std::string(SEMVSLAM_SOURCE_DIR) + "/models/golden/coco.json");
    golden_ = nlohmann::json::parse(file);
    std::ofstream(path_) << golden_.at("dataset").dump();
  }

  static cv::Mat mask_of(const nlohmann::json& detection, cv::Size size) {
    CocoRegion region;
    region.polygons.push_back(detection.at("polygon").get<std::vector<double>>());
    return region.mask(size);
  }

  const testing_support::TemporaryFolder folder_;
  const fs::path path_ = folder_ / "coco.json";
  nlohmann::json golden_;
};

TEST_F(SegmentationScoreTest, PolygonsCoverTheSamePixels) {
  const Result<CocoDataset> dataset = CocoDataset::read(path_);
  ASSERT_TRUE(dataset) << dataset.error().message;
  for (const nlohmann::json& d : golden_.at("detections"))
    EXPECT_EQ(cv::countNonZero(mask_of(d, dataset->images[d.at("image_id").get<std::size_t>() - 1].size)),
              d.at("area").get<int>());
}

TEST_F(SegmentationScoreTest, AveragePrecisionIsThatOfPycocotools) {
  const Result<CocoDataset> dataset = CocoDataset::read(path_);
  ASSERT_TRUE(dataset);
  SegmentationScorer scorer(*dataset, 0.5);
  for (std::size_t n = 0; n < dataset->images.size(); ++n) {
    Segmentation s;
    s.size = dataset->images[n].size;
    for (const nlohmann::json& d : golden_.at("detections")) {
      if (d.at("image_id").get<std::size_t>() != n + 1) continue;
      Instance i;
      i.class_name = dataset->categories.at(d.at("category_id").get<int>());
      i.score = d.at("score").get<float>();
      i.window = cv::Rect({0, 0}, s.size);
      i.mask = mask_of(d, s.size);
      s.instances.push_back(i);
    }
    std::stable_sort(s.instances.begin(), s.instances.end(),
                     [](const Instance& a, const Instance& b) { return a.score > b.score; });
    scorer.add(dataset->images[n], s);
  }
  const SegmentationScore score = scorer.score();
  const nlohmann::json& wanted = golden_.at("expected");
  EXPECT_NEAR(score.person_mask_ap, wanted.at("person").at("ap").get<double>(), 1e-6);
  EXPECT_NEAR(score.person_mask_ap50, wanted.at("person").at("ap50").get<double>(), 1e-6);
  EXPECT_NEAR(score.mask_ap, wanted.at("all").at("ap").get<double>(), 1e-6);
  EXPECT_NEAR(score.mask_ap50, wanted.at("all").at("ap50").get<double>(), 1e-6);
}

TEST(SegmentationScore, NothingFoundScoresZeroAndNothingLabelledScoresNothing) {
  CocoDataset dataset;
  dataset.categories[1] = "person";
  CocoImage image{"a.png", {200, 200}, {}};
  CocoObject person;
  person.category = 1;
  person.region.polygons = {{10, 10, 150, 10, 150, 150, 10, 150}};
  image.objects.push_back(person);
  SegmentationScorer with(dataset, 0.5), without(dataset, 0.5);
  Segmentation nothing;
  nothing.size = {200, 200};
  with.add(image, nothing);
  without.add({"b.png", {200, 200}, {}}, nothing);
  EXPECT_EQ(with.score().person_mask_ap, 0);
  EXPECT_EQ(with.score().near_persons, 1);
  EXPECT_EQ(with.score().near_person_recall, 0);
  EXPECT_EQ(without.score().person_mask_ap, -1);
  EXPECT_EQ(without.score().person_pixel_iou, -1);
}

TEST(CocoDataset, DamagedFilesAreNamed) {
  const testing_support::TemporaryFolder folder;
  const fs::path path = folder / "coco.json";
  for (const char* text :
       {"", "[]", "{\"images\": 3}", "{\"images\": [], \"categories\": [], \"annotations\": [{\"image_id\": 4}]}"}) {
    std::ofstream(path) << text;
    const auto dataset = CocoDataset::read(path);
    ASSERT_FALSE(dataset) << text;
    EXPECT_THAT(dataset.error().message, HasSubstr(path.string()));
  }
  EXPECT_FALSE(CocoDataset::read(path));
}

}  // namespace
}  // namespace semvslam
