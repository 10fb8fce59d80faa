#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <vector>

#include "semvslam/base/random.h"

namespace semvslam {

struct RansacOptions {
  std::uint64_t seed = 1;
  double confidence = 0.999;  // that one sample had no outlier, at the inlier share found so far
  int min_iterations = 10, max_iterations = 500;
};

template <typename Model>
struct RansacResult {
  bool found = false;
  Model model{};
  std::vector<std::uint8_t> inlier;  // 1 per datum that fits the model
  int inliers = 0;
  int iterations = 0;
};

/// Samples needed so that one is free of outliers with the confidence asked for.
inline int ransac_iterations(double inlier_share, int sample_size, double confidence, int max_iterations) {
  const double clean = std::pow(inlier_share, sample_size);
  if (!(clean > 0)) return max_iterations;
  if (clean >= 1) return 1;
  const double n = std::ceil(std::log(1 - confidence) / std::log1p(-clean));
  return n < max_iterations ? std::max(1, static_cast<int>(n)) : max_iterations;
}

/// The model that most data agree with: random minimal samples (Fischler & Bolles, CACM 1981), each hypothesis scored
/// by the truncated sum of squared residuals (MSAC: Torr & Zisserman, MLESAC, CVIU 2000). Deterministic for a seed.
/// Problem has: using Model; static constexpr int kSampleSize; std::size_t size() const;
///   void hypotheses(const std::array<std::size_t, kSampleSize>& sample, std::vector<Model>& out) const  (appends, may
///   be none); double squared_residual(const Model&, std::size_t datum) const  (in units of the variance; NaN = does
///   not fit).
/// @param squared_limit residuals up to this are inliers, e.g. a chi^2 quantile.
template <typename Problem>
RansacResult<typename Problem::Model> ransac(const Problem& problem, double squared_limit,
                                             const RansacOptions& options) {
  using Model = typename Problem::Model;
  constexpr std::size_t kSample = Problem::kSampleSize;
  RansacResult<Model> best;
  const std::size_t n = problem.size();
  if (n < kSample) return best;
  Random random(options.seed, "ransac");
  double best_cost = 0;
  std::vector<Model> models;
  int needed = options.max_iterations;
  for (; best.iterations < needed; ++best.iterations) {
    std::array<std::size_t, kSample> sample{};
    for (std::size_t k = 0; k < kSample; ++k) {
      do {
        sample[k] = random.index(n);
      } while (std::find(sample.begin(), sample.begin() + k, sample[k]) != sample.begin() + k);
    }
    models.clear();
    problem.hypotheses(sample, models);
    for (const Model& model : models) {
      double cost = 0;
      int inliers = 0;
      for (std::size_t i = 0; i < n && (!best.found || cost < best_cost); ++i) {
        const double s = problem.squared_residual(model, i);
        const bool fits = s <= squared_limit;
        cost += fits ? s : squared_limit;
        inliers += fits;
      }
      if (inliers < static_cast<int>(kSample) || (best.found && cost >= best_cost)) continue;
      best_cost = cost;
      best.found = true;
      best.model = model;
      best.inliers = inliers;
      needed = std::max(options.min_iterations, ransac_iterations(static_cast<double>(inliers) / static_cast<double>(n),
                                                                  kSample, options.confidence, options.max_iterations));
    }
  }
  best.inlier.assign(n, 0);
  if (best.found)
    for (std::size_t i = 0; i < n; ++i) best.inlier[i] = problem.squared_residual(best.model, i) <= squared_limit;
  return best;
}

}  // namespace semvslam
