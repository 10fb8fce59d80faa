#include "semvslam/data/png_decode.h"

#include <fmt/format.h>
#include <gmock/gmock.h>

#include <opencv2/imgcodecs.hpp>
#include <random>

#include "semvslam/data/data_test_support.h"
#include "semvslam/data/image_decode.h"
#include "semvslam/data/png_test_support.h"

namespace semvslam {
namespace {

using namespace testing_support;
using ::testing::HasSubstr;

/// Smooth with noise, so that every filter meets every kind of difference.
Bytes random_pixels(std::size_t count, unsigned seed) {
  std::mt19937 random(seed);
  Bytes pixels(count);
  for (std::size_t i = 0; i < count; ++i)
    pixels[i] = static_cast<std::uint8_t>(i / 3 + random() % (i % 5 == 0 ? 256 : 9));
  return pixels;
}

PngRecipe recipe(std::uint32_t width, std::uint32_t height, int bits, int colour_type) {
  PngRecipe r;
  r.width = width;
  r.height = height;
  r.bits = bits;
  r.colour_type = colour_type;
  r.channels = colour_type == 2 ? 3 : colour_type == 6 ? 4 : colour_type == 4 ? 2 : 1;
  return r;
}

Bytes pixels_for(const PngRecipe& r, unsigned seed = 1) {
  return random_pixels(static_cast<std::size_t>(r.width) * r.height * r.channels * r.bits / 8, seed);
}

std::string png_error(const Bytes& png) {
  PngDecoder decoder;
  const Result<PngPixels> pixels = decoder.decode(png);
  return pixels ? "" : pixels.error().message;
}

struct Kind {
  int bits, colour_type;
};

class PngKinds : public ::testing::TestWithParam<Kind> {};

TEST_P(PngKinds, EveryFilterAndWidthGivesThePixelsBack) {
  PngDecoder decoder;
  for (std::uint32_t width : {1u, 2u, 5u, 15u, 16u, 17u, 33u, 100u}) {
    for (int filter = 0; filter <= 5; ++filter) {
      PngRecipe r = recipe(width, 7, GetParam().bits, GetParam().colour_type);
      r.filters = filter < 5 ? std::vector<int>{filter} : std::vector<int>{4, 1, 3, 2, 0, 4};
      const Bytes pixels = pixels_for(r, width * 10 + filter);
      const Bytes png = make_png(r, pixels);
      const Result<PngPixels> decoded = decoder.decode(png);
      ASSERT_TRUE(decoded.ok()) << decoded.error().message;
      const std::size_t row = pixels.size() / 7;
      for (std::size_t y = 0; y < 7; ++y)
        ASSERT_TRUE(
            std::equal(pixels.begin() + y * row, pixels.begin() + (y + 1) * row, decoded->first + y * decoded->stride))
            << "width " << width << " filter " << filter << " row " << y;
    }
  }
}

INSTANTIATE_TEST_SUITE_P(All, PngKinds, ::testing::Values(Kind{8, 0}, Kind{16, 0}, Kind{8, 2}, Kind{8, 3}, Kind{8, 6}),
                         [](const auto& kind) {
                           return fmt::format("type{}bits{}", kind.param.colour_type, kind.param.bits);
                         });

TEST(PngDecode, JoinsManySmallDataChunks) {
  PngRecipe r = recipe(40, 30, 8, 2);
  r.chunk_bytes = 7;
  r.filters = {4};
  const Bytes pixels = pixels_for(r);
  PngDecoder decoder;
  const Result<PngPixels> decoded = decoder.decode(make_png(r, pixels));
  ASSERT_TRUE(decoded.ok());
  EXPECT_TRUE(std::equal(pixels.begin(), pixels.begin() + 120, decoded->first));
}

TEST(PngDecode, EveryTruncationIsAnError) {
  PngRecipe r = recipe(20, 10, 16, 0);
  r.chunk_bytes = 100;
  const Bytes png = make_png(r, pixels_for(r));
  ASSERT_EQ(png_error(png), "");
  for (std::size_t length = 0; length < png.size(); ++length) {
    const std::string error = png_error(Bytes(png.begin(), png.begin() + length));
    ASSERT_NE(error, "") << length << " of " << png.size() << " bytes";
    EXPECT_FALSE(png_is_whole(Bytes(png.begin(), png.begin() + length)));
  }
  EXPECT_THAT(png_error(Bytes(png.begin(), png.begin() + png.size() / 2)), HasSubstr("truncated"));
  EXPECT_TRUE(png_is_whole(png));
}

TEST(PngDecode, EveryFlippedBitOfTheImageIsAnError) {
  const PngRecipe r = recipe(20, 10, 8, 0);
  const Bytes png = make_png(r, pixels_for(r));
  for (std::size_t i = 0; i < png.size() * 8; ++i) {
    Bytes damaged = png;
    damaged[i / 8] ^= static_cast<std::uint8_t>(1 << i % 8);
    ASSERT_NE(png_error(damaged), "") << "byte " << i / 8;
  }
}

TEST(PngDecode, RefusesAnImageThatItsDataCannotHold) {
  PngRecipe r = recipe(4, 4, 8, 0);
  const Bytes pixels = pixels_for(r);
  r.width = 60000;
  r.height = 60000;
  Bytes png = {0x89, 'P', 'N', 'G', '\r', '\n', 0x1A, '\n'}, header;
  put_32(header, r.width);
  put_32(header, r.height);
  header.insert(header.end(), {16, 0, 0, 0, 0});
  put_chunk(png, "IHDR", header);
  put_chunk(png, "IDAT", zlib(pixels));
  put_chunk(png, "IEND", {});
  EXPECT_THAT(png_error(png), HasSubstr("truncated"));
}

TEST(PngDecode, RefusesAnUnknownFilterAndNoData) {
  PngRecipe r = recipe(4, 4, 8, 0);
  r.filters = {0, 5};
  EXPECT_THAT(png_error(make_png(r, pixels_for(r))), HasSubstr("row filter"));
  r = recipe(4, 4, 8, 0);
  r.chunk_bytes = 1u << 30;
  Bytes png = make_png(r, pixels_for(r));
  const Bytes head(png.begin(), png.begin() + 33);
  Bytes empty = head;
  put_chunk(empty, "IEND", {});
  EXPECT_THAT(png_error(empty), HasSubstr("no image data"));
}

TEST(PngDecode, LeavesUnusualKindsToOthers) {
  PngDecoder decoder;
  for (const Kind kind : {Kind{16, 2}, Kind{8, 4}}) {
    const PngRecipe r = recipe(8, 8, kind.bits, kind.colour_type);
    EXPECT_EQ(decoder.decode(make_png(r, pixels_for(r))).error().code, ErrorCode::kUnsupported);
  }
  PngRecipe r = recipe(8, 8, 8, 0);
  r.interlace = 1;
  EXPECT_EQ(decoder.decode(make_png(r, pixels_for(r))).error().code, ErrorCode::kUnsupported);
}

TEST(PngDecode, EqualsOpenCvOnItsOwnFiles) {
  // Compression 9 makes libpng choose a filter per row.
  for (const std::vector<int>& parameters : {std::vector<int>{}, std::vector<int>{cv::IMWRITE_PNG_COMPRESSION, 9}}) {
    for (int type : {CV_8UC1, CV_16UC1, CV_8UC3, CV_8UC4}) {
      cv::Mat image(97, 131, type);
      cv::randu(image, 0, type == CV_16UC1 ? 60000 : 255);
      cv::Mat smooth = image.clone();
      for (int y = 1; y < image.rows; ++y)
        cv::addWeighted(image.row(y), 0.02, smooth.row(y - 1), 0.98, 0, smooth.row(y));
      Bytes png;
      ASSERT_TRUE(cv::imencode(".png", smooth, png, parameters));
      ImageDecoder decoder(image.size());
      cv::Mat ours, colour;
      if (type == CV_16UC1) {
        ASSERT_TRUE(decoder.depth_image(png, ours).ok());
        EXPECT_TRUE(same_image(ours, cv::imdecode(png, cv::IMREAD_UNCHANGED)));
      } else {
        ASSERT_TRUE(decoder.colour_image(png, ours, &colour).ok());
        EXPECT_TRUE(same_image(colour, cv::imdecode(png, cv::IMREAD_COLOR))) << type;
      }
    }
  }
}

}  // namespace
}  // namespace semvslam
