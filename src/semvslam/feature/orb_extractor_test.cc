#include "semvslam/feature/orb_extractor.h"

#include <gtest/gtest.h>

#include <opencv2/imgproc.hpp>

namespace semvslam {
namespace {

/// Random rectangles of random grey on each other: corners of every contrast and size.
cv::Mat textured(int width, int height, int seed = 1) {
  cv::Mat image(height, width, CV_8UC1, cv::Scalar(128));
  cv::RNG random(static_cast<std::uint64_t>(seed));
  const int count = width * height / 400 + 4;
  for (int i = 0; i < count; ++i) {
    const cv::Point p(random.uniform(-10, width), random.uniform(-10, height));
    cv::rectangle(image, p, p + cv::Point(random.uniform(4, 40), random.uniform(4, 40)),
                  cv::Scalar(random.uniform(0, 256)), cv::FILLED);
  }
  cv::GaussianBlur(image, image, cv::Size(), 0.8);
  return image;
}

TEST(OrbExtractor, GivesWhatWasAskedFor) {
  OrbExtractor extractor{OrbOptions{}};
  OrbFeatures features;
  extractor.extract(textured(640, 480), {}, features);
  EXPECT_EQ(features.size(), 1000u);
  EXPECT_EQ(features.descriptors.size(), features.keypoints.size());
}

}  // namespace
}  // namespace semvslam
