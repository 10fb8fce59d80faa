#include "semvslam/data/sequence_writer.h"

#include <gmock/gmock.h>

#include "semvslam/data/data_test_support.h"
#include "semvslam/data/sequence.h"

namespace semvslam {
namespace {

using namespace testing_support;
using ::testing::HasSubstr;

constexpr int kWrittenWidth = 64, kWrittenHeight = 48;

Camera test_camera() {
  Camera camera;
  camera.width_px = kWrittenWidth;
  camera.height_px = kWrittenHeight;
  camera.fx_px = 50.0 / 3;
  camera.fy_px = 51;
  camera.cx_px = 31.5;
  camera.cy_px = 23.5;
  camera.distortion.k1 = -0.03;
  camera.depth_units_per_m = 1000;
  return camera;
}

RgbdFrame test_frame(int i) {
  RgbdFrame frame;
  frame.id = FrameId(static_cast<std::uint32_t>(i));
  frame.stamp.ns = 1305031102175304001 + i * std::int64_t{33333333};
  frame.colour = cv::Mat(kWrittenHeight, kWrittenWidth, CV_8UC3);
  cv::RNG random(static_cast<std::uint64_t>(i) + 1);
  random.fill(frame.colour, cv::RNG::UNIFORM, 0, 256);
  frame.gray = gray_picture(kWrittenWidth, kWrittenHeight, i);
  frame.depth = depth_picture(kWrittenWidth, kWrittenHeight, i);
  return frame;
}

SE3 test_pose(int i) { return SE3(Eigen::Quaterniond(1, 0.1 * i, 0.2, -0.1), {0.1 * i, 1, 2}); }

TEST(SequenceWriter, WhatIsWrittenIsReadBackIdentically) {
  TemporaryFolder folder;
  {
    Result<SequenceWriter> writer = SequenceWriter::create(folder / "s", test_camera());
    ASSERT_TRUE(writer.ok()) << writer.error().message;
    for (int i = 0; i < 3; ++i) {
      RgbdFrame frame = test_frame(i);
      frame.mask = gray_picture(kWrittenWidth, kWrittenHeight, 50 + i);
      ASSERT_TRUE(writer->write(frame, test_pose(i)).ok());
    }
  }
  SequenceOptions options;
  options.want_colour = true;
  options.mask_folder = "mask";
  Result<std::unique_ptr<FrameSource>> source = open_sequence(folder / "s", options);
  ASSERT_TRUE(source.ok()) << source.error().message;
  EXPECT_EQ((*source)->camera().fx_px, test_camera().fx_px);
  EXPECT_EQ((*source)->camera().distortion.k1, -0.03);
  EXPECT_EQ((*source)->camera().depth_units_per_m, 1000);
  for (int i = 0; i < 3; ++i) {
    const auto frame = (*source)->next();
    ASSERT_TRUE(frame.ok() && frame->has_value());
    EXPECT_EQ((*frame)->stamp, test_frame(i).stamp);
    EXPECT_TRUE(same_image((*frame)->colour, test_frame(i).colour));
    EXPECT_TRUE(same_image((*frame)->depth, test_frame(i).depth));
    EXPECT_TRUE(same_image((*frame)->mask, gray_picture(kWrittenWidth, kWrittenHeight, 50 + i)));
  }
  EXPECT_FALSE((*source)->next()->has_value());
  const Result<Trajectory> truth = read_ground_truth(folder / "s");
  ASSERT_TRUE(truth.ok());
  ASSERT_EQ(truth->size(), 3u);
  EXPECT_EQ((*truth)[2].stamp, test_frame(2).stamp);
  EXPECT_LT(((*truth)[2].world_from_camera.inverse() * test_pose(2)).log().norm(), 1e-8);
}

TEST(SequenceWriter, GrayFramesAndJpegWork) {
  TemporaryFolder folder;
  RgbdFrame frame = test_frame(0);
  frame.colour.release();
  for (const bool jpeg : {false, true}) {
    const std::filesystem::path path = folder / (jpeg ? "jpeg" : "png");
    SequenceWriterOptions options;
    options.jpeg = jpeg;
    Result<SequenceWriter> writer = SequenceWriter::create(path, test_camera(), options);
    ASSERT_TRUE(writer->write(frame, std::nullopt).ok());
    const auto read = (*open_sequence(path, {}))->next();
    ASSERT_TRUE(read.ok() && read->has_value());
    if (jpeg) {
      EXPECT_EQ((*read)->gray.size(), frame.gray.size());
    } else {
      EXPECT_TRUE(same_image((*read)->gray, frame.gray));
    }
    EXPECT_FALSE(std::filesystem::exists(path / "groundtruth.txt"));
    EXPECT_FALSE(std::filesystem::exists(path / "mask"));
  }
}

TEST(SequenceWriter, ARecordingInProgressIsReadable) {
  TemporaryFolder folder;
  Result<SequenceWriter> writer = SequenceWriter::create(folder / "s", test_camera());
  for (int i = 0; i < 4; ++i) ASSERT_TRUE(writer->write(test_frame(i), test_pose(i)).ok());
  EXPECT_EQ((*open_sequence(folder / "s", {}))->size(), 4u);
  EXPECT_EQ(read_ground_truth(folder / "s")->size(), 4u);
}

TEST(SequenceWriter, RefusesWhatItCannotWriteWell) {
  TemporaryFolder folder;
  Result<SequenceWriter> writer = SequenceWriter::create(folder / "s", test_camera());
  ASSERT_TRUE(writer->write(test_frame(1), std::nullopt).ok());
  const auto message = [&](const RgbdFrame& frame) { return writer->write(frame, std::nullopt).error().message; };
  EXPECT_THAT(message(test_frame(1)), HasSubstr("not after the one before"));
  RgbdFrame frame = test_frame(2);
  frame.depth = cv::Mat(kWrittenHeight, kWrittenWidth, CV_32FC1, cv::Scalar(1));
  EXPECT_THAT(message(frame), HasSubstr("depth must be 16-bit"));
  frame = test_frame(2);
  frame.depth = depth_picture(10, 10, 0);
  EXPECT_THAT(message(frame), HasSubstr("another size than the camera"));
  EXPECT_THAT(SequenceWriter::create(folder / "s", test_camera()).error().message,
              HasSubstr("holds a recording already"));
  EXPECT_THAT(SequenceWriter::create("/proc/none", test_camera()).error().message, HasSubstr("cannot make the folder"));
  EXPECT_THAT(SequenceWriter::create(folder / "t", Camera{}).error().message, HasSubstr("camera"));
}

}  // namespace
}  // namespace semvslam
