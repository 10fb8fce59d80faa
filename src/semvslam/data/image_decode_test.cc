#include "semvslam/data/image_decode.h"

#include <gmock/gmock.h>

#include <opencv2/imgcodecs.hpp>
#include <opencv2/imgproc.hpp>

#include "semvslam/data/data_test_support.h"
#include "semvslam/data/png_test_support.h"

namespace semvslam {
namespace {

using namespace testing_support;
using ::testing::HasSubstr;

/// A colourful picture without hard edges between its colours, like a photograph.
cv::Mat colour_picture(int width, int height) {
  cv::Mat image(height, width, CV_8UC3);
  for (int y = 0; y < height; ++y)
    for (int x = 0; x < width; ++x)
      image.at<cv::Vec3b>(y, x) = cv::Vec3b(cv::saturate_cast<std::uint8_t>(128 + 100 * std::sin(x * 0.05)),
                                            cv::saturate_cast<std::uint8_t>(128 + 90 * std::cos(y * 0.07 + x * 0.01)),
                                            cv::saturate_cast<std::uint8_t>(40 + x + y / 2));
  return image;
}

Bytes encode(const std::string& extension, const cv::Mat& image, const std::vector<int>& parameters = {}) {
  Bytes bytes;
  EXPECT_TRUE(cv::imencode(extension, image, bytes, parameters));
  return bytes;
}

double mean_difference(const cv::Mat& a, const cv::Mat& b) {
  return cv::norm(a, b, cv::NORM_L1) / static_cast<double>(a.total() * a.channels());
}

TEST(ImageDecode, JpegGrayIsTheLumaOfOpenCvBitForBit) {
  for (const cv::Size size : {cv::Size(64, 48), cv::Size(61, 47)}) {
    const Bytes jpeg = encode(".jpg", colour_picture(size.width, size.height));
    ImageDecoder decoder(size);
    cv::Mat gray;
    ASSERT_TRUE(decoder.colour_image(jpeg, gray, nullptr).ok());
    EXPECT_TRUE(same_image(gray, cv::imdecode(jpeg, cv::IMREAD_GRAYSCALE)));
  }
}

TEST(ImageDecode, JpegGrayIsTheSameWithColourAndColourIsClose) {
  for (const cv::Size size : {cv::Size(160, 120), cv::Size(61, 47)}) {
    const cv::Mat picture = colour_picture(size.width, size.height);
    const Bytes jpeg = encode(".jpg", picture);
    ImageDecoder decoder(size);
    cv::Mat gray, gray_beside_colour, colour;
    ASSERT_TRUE(decoder.colour_image(jpeg, gray, nullptr).ok());
    ASSERT_TRUE(decoder.colour_image(jpeg, gray_beside_colour, &colour).ok());
    EXPECT_TRUE(same_image(gray, gray_beside_colour));
    ASSERT_EQ(colour.type(), CV_8UC3);
    EXPECT_LT(mean_difference(colour, picture), 2.5);
  }
}

TEST(ImageDecode, GrayAndProgressiveJpeg) {
  const cv::Mat picture = gray_picture(64, 48, 0);
  ImageDecoder decoder(picture.size());
  cv::Mat gray, colour;
  const Bytes gray_jpeg = encode(".jpg", picture);
  ASSERT_TRUE(decoder.colour_image(gray_jpeg, gray, &colour).ok());
  EXPECT_TRUE(same_image(gray, cv::imdecode(gray_jpeg, cv::IMREAD_GRAYSCALE)));
  EXPECT_TRUE(same_image(colour, cv::imdecode(gray_jpeg, cv::IMREAD_COLOR)));
  const Bytes progressive = encode(".jpg", colour_picture(64, 48), {cv::IMWRITE_JPEG_PROGRESSIVE, 1});
  ASSERT_TRUE(decoder.colour_image(progressive, gray, nullptr).ok());
  EXPECT_TRUE(same_image(gray, cv::imdecode(progressive, cv::IMREAD_GRAYSCALE)));
}

TEST(ImageDecode, TruncatedJpegIsAnErrorNotHalfAPicture) {
  const Bytes jpeg = encode(".jpg", colour_picture(160, 120));
  ImageDecoder decoder(cv::Size(160, 120));
  cv::Mat gray, colour;
  for (std::size_t length : {std::size_t{3}, std::size_t{100}, jpeg.size() / 2, jpeg.size() - 10}) {
    const Bytes cut(jpeg.begin(), jpeg.begin() + length);
    EXPECT_THAT(decoder.colour_image(cut, gray, nullptr).error().message, HasSubstr("JPEG")) << length;
    EXPECT_FALSE(decoder.colour_image(cut, gray, &colour).ok()) << length;
  }
  EXPECT_TRUE(decoder.colour_image(jpeg, gray, &colour).ok()) << "a bad file spoils the next one";
}

TEST(ImageDecode, GrayOfColourPngIsOpenCvsConversion) {
  const cv::Mat picture = colour_picture(61, 47);
  ImageDecoder decoder(picture.size());
  cv::Mat expected, gray, colour;
  cv::cvtColor(picture, expected, cv::COLOR_BGR2GRAY);
  for (const char* extension : {".png", ".ppm"}) {
    const Bytes file = encode(extension, picture);
    ASSERT_TRUE(decoder.colour_image(file, gray, nullptr).ok());
    EXPECT_TRUE(same_image(gray, expected)) << extension;
    ASSERT_TRUE(decoder.colour_image(file, gray, &colour).ok());
    EXPECT_TRUE(same_image(gray, expected)) << extension;
    EXPECT_TRUE(same_image(colour, picture)) << extension;
  }
}

TEST(ImageDecode, ChecksTheSizeBeforeAnythingIsDecoded) {
  ImageDecoder decoder(cv::Size(64, 48));
  cv::Mat out;
  PngRecipe recipe;
  recipe.width = 7680;
  recipe.height = 4320;
  Bytes png = make_png(recipe, Bytes(7680 * 4320, 3));
  png.resize(png.size() / 2);  // decoding it would fail in another way
  EXPECT_EQ(decoder.colour_image(png, out, nullptr).error().message, "the image is 7680x4320, the camera 64x48");
  EXPECT_EQ(decoder.depth_image(png, out).error().message, "the image is 7680x4320, the camera 64x48");
  const Bytes jpeg = encode(".jpg", gray_picture(1, 1, 0));
  EXPECT_EQ(decoder.colour_image(jpeg, out, nullptr).error().message, "the image is 1x1, the camera 64x48");
}

TEST(ImageDecode, SaysWhichBitsWereWanted) {
  ImageDecoder decoder(cv::Size(64, 48));
  cv::Mat out;
  const Bytes gray8 = encode(".png", gray_picture(64, 48, 0)), gray16 = encode(".png", depth_picture(64, 48, 0)),
              rgb = encode(".png", colour_picture(64, 48)), jpeg = encode(".jpg", gray_picture(64, 48, 0));
  EXPECT_EQ(decoder.depth_image(gray8, out).error().message,
            "a depth image must be 16-bit with one channel, this one is 8-bit with 1 channel");
  EXPECT_THAT(decoder.depth_image(rgb, out).error().message, HasSubstr("8-bit with 3 channels"));
  EXPECT_THAT(decoder.depth_image(jpeg, out).error().message, HasSubstr("8-bit with 1 channel"));
  EXPECT_THAT(decoder.colour_image(gray16, out, nullptr).error().message, HasSubstr("this one is 16-bit"));
  EXPECT_THAT(decoder.label_image(gray16, out).error().message, HasSubstr("a mask must be 8-bit"));
  EXPECT_THAT(decoder.label_image(rgb, out).error().message, HasSubstr("a mask must be 8-bit"));
  EXPECT_THAT(decoder.colour_image(Bytes{1, 2, 3}, out, nullptr).error().message, HasSubstr("not an image"));
}

TEST(ImageDecode, LabelsOfAPalettePngAreItsIndices) {
  PngRecipe recipe;
  recipe.width = 16;
  recipe.height = 2;
  recipe.colour_type = 3;
  Bytes indices(32);
  for (std::size_t i = 0; i < indices.size(); ++i) indices[i] = static_cast<std::uint8_t>(i * 3);
  ImageDecoder decoder(cv::Size(16, 2));
  cv::Mat labels;
  ASSERT_TRUE(decoder.label_image(make_png(recipe, indices), labels).ok());
  EXPECT_TRUE(same_image(labels, cv::Mat(2, 16, CV_8UC1, indices.data())));
}

TEST(ImageDecode, FloatDepthIsTakenAsMetres) {
  cv::Mat metres(48, 64, CV_32FC1, cv::Scalar(1.5f));
  ImageDecoder decoder(metres.size());
  cv::Mat depth;
  ASSERT_TRUE(decoder.depth_image(encode(".tiff", metres), depth).ok());
  EXPECT_TRUE(same_image(depth, metres));
}

TEST(ImageDecode, LeavesEarlierImagesAlone) {
  ImageDecoder decoder(cv::Size(64, 48));
  cv::Mat depth;
  ASSERT_TRUE(decoder.depth_image(encode(".png", depth_picture(64, 48, 1)), depth).ok());
  const cv::Mat earlier = depth;
  ASSERT_TRUE(decoder.depth_image(encode(".png", depth_picture(64, 48, 2)), depth).ok());
  EXPECT_TRUE(same_image(earlier, depth_picture(64, 48, 1)));
}

}  // namespace
}  // namespace semvslam
