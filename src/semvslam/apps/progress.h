#pragma once

#include <chrono>
#include <cstdint>
#include <cstdio>
#include <optional>
#include <string>

namespace semvslam {

/// What a progress line shows.
struct ProgressState {
  std::uint64_t done = 0;
  std::optional<std::uint64_t> total;
  double elapsed_s = 0;
  std::string note;  // e.g. "tracking"
  std::string unit = "frames";
};

/// One line without its end: a bar where the total is known, count, rate, note and the time left.
std::string format_progress(const ProgressState& state);

/// Shows how far a long command is, on standard error: a line that is redrawn (ten times a second at most) on a
/// terminal, a plain line every five seconds otherwise. One thread.
class Progress {
 public:
  Progress(std::optional<std::uint64_t> total, bool quiet, const std::string& unit = "frames");
  ~Progress() { end(); }
  Progress(const Progress&) = delete;
  Progress& operator=(const Progress&) = delete;

  void update(std::uint64_t done, const std::string& note);
  /// A message of its own line; the progress line is drawn again below it.
  void message(const std::string& text);
  /// Draws the last state and ends the line. Further updates draw nothing.
  void end();

 private:
  using Clock = std::chrono::steady_clock;
  void draw();

  const bool quiet_, terminal_;
  const Clock::time_point start_ = Clock::now();
  Clock::time_point last_drawn_ = start_;
  ProgressState state_;
  bool line_open_ = false, ended_ = false;
};

}  // namespace semvslam
