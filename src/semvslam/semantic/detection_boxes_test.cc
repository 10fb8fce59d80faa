#include "semvslam/semantic/detection_boxes.h"

#include <gmock/gmock.h>

#include <cmath>

namespace semvslam {
namespace {

using ::testing::ElementsAre;
using ::testing::FloatNear;
using ::testing::IsEmpty;

constexpr std::array<float, 4> kPlain{1, 1, 1, 1};

TEST(DetectionBoxes, AnchorsSitOnCellCentresInTheDocumentedOrder) {
  const float sizes[] = {32, 56}, ratios[] = {0.5f, 1, 2};
  const auto anchors = make_anchors(2, 3, 8, sizes, ratios);
  ASSERT_EQ(anchors.size(), 2u * 3 * 6);
  const DetectionBox square = anchors[6 * 4 + 1];  // cell (1, 1), size 32, ratio 1
  EXPECT_FLOAT_EQ(square.x0, 12 - 16);
  EXPECT_FLOAT_EQ(square.y1, 12 + 16);
  const DetectionBox tall = anchors[5];  // size 56, ratio 2
  EXPECT_FLOAT_EQ(tall.height() / tall.width(), 2);
  EXPECT_NEAR(tall.height() * tall.width(), 56 * 56, 1e-2);
}

TEST(DetectionBoxes, DecodingZeroGivesTheReferenceClippedToTheImage) {
  const float zero[4] = {};
  const DetectionBox box = decode_box(zero, {-10, 5, 50, 400}, kPlain, 512, 384);
  EXPECT_FLOAT_EQ(box.x0, 0);
  EXPECT_FLOAT_EQ(box.x1, 50);
  EXPECT_FLOAT_EQ(box.y1, 384);
}

TEST(DetectionBoxes, GrowthIsLimited) {
  const float huge[4] = {0, 0, 1000, 1000};
  const DetectionBox box = decode_box(huge, {100, 100, 101, 101}, kPlain, 1e6f, 1e6f);
  EXPECT_TRUE(std::isfinite(box.x1));
  EXPECT_NEAR(box.x1 - 100.5, 31.25, 0.01);
}

TEST(DetectionBoxes, LargestPrefersTheLowerIndexAmongEquals) {
  const float values[] = {1, 3, 3, 2, 3};
  EXPECT_THAT(largest(values, 3), ElementsAre(1, 2, 4));
  EXPECT_THAT(largest(values, 10), ElementsAre(1, 2, 4, 3, 0));
  EXPECT_THAT(largest({}, 3), IsEmpty());
}

TEST(DetectionBoxes, TheBetterOfTwoOverlappingBoxesStays) {
  const DetectionBox boxes[] = {{0, 0, 10, 10}, {1, 1, 11, 11}, {20, 20, 30, 30}};
  const float scores[] = {0.5f, 0.9f, 0.1f};
  EXPECT_THAT(suppress_overlaps(boxes, scores, 0.5f, 10), ElementsAre(1, 2));
  EXPECT_THAT(suppress_overlaps(boxes, scores, 0.99f, 10), ElementsAre(1, 0, 2));
  EXPECT_THAT(suppress_overlaps(boxes, scores, 0.5f, 1), ElementsAre(1));
}

}  // namespace
}  // namespace semvslam
