#include "semvslam/feature/orb_extractor.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <stdexcept>

#include "semvslam/feature/test_images.h"

namespace semvslam {
namespace {

OrbFeatures extract(const cv::Mat& image, const cv::Mat& mask = {}, const OrbOptions& options = {}) {
  OrbExtractor extractor(options);
  OrbFeatures features;
  extractor.extract(image, mask, features);
  return features;
}

void expect_equal(const OrbFeatures& a, const OrbFeatures& b) {
  ASSERT_EQ(a.size(), b.size());
  for (std::size_t i = 0; i < a.size(); ++i) {
    const Keypoint &k = a.keypoints[i], &l = b.keypoints[i];
    ASSERT_TRUE(k.x_px == l.x_px && k.y_px == l.y_px && k.response == l.response && k.angle_rad == l.angle_rad &&
                k.level == l.level)
        << i;
    ASSERT_EQ(a.descriptors[i], b.descriptors[i]) << i;
  }
}

TEST(OrbExtractor, GivesAsManyFeaturesAsWereAskedFor) {
  for (const int wanted : {0, 1, 17, 1000, 3000}) {
    OrbOptions options;
    options.features = wanted;
    const OrbFeatures features = extract(with_noise(rectangles_image(640, 480), 2, 1), {}, options);
    EXPECT_EQ(static_cast<int>(features.size()), wanted);
    EXPECT_EQ(features.descriptors.size(), features.keypoints.size());
  }
}

TEST(OrbExtractor, ANewBudgetHoldsFromTheNextImageOn) {
  const cv::Mat image = with_noise(rectangles_image(640, 480), 2, 1);
  OrbExtractor extractor({});
  OrbFeatures features;
  for (const int wanted : {1500, 200, 0}) {
    extractor.set_budget(wanted);
    extractor.extract(image, {}, features);
    EXPECT_EQ(static_cast<int>(features.size()), wanted);
  }
}

TEST(OrbExtractor, EveryLevelGetsItsShareAndAllFieldsAreInRange) {
  const OrbFeatures features = extract(with_noise(rectangles_image(640, 480), 2, 1));
  std::vector<int> count(8);
  for (const Keypoint& k : features.keypoints) {
    ASSERT_LT(k.level, 8);
    ++count[k.level];
    EXPECT_TRUE(k.x_px >= 0 && k.x_px <= 639 && k.y_px >= 0 && k.y_px <= 479);
    EXPECT_TRUE(k.angle_rad >= 0 && k.angle_rad < 6.2831855f);
    EXPECT_GE(k.response, 7);
  }
  EXPECT_TRUE(std::is_sorted(count.rbegin(), count.rend())) << "finer levels get more";
  EXPECT_GT(count[7], 30);
}

TEST(OrbExtractor, NoFeatureOccursTwice) {
  const OrbFeatures features = extract(with_noise(rectangles_image(640, 480), 2, 1));
  std::vector<std::tuple<int, float, float>> places;
  for (const Keypoint& k : features.keypoints) places.emplace_back(k.level, k.x_px, k.y_px);
  std::sort(places.begin(), places.end());
  EXPECT_EQ(std::adjacent_find(places.begin(), places.end()), places.end());
}

TEST(OrbExtractor, MaskIsRespectedAndTheBudgetGoesToTheRest) {
  const cv::Mat image = with_noise(rectangles_image(640, 480), 2, 1);
  cv::Mat mask(480, 640, CV_8UC1, cv::Scalar(0));
  mask(cv::Rect(0, 0, 300, 480)).setTo(1);
  cv::circle(mask, {500, 200}, 60, cv::Scalar(255), cv::FILLED);
  const OrbFeatures features = extract(image, mask);
  EXPECT_EQ(features.size(), 1000u);
  for (const Keypoint& k : features.keypoints) {
    EXPECT_EQ(mask.at<std::uint8_t>(cvRound(k.y_px), cvRound(k.x_px)), 0)
        << k.x_px << " " << k.y_px << " " << int{k.level};
  }
  EXPECT_EQ(extract(image, cv::Mat(480, 640, CV_8UC1, cv::Scalar(1))).size(), 0u);
  expect_equal(extract(image, cv::Mat(480, 640, CV_8UC1, cv::Scalar(0))), extract(image));
}

TEST(OrbExtractor, WeakTextureIsCoveredBesideStrongTexture) {
  cv::Mat image = rectangles_image(640, 480);
  cv::Mat weak = image(cv::Rect(200, 0, 440, 480));
  weak.convertTo(weak, -1, 0.25, 96);  // a quarter of the contrast
  const OrbFeatures features = extract(image);
  EXPECT_EQ(features.size(), 1000u);
  cv::Mat covered(12, 11, CV_8UC1, cv::Scalar(0));  // of the weak part, in squares of 40 px
  for (const Keypoint& k : features.keypoints) {
    if (k.x_px >= 200) covered.at<std::uint8_t>(static_cast<int>(k.y_px) / 40, static_cast<int>(k.x_px - 200) / 40) = 1;
  }
  EXPECT_GT(cv::countNonZero(covered), 132 / 2);
  // Without the spreading none of them would be there.
  OrbOptions all;
  all.features = 20000;
  std::vector<Keypoint> strongest = extract(image, {}, all).keypoints;
  std::sort(strongest.begin(), strongest.end(), [](const auto& a, const auto& b) { return a.response > b.response; });
  strongest.resize(1000);
  EXPECT_TRUE(std::none_of(strongest.begin(), strongest.end(), [](const Keypoint& k) { return k.x_px >= 200; }));
}

TEST(OrbExtractor, ConcentratedTextureIsUsedInFull) {
  cv::Mat image(480, 640, CV_8UC1, cv::Scalar(90));
  rectangles_image(200, 160, 2, 12).copyTo(image(cv::Rect(250, 150, 200, 160)));
  OrbOptions options;
  options.features = 400;
  const OrbFeatures features = extract(image, {}, options);
  EXPECT_EQ(features.size(), 400u);
  for (const Keypoint& k : features.keypoints) {
    EXPECT_TRUE(k.x_px > 240 && k.x_px < 460 && k.y_px > 140 && k.y_px < 320);
  }
}

TEST(OrbExtractor, SameBytesOnAnyNumberOfThreadsAndAfterAnyOtherImage) {
  const cv::Mat image = with_noise(rectangles_image(640, 480), 2, 1);
  const int threads = cv::getNumThreads();
  OrbExtractor extractor{OrbOptions{}};
  OrbFeatures first, again, other;
  extractor.extract(image, {}, first);
  for (const int n : {0, 1, 2, 8}) {
    cv::setNumThreads(n);
    extractor.extract(rectangles_image(320 + n, 300, n), {}, other);
    extractor.extract(image, {}, again);
    expect_equal(first, again);
  }
  cv::setNumThreads(threads);
  expect_equal(first, extract(image));
}

TEST(OrbExtractor, AViewIntoALargerImageIsTheSameAsACopy) {
  const cv::Mat large = with_noise(rectangles_image(800, 600), 2, 1);
  const cv::Rect part(33, 57, 641, 481);
  expect_equal(extract(large(part)), extract(large(part).clone()));
}

TEST(OrbExtractor, ImagesOfEverySizeAreSafe) {
  EXPECT_EQ(extract(cv::Mat()).size(), 0u);
  EXPECT_EQ(extract(rectangles_image(63, 200)).size(), 0u);
  EXPECT_EQ(extract(cv::Mat(480, 640, CV_8UC1, cv::Scalar(77))).size(), 0u);
  for (const cv::Size size :
       {cv::Size(64, 64), cv::Size(65, 64), cv::Size(64, 900), cv::Size(2001, 70), cv::Size(4000, 3000)}) {
    const OrbFeatures features = extract(rectangles_image(size.width, size.height));
    EXPECT_GT(features.size(), 3u) << size;
    for (const Keypoint& k : features.keypoints) {
      EXPECT_TRUE(k.x_px >= 10 && k.x_px < size.width - 10 && k.y_px >= 10 && k.y_px < size.height - 10) << size;
    }
  }
}

TEST(OrbExtractor, PyramidHasTheRoundedSizesAndTheImageItselfAtLevelZero) {
  OrbExtractor extractor{OrbOptions{}};
  OrbFeatures features;
  const cv::Mat image = rectangles_image(640, 480);
  extractor.extract(image, {}, features);
  ASSERT_EQ(extractor.pyramid().size(), 8u);
  EXPECT_EQ(extractor.pyramid()[0].data, image.data);
  const std::vector<float> scales = level_scales(extractor.options());
  ASSERT_EQ(scales.size(), 8u);
  for (std::size_t l = 0; l < 8; ++l) {
    EXPECT_EQ(extractor.pyramid()[l].cols, cvRound(640 / std::pow(1.2, l)));
    EXPECT_EQ(extractor.pyramid()[l].rows, cvRound(480 / std::pow(1.2, l)));
    EXPECT_NEAR(scales[l], std::pow(1.2, l), 1e-5);
  }
  extractor.extract(rectangles_image(50, 50), {}, features);
  EXPECT_TRUE(extractor.pyramid().empty());
}

TEST(OrbExtractor, RefusesWhatItCannotUse) {
  OrbExtractor extractor{OrbOptions{}};
  OrbFeatures features;
  EXPECT_THROW(extractor.extract(cv::Mat(100, 100, CV_8UC3, cv::Scalar(0)), {}, features), std::invalid_argument);
  EXPECT_THROW(extractor.extract(rectangles_image(100, 100), cv::Mat(99, 100, CV_8UC1), features),
               std::invalid_argument);
  for (void (*spoil)(OrbOptions&) :
       {+[](OrbOptions& o) { o.features = -1; }, +[](OrbOptions& o) { o.levels = 0; },
        +[](OrbOptions& o) { o.scale_factor = 1; }, +[](OrbOptions& o) { o.fast_threshold = 0; },
        +[](OrbOptions& o) { o.fast_threshold_low = 255; }, +[](OrbOptions& o) { o.cell_px = 0; }}) {
    OrbOptions options;
    spoil(options);
    EXPECT_THROW(OrbExtractor{options}, std::invalid_argument);
  }
}

}  // namespace
}  // namespace semvslam
