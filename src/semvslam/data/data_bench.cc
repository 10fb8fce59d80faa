// Decoding of one recorded frame, ours and OpenCV's side by side. SEMVSLAM_BENCH_SEQUENCE names a sequence folder in
// TUM layout; without it pictures are made up (noisy, so their files are of a real recording's size).
#include <benchmark/benchmark.h>

#include <cstdlib>
#include <opencv2/imgcodecs.hpp>
#include <opencv2/imgproc.hpp>

#include "semvslam/data/file_io.h"
#include "semvslam/data/image_decode.h"
#include "semvslam/data/prefetch.h"
#include "semvslam/data/sequence.h"
#include "semvslam/data/sequence_layout.h"

namespace semvslam {
namespace {

using Bytes = std::vector<std::uint8_t>;
constexpr std::size_t kFiles = 20;

struct Files {
  std::vector<Bytes> colour, colour_png, depth;
  cv::Size size;
};

cv::Mat made_up_colour(int seed) {
  cv::Mat image(480, 640, CV_8UC3);
  cv::RNG random(static_cast<std::uint64_t>(seed) + 1);
  random.fill(image, cv::RNG::UNIFORM, 0, 255);
  cv::GaussianBlur(image, image, {}, 2.5);
  return image;
}

cv::Mat made_up_depth(int seed) {
  cv::Mat noise(480, 640, CV_16SC1), depth(480, 640, CV_16UC1);
  cv::RNG random(static_cast<std::uint64_t>(seed) + 1);
  random.fill(noise, cv::RNG::NORMAL, 0, 8);
  for (int y = 0; y < 480; ++y)
    for (int x = 0; x < 640; ++x)
      depth.at<std::uint16_t>(y, x) =
          static_cast<std::uint16_t>(8000 + 3 * x + 2 * y + (noise.at<std::int16_t>(y, x) / 8) * 8);
  return depth;
}

Files load_files() {
  Files files;
  files.size = {640, 480};
  const char* folder = std::getenv("SEMVSLAM_BENCH_SEQUENCE");
  const Result<SequenceLayout> layout =
      folder ? detect_layout(folder, 0.02) : Result<SequenceLayout>(Error{ErrorCode::kNotFound, ""});
  for (std::size_t i = 0; i < kFiles; ++i) {
    Bytes colour, png, depth;
    if (layout) {
      const ImagePair& pair = layout->pairs.pairs[i * layout->pairs.pairs.size() / kFiles];
      static_cast<void>(read_binary_file(std::filesystem::path(folder) / pair.colour_file, colour).ok());
      static_cast<void>(read_binary_file(std::filesystem::path(folder) / pair.depth_file, depth).ok());
    } else {
      cv::imencode(".jpg", made_up_colour(static_cast<int>(i)), colour);
      cv::imencode(".png", made_up_depth(static_cast<int>(i)), depth);
    }
    const cv::Mat picture = cv::imdecode(colour, cv::IMREAD_COLOR);
    files.size = picture.size();
    cv::imencode(".png", picture, png, {cv::IMWRITE_PNG_COMPRESSION, 6});  // all row filters
    files.colour.push_back(std::move(colour));
    files.colour_png.push_back(std::move(png));
    files.depth.push_back(std::move(depth));
  }
  return files;
}

const Files& files() {
  static const Files loaded = load_files();
  return loaded;
}

template <typename Decode>
void each_file(benchmark::State& state, const std::vector<Bytes>& of, Decode decode) {
  std::size_t i = 0;
  for (auto _ : state) {
    if (!decode(of[i++ % of.size()])) state.SkipWithError("a file was not decoded");
  }
}

void gray_ours(benchmark::State& state, const std::vector<Bytes>& of) {
  ImageDecoder decoder(files().size);
  each_file(state, of, [&](const Bytes& file) {
    cv::Mat gray;
    return decoder.colour_image(file, gray, nullptr).ok();
  });
}

void colour_ours(benchmark::State& state, const std::vector<Bytes>& of) {
  ImageDecoder decoder(files().size);
  each_file(state, of, [&](const Bytes& file) {
    cv::Mat gray, colour;
    return decoder.colour_image(file, gray, &colour).ok();
  });
}

void opencv(benchmark::State& state, const std::vector<Bytes>& of, int mode) {
  each_file(state, of, [&](const Bytes& file) { return !cv::imdecode(file, mode).empty(); });
}

void colour_opencv(benchmark::State& state, const std::vector<Bytes>& of) {
  each_file(state, of, [&](const Bytes& file) {
    cv::Mat gray;
    cv::cvtColor(cv::imdecode(file, cv::IMREAD_COLOR), gray, cv::COLOR_BGR2GRAY);
    return true;
  });
}

void jpeg_gray_ours(benchmark::State& state) { gray_ours(state, files().colour); }
void jpeg_gray_opencv(benchmark::State& state) { opencv(state, files().colour, cv::IMREAD_GRAYSCALE); }
void jpeg_colour_and_gray_ours(benchmark::State& state) { colour_ours(state, files().colour); }
void jpeg_colour_and_gray_opencv(benchmark::State& state) { colour_opencv(state, files().colour); }
void png_gray_ours(benchmark::State& state) { gray_ours(state, files().colour_png); }
void png_gray_opencv(benchmark::State& state) { opencv(state, files().colour_png, cv::IMREAD_GRAYSCALE); }
void png_colour_and_gray_ours(benchmark::State& state) { colour_ours(state, files().colour_png); }
void png_colour_and_gray_opencv(benchmark::State& state) { colour_opencv(state, files().colour_png); }

void png_depth_ours(benchmark::State& state) {
  ImageDecoder decoder(files().size);
  each_file(state, files().depth, [&](const Bytes& file) {
    cv::Mat depth;
    return decoder.depth_image(file, depth).ok();
  });
}
void png_depth_opencv(benchmark::State& state) { opencv(state, files().depth, cv::IMREAD_UNCHANGED); }

BENCHMARK(jpeg_gray_ours)->Unit(benchmark::kMillisecond);
BENCHMARK(jpeg_gray_opencv)->Unit(benchmark::kMillisecond);
BENCHMARK(jpeg_colour_and_gray_ours)->Unit(benchmark::kMillisecond);
BENCHMARK(jpeg_colour_and_gray_opencv)->Unit(benchmark::kMillisecond);
BENCHMARK(png_gray_ours)->Unit(benchmark::kMillisecond);
BENCHMARK(png_gray_opencv)->Unit(benchmark::kMillisecond);
BENCHMARK(png_colour_and_gray_ours)->Unit(benchmark::kMillisecond);
BENCHMARK(png_colour_and_gray_opencv)->Unit(benchmark::kMillisecond);
BENCHMARK(png_depth_ours)->Unit(benchmark::kMillisecond);
BENCHMARK(png_depth_opencv)->Unit(benchmark::kMillisecond);

/// Files to frames, everything included: colour not wanted, masks none. The argument: read-ahead, 0 = none.
void sequence_frame(benchmark::State& state) {
  const char* folder = std::getenv("SEMVSLAM_BENCH_SEQUENCE");
  if (!folder) {
    state.SkipWithError("set SEMVSLAM_BENCH_SEQUENCE");
    return;
  }
  std::unique_ptr<FrameSource> source;
  for (auto _ : state) {
    while (true) {
      if (!source) {
        Result<std::unique_ptr<FrameSource>> opened = open_sequence(folder, {});
        if (!opened) return state.SkipWithError(opened.error().message.c_str());
        source = state.range(0) > 0 ? prefetch(std::move(*opened), static_cast<std::size_t>(state.range(0)))
                                    : std::move(*opened);
      }
      const auto frame = source->next();
      if (frame && frame->has_value()) break;
      source.reset();
    }
  }
}
BENCHMARK(sequence_frame)->Arg(0)->Arg(4)->Unit(benchmark::kMillisecond)->UseRealTime();

}  // namespace
}  // namespace semvslam
