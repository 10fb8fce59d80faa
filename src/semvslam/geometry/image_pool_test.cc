#include "semvslam/geometry/image_pool.h"

#include <gtest/gtest.h>

#include <thread>

namespace semvslam {
namespace {

const cv::Size kSize(64, 48);

TEST(ImagePool, GivesMemoryOutAgainOnceNobodyHoldsIt) {
  ImagePool pool;
  cv::Mat first = pool.take(kSize, CV_8UC1);
  const std::uint8_t* const place = first.data;
  cv::Mat same = first;
  first.release();
  EXPECT_NE(pool.take(kSize, CV_8UC1).data, place);
  same.release();
  EXPECT_EQ(pool.take(kSize, CV_8UC1).data, place);
  EXPECT_EQ(pool.kept(), 2u);
}

TEST(ImagePool, APartOfAnImageHoldsTheWhole) {
  ImagePool pool;
  cv::Mat part = pool.take(kSize, CV_8UC1)(cv::Rect(3, 4, 5, 6));
  const std::uint8_t* const whole = part.datastart;
  EXPECT_NE(pool.take(kSize, CV_8UC1).data, whole);
  part.release();
  EXPECT_EQ(pool.take(kSize, CV_8UC1).data, whole);
}

TEST(ImagePool, TellsSizesAndTypesApart) {
  ImagePool pool;
  const std::uint8_t* const place = pool.take(kSize, CV_8UC1).data;
  const cv::Mat other = pool.take(kSize, CV_16UC1), turned = pool.take({kSize.height, kSize.width}, CV_8UC1);
  EXPECT_EQ(other.type(), CV_16UC1);
  EXPECT_EQ(turned.size(), cv::Size(kSize.height, kSize.width));
  EXPECT_NE(other.data, place);
  EXPECT_NE(turned.data, place);
  EXPECT_TRUE(pool.take({0, 0}, CV_8UC1).empty());
}

TEST(ImagePool, ZerosAreZero) {
  ImagePool pool;
  pool.take(kSize, CV_8UC1).setTo(7);
  EXPECT_EQ(cv::countNonZero(pool.take_zeros(kSize, CV_8UC1)), 0);
  EXPECT_EQ(pool.kept(), 1u);
}

TEST(ImagePool, KeepsNoMoreThanItsMost) {
  ImagePool pool;
  std::vector<cv::Mat> held;
  for (std::size_t i = 0; i < ImagePool::kMost + 5; ++i) held.push_back(pool.take(kSize, CV_8UC1));
  for (std::size_t i = 0; i < held.size(); ++i)
    for (std::size_t k = 0; k < i; ++k) EXPECT_NE(held[i].data, held[k].data);
  EXPECT_EQ(pool.kept(), ImagePool::kMost);
  held.clear();
  const cv::Mat other = pool.take({32, 32}, CV_8UC1);  // of another size: the old ones make room
  EXPECT_EQ(pool.kept(), 1u);
}

TEST(ImagePool, ImagesComeBackFromOtherThreads) {
  ImagePool pool;
  cv::Mat image = pool.take(kSize, CV_8UC1);
  const std::uint8_t* const place = image.data;
  std::thread reader([image = std::move(image)]() mutable {
    EXPECT_EQ(image.size(), kSize);
    image.release();
  });
  reader.join();
  EXPECT_EQ(pool.take(kSize, CV_8UC1).data, place);
}

}  // namespace
}  // namespace semvslam
