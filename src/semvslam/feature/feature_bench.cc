#include <benchmark/benchmark.h>

#include <cstdlib>
#include <opencv2/features2d.hpp>
#include <opencv2/imgcodecs.hpp>
#include <opencv2/imgproc.hpp>
#include <random>

#include "semvslam/feature/corner_refinement.h"
#include "semvslam/feature/corner_selection.h"
#include "semvslam/feature/fast_corners.h"
#include "semvslam/feature/matching.h"
#include "semvslam/feature/orb_extractor.h"
#include "semvslam/feature/oriented_brief.h"
#include "semvslam/feature/pyramid_filters.h"

namespace semvslam {
namespace {

/// The image named by SEMVSLAM_BENCH_IMAGE, else blurred rectangles with noise.
cv::Mat bench_image() {
  if (const char* path = std::getenv("SEMVSLAM_BENCH_IMAGE")) return cv::imread(path, cv::IMREAD_GRAYSCALE);
  cv::Mat image(480, 640, CV_8UC1, cv::Scalar(128)), noise(480, 640, CV_8UC1);
  cv::RNG random(7);
  for (int i = 0; i < 700; ++i) {
    const cv::Rect r(random.uniform(-10, 640), random.uniform(-10, 480), random.uniform(4, 60), random.uniform(4, 60));
    cv::rectangle(image, r, cv::Scalar(random.uniform(0, 256)), cv::FILLED);
  }
  cv::GaussianBlur(image, image, cv::Size(), 1.0);
  random.fill(noise, cv::RNG::NORMAL, 10, 3);
  return image + noise - 10;
}

/// The levels and corners of the image, for the parts one by one.
struct Parts {
  cv::Mat image = bench_image();
  std::vector<cv::Mat> levels, smooth;
  std::vector<std::vector<Corner>> found, taken;

