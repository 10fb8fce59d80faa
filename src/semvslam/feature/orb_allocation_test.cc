// Counts the memory that the extractor asks for; the replaced operators count for this program only.
#include <gtest/gtest.h>

#include <atomic>
#include <cstdlib>
#include <new>

#include "semvslam/feature/orb_extractor.h"
#include "semvslam/feature/test_images.h"

namespace {
std::atomic<long> allocations{0};
}

void* operator new(std::size_t size) {
  ++allocations;
  if (void* p = std::malloc(size)) return p;
  throw std::bad_alloc();
}
void operator delete(void* p) noexcept { std::free(p); }
void operator delete(void* p, std::size_t) noexcept { std::free(p); }

namespace semvslam {
namespace {

TEST(OrbExtractor, AllocatesNothingOnceWarm) {
  const cv::Mat a = with_noise(rectangles_image(640, 480, 1), 2, 1),
                b = with_noise(rectangles_image(640, 480, 2), 2, 2);
  cv::Mat mask(480, 640, CV_8UC1, cv::Scalar(0));
  mask(cv::Rect(100, 100, 200, 200)).setTo(255);
  OrbExtractor extractor{OrbOptions{}};
  OrbFeatures features;
  extractor.extract(a, {}, features);
  extractor.extract(b, {}, features);
  std::vector<const std::uint8_t*> levels;
  for (const cv::Mat& level : extractor.pyramid()) levels.push_back(level.data);
  const long before = allocations;
  extractor.extract(a, {}, features);
  extractor.extract(b, mask, features);
  EXPECT_EQ(allocations - before, 0);
  for (std::size_t l = 1; l < levels.size(); ++l)
    EXPECT_EQ(extractor.pyramid()[l].data, levels[l]) << l;  // cv::Mat's own
}

}  // namespace
}  // namespace semvslam
