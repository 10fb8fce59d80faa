#include "semvslam/render/sensor.h"

#include <algorithm>
#include <cmath>

#include "semvslam/render/noise.h"
#include "semvslam/render/parallel.h"
#include "semvslam/render/random.h"

namespace semvslam::render {
namespace {

constexpr std::size_t kTableSize = 1u << 16;
constexpr int kWaveSide = 256;
constexpr int kRowsPerTask = 32;
constexpr float kMinRange_m = 0.45f, kMaxRange_m = 8.0f;
constexpr float kDisparityStep_px = 0.125f;
constexpr float kDisparityNoise_px = 0.07f;  // correlated part
constexpr float kLateralNoise_px = 0.45f;
constexpr float kVignette = 0.16f;    // loss in the corners
constexpr float kShotNoise = 0.115f;  // sigma = sqrt(read^2 + shot^2 * level), grey levels
constexpr float kReadNoise = 1.1f;

}  // namespace

SensorModel::SensorModel(const Camera& camera) : camera_(camera), normal_table_(kTableSize) {
  RandomStream random(90210);
  for (float& value : normal_table_) value = static_cast<float>(random.normal());
  wave_table_.resize(kWaveSide * kWaveSide);
  for (int i = 0; i < kWaveSide * kWaveSide; ++i) {
    const auto x = static_cast<float>(i % kWaveSide), y = static_cast<float>(i / kWaveSide);
    wave_table_[i] = 2.f * value_noise(x * 0.25f, y * 0.25f, 4711, kWaveSide / 4) - 1.f;
  }
  vignette_.resize(static_cast<std::size_t>(camera.width_px) * camera.height_px);
  const double cx = (camera.width_px - 1) / 2.0, cy = (camera.height_px - 1) / 2.0, reach = cx * cx + cy * cy + 1e-9;
  for (int y = 0; y < camera.height_px; ++y) {
    for (int x = 0; x < camera.width_px; ++x) {
      const double r2 = ((x - cx) * (x - cx) + (y - cy) * (y - cy)) / reach;
      vignette_[static_cast<std::size_t>(y) * camera.width_px + x] =
          static_cast<float>(1 - kVignette * r2 * (0.6 + 0.4 * r2));
    }
  }
}

cv::Mat SensorModel::measure_depth(const Picture& picture, std::uint64_t frame_seed, int threads) const {
  const int width = camera_.width_px, height = camera_.height_px;
  cv::Mat out(height, width, CV_16UC1);
  const float focal_baseline = static_cast<float>(camera_.fx_px * camera_.baseline_m);
  const float units = static_cast<float>(camera_.depth_units_per_m);
  const auto seed = static_cast<std::uint32_t>(mix64(frame_seed, 1));
  const int shift_x = static_cast<int>(seed & 0xff), shift_y = static_cast<int>(seed >> 8 & 0xff);
  const int tasks = (height + kRowsPerTask - 1) / kRowsPerTask;
  parallel_for(tasks, threads, [&](int task, int) {
    std::vector<std::uint8_t> shadow(width);
    for (int y = task * kRowsPerTask; y < std::min(height, (task + 1) * kRowsPerTask); ++y) {
      const auto* depth = picture.depth_m.ptr<float>(y);
      const auto* cosine = picture.cosine.ptr<float>(y);
      const auto* colour = picture.colour.ptr<cv::Vec3b>(y);
      auto* row = out.ptr<std::uint16_t>(y);
      // The projector stands to the right: it sees pixel x at column x - f b / z. Walking from the right, what does not
      // come out left of everything before is hidden from it.
      float leftmost = 1e30f;
      for (int x = width - 1; x >= 0; --x) {
        const float seen = depth[x] > 0 ? static_cast<float>(x) - focal_baseline / depth[x] : -1e30f;
        shadow[x] = depth[x] > 0 && seen > leftmost + 1.5f;
        if (depth[x] > 0) leftmost = std::min(leftmost, seen);
      }
      const std::size_t start = mix64(frame_seed, y) % kTableSize;
      const float* waves = wave_table_.data() + ((y + shift_y) & (kWaveSide - 1)) * kWaveSide;
      for (int x = 0; x < width; ++x) {
        auto normal = [&](std::size_t k) {
          return normal_table_[(start + 3 * static_cast<std::size_t>(x) + k) & (kTableSize - 1)];
        };
        const int sx = std::clamp(x + static_cast<int>(std::floor(kLateralNoise_px * normal(0) + 0.5f)), 0, width - 1);
        const int sy = std::clamp(y + static_cast<int>(std::floor(kLateralNoise_px * normal(1) + 0.5f)), 0, height - 1);
        const float z = picture.depth_m.at<float>(sy, sx);
        row[x] = 0;
        if (shadow[x] || z < kMinRange_m || z > kMaxRange_m) continue;
        // Holes come in patches: smooth noise against a chance that grows at grazing, dark and far surfaces.
        const float luma = (static_cast<float>(colour[x][0]) + 2.f * static_cast<float>(colour[x][1]) +
                            static_cast<float>(colour[x][2])) /
                           4.f;
        const float chance = 0.9f * smooth_step(0.30f, 0.05f, cosine[x]) + 0.75f * smooth_step(26.f, 4.f, luma) +
                             0.7f * smooth_step(5.0f, 8.0f, z) + 0.004f;
        if (chance > 0.005f) {
          const float patch =
              fractal_noise(static_cast<float>(x) * 0.15f, static_cast<float>(y) * 0.15f, seed, 4096, 2);
          if (patch < 0.14f + 0.62f * chance) continue;
        } else if (normal(2) < -2.9f) {
          continue;
        }
        const float wave = waves[(x + shift_x) & (kWaveSide - 1)];
        const float disparity = focal_baseline / z + kDisparityNoise_px * (1.7f * wave + 0.5f * normal(2));
        const float rounded = kDisparityStep_px * std::floor(disparity / kDisparityStep_px + 0.5f);
        if (rounded <= 0.f) continue;
        const float value = focal_baseline / rounded * units + 0.5f;
        row[x] = value < 65535.f ? static_cast<std::uint16_t>(value) : 0;
      }
    }
  });
  return out;
}

void SensorModel::disturb_colour(cv::Mat& colour, std::uint64_t frame_seed, int threads) const {
  const int tasks = (colour.rows + kRowsPerTask - 1) / kRowsPerTask;
  float sigma[256];
  for (int i = 0; i < 256; ++i)
    sigma[i] = std::sqrt(kReadNoise * kReadNoise + kShotNoise * kShotNoise * static_cast<float>(i));
  parallel_for(tasks, threads, [&](int task, int) {
    for (int y = task * kRowsPerTask; y < std::min(colour.rows, (task + 1) * kRowsPerTask); ++y) {
      auto* row = colour.ptr<cv::Vec3b>(y);
      const float* vignette = vignette_.data() + static_cast<std::size_t>(y) * colour.cols;
      std::size_t k = mix64(frame_seed, 100003 + y) % kTableSize;
      float carry[3] = {0, 0, 0};
      for (int x = 0; x < colour.cols; ++x) {
        const float common = normal_table_[k++ & (kTableSize - 1)];
        for (int c = 0; c < 3; ++c) {
          const float own = normal_table_[k++ & (kTableSize - 1)];
          // 0.8 of grey noise, 0.6 of colour noise, a third carried over to the right as demosaicing does.
          const float noise = 0.8f * common + 0.6f * own;
          const float value =
              static_cast<float>(row[x][c]) * vignette[x] + sigma[row[x][c]] * (0.95f * noise + 0.31f * carry[c]);
          carry[c] = noise;
          row[x][c] = static_cast<std::uint8_t>(std::clamp(value + 0.5f, 0.f, 255.f));
        }
      }
    }
  });
}

}  // namespace semvslam::render
