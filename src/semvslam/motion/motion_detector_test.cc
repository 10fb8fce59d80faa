#include "semvslam/motion/motion_detector.h"

#include <gtest/gtest.h>

#include <opencv2/imgproc.hpp>

#include "semvslam/motion/motion_test_support.h"

namespace semvslam {
namespace {

// A textured wall at 3 m, before it a textured box at 1.5 m; the camera goes sideways, the box by itself.
class Film {
 public:
  explicit Film(bool box_moves) : box_moves_(box_moves) {
    Random random(3, "detector.test");
    cv::Mat noise(200, 260, CV_8UC1);
    for (int y = 0; y < noise.rows; ++y)
      for (int x = 0; x < noise.cols; ++x) noise.at<std::uint8_t>(y, x) = static_cast<std::uint8_t>(random.index(256));
    cv::resize(noise, texture_, {1040, 800}, 0, 0, cv::INTER_CUBIC);
  }
  MotionFrame frame(int k) {
    MotionFrame frame;
    frame.id = FrameId(static_cast<std::uint32_t>(k));
    frame.time_s = k / 30.0;
    frame.gray = texture_(cv::Rect(100 + 2 * k, 100, 640, 480)).clone();  // 2 px at 3 m: 11.4 mm a frame
    frame.depth = cv::Mat(480, 640, CV_16UC1, cv::Scalar(15000));
    box = cv::Rect(300 + (box_moves_ ? 3 : -4) * k, 120, 160, 220);
    texture_(cv::Rect(700, 400, 160, 220)).copyTo(frame.gray(box));
    frame.depth(box).setTo(7500);
    frame.cur_from_prev = motion_testing::translation(-2.0 / 525 * 3, 0, 0);
    return frame;
  }
  cv::Rect box;

 private:
  bool box_moves_;
  cv::Mat texture_;
};

TEST(MotionDetector, FindsAnUnknownThingInImages) {
  Film film(true);
  MotionDetector detector(motion_testing::test_camera(), {});
  MotionResult result;
  for (int k = 0; k < 12; ++k) result = detector.step(film.frame(k));
  ASSERT_FALSE(result.regions.empty());
  EXPECT_GT(cv::countNonZero(result.mask(film.box)), 0.85 * film.box.area());
  EXPECT_LT(cv::countNonZero(result.mask) - cv::countNonZero(result.mask(film.box)), 0.2 * film.box.area());
  ASSERT_EQ(result.check.tracks.size(), detector.tracks().size());

  const Eigen::Vector2f on_track = detector.tracks().front().newest().pixel;
  const float track_depth_m = detector.tracks().front().newest().depth_m;
  const std::vector<cv::Point2f> pixels{{static_cast<float>(film.box.x + 80), 230},
                                        {60, 400},
                                        {on_track.x(), on_track.y()},
                                        {on_track.x(), on_track.y()}};
  const std::vector<float> depths{1.5f, 3.f, track_depth_m, 0};
  std::vector<PointVerdict> verdicts;
  detector.judge(pixels, depths, verdicts);
  ASSERT_EQ(verdicts.size(), 4u);
  EXPECT_EQ(verdicts[0].verdict, MotionVerdict::kMoving);
  EXPECT_NE(verdicts[1].verdict, MotionVerdict::kMoving);
  ASSERT_EQ(result.check.tracks.front().verdict, MotionVerdict::kStatic);
  EXPECT_EQ(verdicts[2].verdict, MotionVerdict::kStatic);
  EXPECT_TRUE(verdicts[2].sure);
  EXPECT_EQ(verdicts[3].verdict, MotionVerdict::kStatic);
  EXPECT_FALSE(verdicts[3].sure) << "no depth says that it is the same surface";
}

TEST(MotionDetector, ABoxAtRestIsNothing) {
  Film film(false);
  MotionDetector detector(motion_testing::test_camera(), {});
  for (int k = 0; k < 15; ++k) {
    const MotionResult result = detector.step(film.frame(k));
    EXPECT_TRUE(result.regions.empty()) << "frame " << k;
    EXPECT_LT(result.check.moving, 0.02 * static_cast<double>(detector.tracks().size())) << "frame " << k;
  }
}

TEST(MotionDetector, NoDepthNoTextureNoPose) {
  MotionDetector detector(motion_testing::test_camera(), {});
  for (std::uint32_t k = 0; k < 4; ++k) {
    MotionFrame frame;
    frame.id = FrameId(k);
    frame.gray = cv::Mat(480, 640, CV_8UC1, cv::Scalar(90));
    const MotionResult result = detector.step(frame);
    EXPECT_TRUE(result.regions.empty());
    EXPECT_EQ(cv::countNonZero(result.mask), 0);
  }
}

TEST(MotionOptions, HaveKeysOfTheirOwn) {
  MotionOptions options;
  ConfigSchema schema;
  options.add_to(schema);
  EXPECT_TRUE(schema.set("motion.epipolar_px=3.5").ok());
  EXPECT_EQ(options.check.epipolar_px, 3.5);
  EXPECT_FALSE(schema.set("motion.flow.tracks=-1").ok());
  for (const std::string& key : schema.keys()) EXPECT_EQ(key.rfind("motion.", 0), 0u) << key;
}

}  // namespace
}  // namespace semvslam