  Parts() {
    cv::setNumThreads(1);
    OrbExtractor extractor{OrbOptions{}};
    OrbFeatures features;
    extractor.extract(image, {}, features);
    std::vector<int> wanted(extractor.pyramid().size());
    for (const Keypoint& k : features.keypoints) ++wanted[k.level];
    FastDetector fast;
    CornerSelector selector(32);
    for (std::size_t l = 0; l < wanted.size(); ++l) {
      levels.push_back(extractor.pyramid()[l].clone());
      smooth.emplace_back(image.size(), CV_8UC1, cv::Scalar(0));
      Smoother().smooth(levels[l], smooth[l]);
      fast.detect(levels[l], 18, 7, found.emplace_back());
      selector.select(found[l], levels[l].cols, levels[l].rows, wanted[l], 0, taken.emplace_back());
    }
  }
};

const Parts& parts() {
  static const Parts instance;
  return instance;
}

void extract(benchmark::State& state) {
  OrbOptions options;
  options.features = static_cast<int>(state.range(0));
  OrbExtractor extractor(options);
  OrbFeatures features;
  for (auto _ : state) extractor.extract(parts().image, {}, features);
  state.counters["features"] = static_cast<double>(features.size());
}
BENCHMARK(extract)->Arg(500)->Arg(1000)->Arg(2000)->Unit(benchmark::kMicrosecond);

void extract_opencv_orb(benchmark::State& state) {
  const auto orb = cv::ORB::create(1000, 1.2f, 8, 19, 0, 2, cv::ORB::HARRIS_SCORE, 31, 20);
  std::vector<cv::KeyPoint> keypoints;
  cv::Mat descriptors;
  for (auto _ : state) orb->detectAndCompute(parts().image, {}, keypoints, descriptors);
  state.counters["features"] = static_cast<double>(keypoints.size());
}
BENCHMARK(extract_opencv_orb)->Unit(benchmark::kMicrosecond);

void share_shrink(benchmark::State& state) {
  const auto& levels = parts().levels;
  std::vector<cv::Mat> out;
  for (const cv::Mat& level : levels) out.emplace_back(level.size(), CV_8UC1);
  Shrinker shrinker;
  for (auto _ : state) {
    for (std::size_t l = 1; l < levels.size(); ++l) shrinker.shrink(levels[l - 1], out[l]);
  }
}
BENCHMARK(share_shrink)->Unit(benchmark::kMicrosecond);

void share_fast(benchmark::State& state) {
  FastDetector fast;
  std::vector<Corner> found;
  for (auto _ : state) {
    for (const cv::Mat& level : parts().levels) fast.detect(level, 18, 7, found);
  }
}
BENCHMARK(share_fast)->Unit(benchmark::kMicrosecond);

void share_selection(benchmark::State& state) {
  CornerSelector selector(32);
  std::vector<Corner> corners, taken;
  for (auto _ : state) {
    for (std::size_t l = 0; l < parts().levels.size(); ++l) {
      const cv::Mat& level = parts().levels[l];
      corners = parts().found[l];
      selector.drop_weak(corners, level.cols, level.rows, 20);
      selector.select(corners, level.cols, level.rows, static_cast<int>(parts().taken[l].size()), 30, taken);
    }
  }
}
BENCHMARK(share_selection)->Unit(benchmark::kMicrosecond);

void share_smooth(benchmark::State& state) {
  Smoother smoother;
  cv::Mat out(parts().image.size(), CV_8UC1);
  for (auto _ : state) {
    for (const cv::Mat& level : parts().levels) smoother.smooth(level, out);
  }
}
BENCHMARK(share_smooth)->Unit(benchmark::kMicrosecond);

/// f(pixel of the level, pixel of the smoothed level, their strides) for every corner taken.
template <typename F>
void for_each_corner(F&& f) {
  for (std::size_t l = 0; l < parts().levels.size(); ++l) {
    const cv::Mat &level = parts().levels[l], &smooth = parts().smooth[l];
    for (const Corner& c : parts().taken[l])
      f(level.ptr(c.y) + c.x, level.step[0], smooth.ptr(c.y) + c.x, smooth.step[0]);
  }
}

void share_refinement(benchmark::State& state) {
  for (auto _ : state) {
    for (std::size_t l = 0; l < parts().levels.size(); ++l) {
      const cv::Mat& level = parts().levels[l];
      const cv::Rect inside(18, 18, level.cols - 36, level.rows - 36);
      for (const Corner& c : parts().taken[l]) benchmark::DoNotOptimize(refine_corner(level, c.x, c.y, inside));
    }
  }
}
BENCHMARK(share_refinement)->Unit(benchmark::kMicrosecond);

void share_orientation(benchmark::State& state) {
  for (auto _ : state) {
    for_each_corner([](const std::uint8_t* p, std::size_t stride, const std::uint8_t*, std::size_t) {
      benchmark::DoNotOptimize(patch_angle_rad(p, static_cast<std::ptrdiff_t>(stride)));
    });
  }
}
BENCHMARK(share_orientation)->Unit(benchmark::kMicrosecond);

void share_descriptor(benchmark::State& state) {
  OrientedBrief brief;
  brief.set_stride(static_cast<std::ptrdiff_t>(parts().smooth[0].step[0]));
  float angle = 0;
  for (auto _ : state) {
    for_each_corner([&](const std::uint8_t*, std::size_t, const std::uint8_t* p, std::size_t) {
      angle = angle < 6.f ? angle + 0.61f : angle - 6.f;
      benchmark::DoNotOptimize(brief.describe(p, angle));
    });
  }
}
BENCHMARK(share_descriptor)->Unit(benchmark::kMicrosecond);

std::vector<Descriptor> random_descriptors(std::size_t n, std::uint64_t seed) {
  std::mt19937_64 random(seed);
  std::vector<Descriptor> descriptors(n);
  for (Descriptor& d : descriptors) d = {random(), random(), random(), random()};
  return descriptors;
}

void match_brute_force_1000(benchmark::State& state) {
  const auto a = random_descriptors(1000, 1), b = random_descriptors(1000, 2);
  std::vector<Match> out;
  for (auto _ : state) match_brute_force(a, b, {.max_distance = 256, .ratio = 1.f}, out);
}
BENCHMARK(match_brute_force_1000)->Unit(benchmark::kMicrosecond);

void match_brute_force_opencv(benchmark::State& state) {
  const auto a = random_descriptors(1000, 1), b = random_descriptors(1000, 2);
  const auto mat = [](const std::vector<Descriptor>& d) {
    return cv::Mat(static_cast<int>(d.size()), 32, CV_8UC1, const_cast<Descriptor*>(d.data()));
  };
  cv::BFMatcher matcher(cv::NORM_HAMMING, true);
  std::vector<cv::DMatch> out;
  for (auto _ : state) matcher.match(mat(a), mat(b), out);
}
BENCHMARK(match_brute_force_opencv)->Unit(benchmark::kMicrosecond);

/// Landmarks against an image: `range` queries, half of them with a true partner, radius 15 px.
void match_projected_1000_features(benchmark::State& state) {
  std::mt19937 random(4);
  std::uniform_real_distribution<float> x(0, 640), y(0, 480);
  OrbFeatures features;
  features.descriptors = random_descriptors(1000, 3);
  std::vector<float> xs, ys;
  for (std::size_t i = 0; i < 1000; ++i) {
    xs.push_back(x(random));
    ys.push_back(y(random));
    features.keypoints.push_back({xs[i], ys[i], 0, 0, static_cast<std::uint8_t>(i % 8)});
  }
  std::vector<ProjectedQuery> queries;
  for (std::size_t i = 0; i < static_cast<std::size_t>(state.range(0)); ++i) {
    const int level = static_cast<int>(i % 8);
    queries.push_back({xs[i % 1000], ys[i % 1000], 15, level - 1, level + 1,
                       i % 2 ? features.descriptors[i % 1000] : Descriptor{i, i, i, i}, 0});
  }
  ImageGrid grid;
  std::vector<Match> out;
  for (auto _ : state) {
    grid.build(xs, ys, 640, 480);
    match_projected(queries, features, grid, {.check_rotation = true}, out);
  }
  state.counters["matches"] = static_cast<double>(out.size());
}
BENCHMARK(match_projected_1000_features)->Arg(1000)->Arg(3000)->Unit(benchmark::kMicrosecond);

}  // namespace
}  // namespace semvslam
