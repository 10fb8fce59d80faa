#include "semvslam/motion/flow_tracks.h"

#include <gtest/gtest.h>

#include <opencv2/imgproc.hpp>

#include "semvslam/motion/motion_test_support.h"

namespace semvslam {
namespace {

using motion_testing::test_camera;

// Smooth random grey values, larger than the image so that it can be shifted.
cv::Mat texture(std::uint64_t seed = 3) {
  Random random(seed, "flow.test");
  cv::Mat noise(140, 180, CV_8UC1);
  for (int y = 0; y < noise.rows; ++y)
    for (int x = 0; x < noise.cols; ++x) noise.at<std::uint8_t>(y, x) = static_cast<std::uint8_t>(random.index(256));
  cv::Mat large;
  cv::resize(noise, large, {900, 700}, 0, 0, cv::INTER_CUBIC);
  return large;
}

MotionFrame frame_of(std::uint32_t id, const cv::Mat& gray) {
  MotionFrame frame;
  frame.id = FrameId(id);
  frame.time_s = id / 30.0;
  frame.gray = gray;
  return frame;
}

cv::Mat shifted(const cv::Mat& large, double x, double y) {
  cv::Mat out;
  const cv::Mat matrix = (cv::Mat_<double>(2, 3) << 1, 0, -100 - x, 0, 1, -100 - y);
  cv::warpAffine(large, out, matrix, {640, 480}, cv::INTER_LINEAR);
  return out;
}

TEST(FlowTracks, FollowsAShiftToATenthOfAPixel) {
  FlowTracks flow(test_camera(), {});
  const cv::Mat large = texture();
  flow.step(frame_of(0, shifted(large, 0, 0)));
  const std::size_t begun = flow.tracks().size();
  EXPECT_GT(begun, 250u);
  flow.step(frame_of(1, shifted(large, 6.4, -3.2)));
  int followed = 0;
  for (const FlowTrack& track : flow.tracks()) {
    if (track.size() < 2) continue;
    ++followed;
    const Eigen::Vector2f motion = track.sample(0).pixel - track.sample(1).pixel;
    EXPECT_NEAR(motion.x(), -6.4, 0.1);
    EXPECT_NEAR(motion.y(), 3.2, 0.1);
  }
  EXPECT_GT(followed, static_cast<int>(0.85 * static_cast<double>(begun)));
}

TEST(FlowTracks, SpreadsOverTheImage) {
  FlowTracks flow(test_camera(), {});
  flow.step(frame_of(0, shifted(texture(), 0, 0)));
  std::array<int, 12> count{};
  for (const FlowTrack& track : flow.tracks())
    ++count[static_cast<std::size_t>(track.newest().pixel.y()) / 160 * 4 +
            static_cast<std::size_t>(track.newest().pixel.x()) / 160];
  for (const int n : count) EXPECT_GT(n, 15);
}

TEST(FlowTracks, LostTracksSayWhy) {
  FlowTracks flow(test_camera(), {});
  const cv::Mat large = texture();
  flow.step(frame_of(0, shifted(large, 0, 0)));
  cv::Mat next = shifted(large, 15, 0);
  cv::Mat other = shifted(texture(99), 0, 0);
  other(cv::Rect(200, 100, 200, 200)).copyTo(next(cv::Rect(200, 100, 200, 200)));  // something else is there now
  flow.step(frame_of(1, next));
  std::array<int, kTrackLosses> reasons{};
  for (const LostTrack& lost : flow.lost()) ++reasons[static_cast<std::size_t>(lost.reason)];
  EXPECT_GT(reasons[static_cast<std::size_t>(TrackLoss::kBorder)], 5);
  EXPECT_GT(reasons[static_cast<std::size_t>(TrackLoss::kBackward)] +
                reasons[static_cast<std::size_t>(TrackLoss::kAppearance)] +
                reasons[static_cast<std::size_t>(TrackLoss::kNotFound)],
            20);
  for (const FlowTrack& track : flow.tracks()) {
    if (track.size() != 2) continue;
    const Eigen::Vector2f before = track.sample(1).pixel;
    if (before.x() <= 230 || before.x() >= 385 || before.y() <= 120 || before.y() >= 280) continue;
    EXPECT_NEAR(before.x() - track.sample(0).pixel.x(), 15, 45);  // none flies across the image
  }
}

TEST(FlowTracks, AHintFindsALargeMotion) {
  const cv::Mat large = texture();
  const auto followed = [&](bool hint) {
    FlowTracks flow(test_camera(), {});
    flow.step(frame_of(0, shifted(large, -40, 0)));
    MotionFrame next = frame_of(1, shifted(large, 40, 0));
    // 80 px: a turn about the vertical axis, nearly.
    if (hint) next.cur_from_prev = motion_testing::rotation(0, -80.0 / 525, 0);
    flow.step(next);
    int right = 0;
    for (const FlowTrack& track : flow.tracks())
      right += track.size() == 2 && std::abs(track.sample(1).pixel.x() - track.sample(0).pixel.x() - 80) < 0.5f;
    return right;
  };
  EXPECT_GT(followed(true), 150);
}

TEST(FlowTracks, StartsAtGivenCornersOutsideTheExcludedMask) {
  FlowTracks flow(test_camera(), {});
  MotionFrame frame = frame_of(0, shifted(texture(), 0, 0));
  std::vector<cv::Point2f> corners;
  for (int y = 30; y < 450; y += 20)
    for (int x = 30; x < 610; x += 20) corners.emplace_back(static_cast<float>(x), static_cast<float>(y));
  frame.corners = corners;
  frame.excluded = cv::Mat::zeros(480, 640, CV_8UC1);
  frame.excluded.colRange(0, 320).setTo(255);
  flow.step(frame);
  EXPECT_GT(flow.tracks().size(), 100u);
  for (const FlowTrack& track : flow.tracks()) {
    EXPECT_GE(track.newest().pixel.x(), 320);
    EXPECT_EQ(std::fmod(track.newest().pixel.x() - 30, 20.f), 0.f);
  }
}

TEST(FlowTracks, FollowingBeforehandWithoutMasksChangesNothing) {
  const cv::Mat large = texture();
  FlowTracks at_once(test_camera(), {}), in_parts(test_camera(), {});
  for (std::uint32_t i = 0; i < 4; ++i) {
    const MotionFrame images = frame_of(i, shifted(large, 5.0 * i, 2.0 * i));
    MotionFrame whole = images;
    whole.excluded = cv::Mat::zeros(480, 640, CV_8UC1);
    whole.excluded.colRange(0, 100 + 100 * static_cast<int>(i)).setTo(255);
    at_once.step(whole);
    in_parts.follow(images);
    in_parts.step(whole);
    ASSERT_EQ(at_once.tracks().size(), in_parts.tracks().size());
    EXPECT_EQ(at_once.lost().size(), in_parts.lost().size());
    for (std::size_t k = 0; k < at_once.tracks().size(); ++k) {
      const FlowTrack &a = at_once.tracks()[k], &b = in_parts.tracks()[k];
      EXPECT_EQ(a.id(), b.id());
      EXPECT_EQ(a.length(), b.length());
      EXPECT_EQ(a.newest().pixel, b.newest().pixel);
      EXPECT_EQ(a.newest().excluded, b.newest().excluded);
      EXPECT_EQ(a.newest().excluded, a.newest().pixel.x() < static_cast<float>(100 + 100 * i) - 0.5f);
    }
  }
}

TEST(FlowTracks, HistoryIsARing) {
  FlowTrack track(PointTrackId(7));
  for (int k = 0; k < 30; ++k) {
    TrackSample sample;
    sample.frame = FrameId(static_cast<std::uint32_t>(k));
    track.push(sample);
  }
  EXPECT_EQ(track.size(), FlowTrack::kCapacity);
  EXPECT_EQ(track.length(), 30);
  for (int age = 0; age < track.size(); ++age)
    EXPECT_EQ(track.sample(age).frame, FrameId(static_cast<std::uint32_t>(29 - age)));
}

TEST(FlowTracks, DepthBesideAnEdgeIsKnownAsTorn) {
  FlowTracks flow(test_camera(), {});
  MotionFrame frame = frame_of(0, shifted(texture(), 0, 0));
  frame.depth = cv::Mat(480, 640, CV_32FC1, cv::Scalar(2.f));
  frame.depth.colRange(320, 640).setTo(3.f);
  frame.depth.rowRange(0, 100).setTo(0.f);
  flow.step(frame);
  for (const FlowTrack& track : flow.tracks()) {
    const TrackSample& s = track.newest();
    if (s.pixel.y() < 97) {
      EXPECT_EQ(s.depth_m, 0.f);
    } else if (s.pixel.y() > 110) {
      EXPECT_NEAR(s.depth_m, s.pixel.x() < 319.5f ? 2 : 3, 1e-6);
      const float from_edge_px = std::abs(s.pixel.x() - 320);
      if (from_edge_px < 2) {
        EXPECT_GT(s.depth_spread_m, 0.5f);
      } else if (from_edge_px > 10) {
        EXPECT_LT(s.depth_spread_m, 1e-5f);
      }
    }
  }
}

TEST(FlowTracks, AFrameOfAnotherSizeIsRefused) {
  FlowTracks flow(test_camera(), {});
  EXPECT_THROW(flow.step(frame_of(0, cv::Mat::zeros(240, 320, CV_8UC1))), std::invalid_argument);
  MotionFrame frame = frame_of(0, cv::Mat::zeros(480, 640, CV_8UC1));
  frame.excluded = cv::Mat::zeros(480, 320, CV_8UC1);
  EXPECT_THROW(flow.step(frame), std::invalid_argument);
}

TEST(FlowTracks, AnImageWithoutTextureHasNoTracks) {
  FlowTracks flow(test_camera(), {});
  for (std::uint32_t k = 0; k < 3; ++k) flow.step(frame_of(k, cv::Mat(480, 640, CV_8UC1, cv::Scalar(128))));
  EXPECT_TRUE(flow.tracks().empty());
}

}  // namespace
}  // namespace semvslam
