#include "semvslam/data/sequence.h"

#include <fmt/format.h>
#include <gmock/gmock.h>

#include "semvslam/data/data_test_support.h"

namespace semvslam {
namespace {

using namespace testing_support;
using ::testing::ElementsAre;
using ::testing::HasSubstr;

constexpr int kWidth = 64, kHeight = 48;
constexpr const char* kCameraYaml =
    "width: 64\nheight: 48\nfx: 50\nfy: 50\ncx: 32\ncy: 24\ndepth_scale: 5000\nfps: 10\n";

/// What a source gives until its end.
struct Reading {
  std::vector<RgbdFrame> frames;
  std::vector<std::string> errors;
};

Reading read_all(FrameSource& source) {
  Reading reading;
  while (true) {
    Result<std::optional<RgbdFrame>> r = source.next();
    if (!r) {
      reading.errors.push_back(r.error().message);
      EXPECT_FALSE(source.fatal());
      continue;
    }
    if (!r->has_value()) return reading;
    reading.frames.push_back(std::move(**r));
  }
}

class SequenceTest : public ::testing::Test {
 protected:
  /// A recording in TUM layout: stamps 10.0, 10.1..., the depth 5 ms later.
  void make_tum(int count) {
    std::string rgb = "# timestamp filename\n", depth = rgb;
    for (int i = 0; i < count; ++i) {
      rgb += fmt::format("10.{}00 rgb/{}.png\n", i, i);
      depth += fmt::format("10.{}05 depth/{}.png\n", i, i);
      write_image(folder_ / fmt::format("rgb/{}.png", i), gray_picture(kWidth, kHeight, i));
      write_image(folder_ / fmt::format("depth/{}.png", i), depth_picture(kWidth, kHeight, i));
    }
    write_text(folder_ / "rgb.txt", rgb);
    write_text(folder_ / "depth.txt", depth);
    write_text(folder_ / "camera.yaml", kCameraYaml);
  }
  std::unique_ptr<FrameSource> open(SequenceOptions options = {}) {
    Result<std::unique_ptr<FrameSource>> source = open_sequence(folder_.path(), options);
    EXPECT_TRUE(source.ok()) << (source.ok() ? "" : source.error().message);
    return source ? std::move(*source) : nullptr;
  }
  std::string open_error(SequenceOptions options = {}) {
    Result<std::unique_ptr<FrameSource>> source = open_sequence(folder_.path(), options);
    EXPECT_FALSE(source.ok());
    return source.ok() ? "" : source.error().message;
  }
  void cut_file(const std::string& name, std::size_t bytes) {
    const std::string whole = read_text(folder_ / name);
    ASSERT_GT(whole.size(), bytes);
    write_text(folder_ / name, whole.substr(0, bytes));
  }
  TemporaryFolder folder_;
};

TEST_F(SequenceTest, ReadsTumListsInOrderWithCameraAndPixels) {
  make_tum(4);
  auto source = open();
  ASSERT_TRUE(source);
  EXPECT_EQ(source->size(), 4u);
  EXPECT_EQ(source->camera().fx_px, 50);
  const Reading reading = read_all(*source);
  EXPECT_THAT(reading.errors, ElementsAre());
  ASSERT_EQ(reading.frames.size(), 4u);
  for (int i = 0; i < 4; ++i) {
    const RgbdFrame& frame = reading.frames[i];
    EXPECT_EQ(frame.id, FrameId(i));
    EXPECT_EQ(frame.stamp.ns, 10000000000 + 100000000 * i);
    EXPECT_TRUE(same_image(frame.gray, gray_picture(kWidth, kHeight, i)));
    EXPECT_TRUE(same_image(frame.depth, depth_picture(kWidth, kHeight, i)));
    EXPECT_TRUE(frame.colour.empty());
    EXPECT_TRUE(frame.mask.empty());
  }
  EXPECT_TRUE(source->next().ok()) << "the end stays the end";
}

TEST_F(SequenceTest, FillsColourOnlyWhenAsked) {
  make_tum(1);
  cv::Mat bgr(kHeight, kWidth, CV_8UC3, cv::Scalar(10, 20, 200));
  write_image(folder_ / "rgb/0.png", bgr);
  SequenceOptions options;
  options.want_colour = true;
  const Reading reading = read_all(*open(options));
  ASSERT_EQ(reading.frames.size(), 1u);
  EXPECT_TRUE(same_image(reading.frames[0].colour, bgr));
  EXPECT_EQ(reading.frames[0].gray.at<std::uint8_t>(0, 0), 73);  // 0.114 B + 0.587 G + 0.299 R = 72.68
  EXPECT_TRUE(read_all(*open()).frames[0].colour.empty());
}

TEST_F(SequenceTest, SkipsColourImagesWithoutDepthAndSaysSo) {
  make_tum(4);
  write_text(folder_ / "depth.txt", "10.005 depth/0.png\n10.205 depth/2.png\n10.321 depth/3.png\n");
  std::vector<std::string> warnings;
  SequenceOptions options;
  options.on_warning = [&](const std::string& line) { warnings.push_back(line); };
  auto source = open(options);
  EXPECT_EQ(source->size(), 2u);
  EXPECT_THAT(source->description(), HasSubstr("2 colour images without depth"));
  EXPECT_THAT(warnings,
              ElementsAre(HasSubstr("2 colour images have no depth"), HasSubstr("1 depth image has no colour")));
}

TEST_F(SequenceTest, ABadFrameIsOneErrorAndTheRestIsRead) {
  make_tum(9);
  std::filesystem::remove(folder_ / "rgb/1.png");
  cut_file("depth/2.png", 600);
  cut_file("rgb/3.png", 20);
  write_image(folder_ / "depth/4.png", gray_picture(kWidth, kHeight, 0));  // 8 bits
  write_image(folder_ / "rgb/5.png", depth_picture(kWidth, kHeight, 0));   // 16 bits
  write_image(folder_ / "rgb/6.png", gray_picture(1, 1, 0));
  write_image(folder_ / "depth/7.png", depth_picture(kWidth * 2, kHeight, 0));
  const Reading reading = read_all(*open());
  ASSERT_EQ(reading.frames.size(), 2u);
  EXPECT_EQ(reading.frames[0].id, FrameId(0));
  EXPECT_EQ(reading.frames[1].id, FrameId(8));
  EXPECT_THAT(reading.errors,
              ElementsAre(HasSubstr("rgb/1.png: cannot open"), HasSubstr("depth/2.png: the PNG is truncated"),
                          HasSubstr("rgb/3.png: the PNG"), HasSubstr("depth/4.png: a depth image must be 16-bit"),
                          HasSubstr("rgb/5.png: a colour image must have 8 bits"),
                          HasSubstr("rgb/6.png: the image is 1x1, the camera 64x48"),
                          HasSubstr("depth/7.png: the image is 128x48, the camera 64x48")));
  for (const std::string& error : reading.errors) EXPECT_EQ(error.find('\n'), std::string::npos);
}

TEST_F(SequenceTest, WhereNothingCanBeReadOpeningFails) {
  make_tum(3);
  for (int i = 0; i < 3; ++i) write_image(folder_ / fmt::format("rgb/{}.png", i), gray_picture(80, 60, 0));
  EXPECT_THAT(open_error(), HasSubstr("rgb/0.png: the image is 80x60, the camera 64x48"));
}

TEST_F(SequenceTest, TheCameraComesFromTheOptionsBeforeTheFolder) {
  make_tum(1);
  write_text(folder_ / "other.yaml", "width: 64\nheight: 48\nfx: 77\nfy: 50\ncx: 32\ncy: 24\n");
  SequenceOptions options;
  options.camera_file = (folder_ / "other.yaml").string();
  EXPECT_EQ(open(options)->camera().fx_px, 77);
  options.camera_file.clear();
  options.camera_preset = "tum_fr9";
  EXPECT_THAT(open_error(options), HasSubstr("no built-in camera 'tum_fr9'; there are: tum_fr1"));
  std::filesystem::remove(folder_ / "camera.yaml");
  EXPECT_THAT(open_error(), HasSubstr("no camera"));
}

TEST_F(SequenceTest, ReadsMasksByTheNameOfTheColourImage) {
  make_tum(2);
  write_image(folder_ / "mask/1.png", gray_picture(kWidth, kHeight, 5));
  SequenceOptions options;
  options.mask_folder = "mask";
  const Reading reading = read_all(*open(options));
  ASSERT_EQ(reading.frames.size(), 2u);
  EXPECT_TRUE(reading.frames[0].mask.empty());
  EXPECT_TRUE(same_image(reading.frames[1].mask, gray_picture(kWidth, kHeight, 5)));
  std::filesystem::rename(folder_ / "mask/1.png", folder_ / "mask/x.png");
  EXPECT_THAT(open_error(options), HasSubstr("no mask is named like"));
  options.mask_folder = "masks";
  EXPECT_THAT(open_error(options), HasSubstr("masks: no such folder, neither here nor in "));
}

TEST_F(SequenceTest, FramesThatCannotBeReadArePassedOver) {
  make_tum(5);
  write_text(folder_ / "rgb/1.png", "no picture");
  write_text(folder_ / "rgb/3.png", "none either");
  const auto source = open();
  std::vector<FrameId> read;
  for (;;) {
    const auto frame = next_readable(*source);
    ASSERT_TRUE(frame.ok()) << frame.error().message;
    if (!*frame) break;
    read.push_back((*frame)->id);
  }
  EXPECT_THAT(read, ElementsAre(FrameId(0), FrameId(2), FrameId(4)));
}

TEST(NextReadable, AnErrorThatEndsTheSourceIsNotPassedOver) {
  struct Broken final : FrameSource {
    Result<std::optional<RgbdFrame>> next() override { return Error{ErrorCode::kIo, "unplugged"}; }
    bool fatal() const override { return true; }
    const Camera& camera() const override { return its_camera; }
    std::string description() const override { return "broken"; }
    Camera its_camera;
  } source;
  const auto frame = next_readable(source);
  ASSERT_FALSE(frame.ok());
  EXPECT_EQ(frame.error().message, "unplugged");
}

TEST_F(SequenceTest, SaysWhatIsWrongWithAFolder) {
  const auto message = [](const std::filesystem::path& path) { return open_sequence(path, {}).error().message; };
  EXPECT_THAT(message(folder_ / "nowhere"), HasSubstr("no such folder"));
  EXPECT_THAT(message(folder_.path()), HasSubstr("no RGB-D sequence here"));
  write_text(folder_ / "file", "x");
  EXPECT_THAT(message(folder_ / "file"), HasSubstr("is not a folder"));
  write_text(folder_ / "rgb.txt", "# nothing\n");
  write_text(folder_ / "depth.txt", "1 d.png\n");
  EXPECT_THAT(message(folder_.path()), HasSubstr("rgb.txt: no image in the list"));
  write_text(folder_ / "rgb.txt", "5 r.png\n");
  EXPECT_THAT(message(folder_.path()), HasSubstr("none of 1 colour images has a depth image within 0.02 s"));
  write_text(folder_ / "rgb.txt", "5 r.png\nabc r.png\n");
  EXPECT_THAT(message(folder_.path()), HasSubstr("rgb.txt:2: 'abc' is no time stamp"));
}

TEST(SequenceOnDisk, ReadsGroundTruthOfAFolderAndMirrorsIclNuim) {
  TemporaryFolder folder;
  EXPECT_FALSE(read_ground_truth(folder.path()).ok());
  write_text(folder / "livingRoom0.gt.freiburg", "3 1 2 3 0.1 0.2 0.3 0.9\n");
  const Result<Trajectory> icl = read_ground_truth(folder.path());
  ASSERT_TRUE(icl.ok());
  const StampedPose& pose = icl->front();
  EXPECT_EQ(pose.stamp.ns, 100000000);
  // The mirror S = diag(1, -1, 1): a point seen at p by their camera is at S p for ours, and lands at S times their
  // world.
  const SE3 theirs(Eigen::Quaterniond(0.9, 0.1, 0.2, 0.3), {1, 2, 3});
  const Eigen::Vector3d p(0.4, -0.7, 2.0), mirror(1, -1, 1);
  EXPECT_TRUE((pose.world_from_camera * mirror.cwiseProduct(p)).isApprox(mirror.cwiseProduct(theirs * p), 1e-12));
  write_text(folder / "groundtruth.txt", "3 1 2 3 0 0 0 1\n");
  EXPECT_EQ(read_ground_truth(folder.path())->front().stamp.ns, 3000000000);
  EXPECT_EQ(read_ground_truth(folder / "groundtruth.txt")->front().stamp.ns, 3000000000);
  // The same file renamed, as many do: the folder's layout tells.
  write_text(folder / "associations.txt", "3 depth/3.png 3 rgb/3.png\n");
  EXPECT_EQ(read_ground_truth(folder.path())->front().stamp.ns, 100000000);
  EXPECT_EQ(read_ground_truth(folder.path())->front().world_from_camera.translation().y(), -2);
}

}  // namespace
}  // namespace semvslam
