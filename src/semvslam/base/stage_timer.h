#pragma once

#include <array>
#include <chrono>
#include <cstdint>
#include <deque>
#include <mutex>
#include <string>
#include <string_view>
#include <vector>

namespace semvslam {

/// What one stage cost over a whole run, milliseconds of wall time per call. All zero when it never ran.
struct StageSummary {
  std::string name;
  std::uint64_t count = 0;
  double mean_ms = 0, median_ms = 0, p95_ms = 0, max_ms = 0;
};

/// Collects the durations of one stage. Memory is constant (about 8 KB) whatever the length of the run: mean and
/// maximum are exact, quantiles come from a histogram with logarithmic bins and are off by at most 0.5 %. Any number of
/// threads.
class StageTimer {
 public:
  using Clock = std::chrono::steady_clock;

  /// Adds the time between its construction and its destruction.
  class Scope {
   public:
    explicit Scope(StageTimer& timer) : timer_(timer) {}
    ~Scope() { timer_.add_ms(elapsed_ms()); }
    Scope(const Scope&) = delete;
    Scope& operator=(const Scope&) = delete;
    double elapsed_ms() const { return std::chrono::duration<double, std::milli>(Clock::now() - start_).count(); }

   private:
    StageTimer& timer_;
    const Clock::time_point start_ = Clock::now();
  };

  explicit StageTimer(std::string name) : name_(std::move(name)) {}
  /// Negative and non-finite durations count as zero.
  void add_ms(double ms);
  [[nodiscard]] Scope time() { return Scope(*this); }
  StageSummary summary() const;

 private:
  // Bins of 1 % width from 1 microsecond up; the last one starts above 15 minutes.
  static constexpr int kBins = 2080;
  static constexpr double kSmallestMs = 1e-3;
  static constexpr double kRatio = 1.01;
  double quantile_ms(double share) const;  // the caller holds the mutex

  const std::string name_;
  mutable std::mutex mutex_;
  std::uint64_t count_ = 0;
  double sum_ms_ = 0, max_ms_ = 0;
  std::array<std::uint32_t, kBins> bins_{};
};

/// The stages of one pipeline by name. References stay valid as long as this object lives. Any number of threads.
class StageTimers {
 public:
  /// The stage of that name; made at the first call.
  StageTimer& operator[](std::string_view name);
  /// In the order in which the stages were first asked for.
  std::vector<StageSummary> summaries() const;

 private:
  struct Named {
    explicit Named(std::string_view n) : name(n), timer(name) {}
    std::string name;
    StageTimer timer;
  };
  mutable std::mutex mutex_;
  std::deque<Named> stages_;  // a deque: growing moves nothing
};

}  // namespace semvslam
