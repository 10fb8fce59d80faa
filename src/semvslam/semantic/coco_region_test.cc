#include "semvslam/semantic/coco_region.h"

#include <gmock/gmock.h>

#include <nlohmann/json.hpp>

namespace semvslam {
namespace {

using nlohmann::json;

TEST(CocoRegion, RunLengthsGoDownTheColumns) {
  CocoRegion plain;
  plain.runs = {6, 3, 2, 3, 6};  // columns of 5 pixels
  const cv::Mat mask = plain.mask({4, 5});
  EXPECT_EQ(cv::countNonZero(mask), 6);
  EXPECT_EQ(mask.at<std::uint8_t>(1, 1), 255);
  EXPECT_EQ(mask.at<std::uint8_t>(0, 1), 0);
}

TEST(CocoRegion, PackedTextIsTheOneOfTheCocoTools) {
  cv::Mat mask(2, 3, CV_8UC1, cv::Scalar(255));  // in 6 x 5: runs 11 2 3 2 3 2 7
  EXPECT_EQ(pack_region(mask, {2, 1, 3, 2}, {6, 5}), ";230004");
}

TEST(CocoRegion, PackingAndParsingAreInverse) {
  cv::RNG random(3);
  for (const cv::Rect window : {cv::Rect(0, 0, 90, 70), cv::Rect(40, 0, 50, 70), cv::Rect(3, 5, 1, 64),
                                cv::Rect(10, 69, 80, 1), cv::Rect(0, 20, 17, 30)}) {
    const cv::Size size(90, 70);
    cv::Mat noise(window.size(), CV_8UC1), whole = cv::Mat::zeros(size, CV_8UC1);
    random.fill(noise, cv::RNG::UNIFORM, 0, 256);
    whole(window).setTo(255, noise > 100);
    const json written{{"size", {70, 90}}, {"counts", pack_region(whole(window), window, size)}};
    EXPECT_EQ(cv::norm(CocoRegion::parse(written).mask(size), whole, cv::NORM_INF), 0) << window;
  }
}

TEST(CocoRegion, WhatIsNoRegionThrowsAndWhatIsTooLongIsCut) {
  for (const char* text : {"5", "{}", "{\"counts\": 3}", "[[1, 2, \"a\", 4, 5, 6]]", "[[0, 0, 1e300, 0, 5, 5]]",
                           "{\"counts\": [1e20]}", "{\"counts\": [3, -1]}", "{\"counts\": [3, 0.5]}"})
    EXPECT_THROW(CocoRegion::parse(json::parse(text)), std::exception) << text;
  const json beyond{{"counts", {3, 1000000}}};
  EXPECT_EQ(cv::countNonZero(CocoRegion::parse(beyond).mask({4, 5})), 17);
  const json garbage{{"counts", "~~~~~~~~~~~~~~~~~\x7f!"}};
  EXPECT_EQ(CocoRegion::parse(garbage).mask({4, 5}).total(), 20u);
}

}  // namespace
}  // namespace semvslam
