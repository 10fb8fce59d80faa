#include "semvslam/apps/progress.h"

#include <fmt/core.h>
#include <unistd.h>

#include <algorithm>

namespace semvslam {
namespace {

constexpr int kBarWidth = 24;

std::string format_time_left(double seconds) {
  const auto s = static_cast<std::int64_t>(seconds + 0.5);
  if (s < 60) return fmt::format("{} s left", s);
  if (s < 3600) return fmt::format("{}:{:02} min left", s / 60, s % 60);
  return fmt::format("{}:{:02} h left", s / 3600, s / 60 % 60);
}

}  // namespace

std::string format_progress(const ProgressState& state) {
  const double rate = state.elapsed_s > 0 ? static_cast<double>(state.done) / state.elapsed_s : 0;
  std::string out;
  if (state.total && *state.total > 0) {
    const auto full = static_cast<int>(kBarWidth * std::min(state.done, *state.total) / *state.total);
    out = fmt::format("[{:#<{}}{:-<{}}] {}/{}", "", full, "", kBarWidth - full, state.done, *state.total);
  } else {
    out = fmt::format("{} {}", state.done, state.unit);
  }
  out += fmt::format("  {:.1f} {}/s", rate, state.unit);
  if (!state.note.empty()) out += "  " + state.note;
  if (state.total && state.done < *state.total && rate > 0)
    out += "  " + format_time_left(static_cast<double>(*state.total - state.done) / rate);
  return out;
}

Progress::Progress(std::optional<std::uint64_t> total, bool quiet, const std::string& unit)
    : quiet_(quiet), terminal_(isatty(STDERR_FILENO) == 1) {
  state_.total = total;
  state_.unit = unit;
}

void Progress::update(std::uint64_t done, const std::string& note) {
  state_.done = done;
  state_.note = note;
  const auto now = Clock::now();
  const auto period = terminal_ ? std::chrono::milliseconds(100) : std::chrono::milliseconds(5000);
  if (quiet_ || ended_ || now - last_drawn_ < period) return;
  draw();
}

void Progress::draw() {
  last_drawn_ = Clock::now();
  state_.elapsed_s = std::chrono::duration<double>(last_drawn_ - start_).count();
  if (terminal_) {
    fmt::print(stderr, "\r{}\x1b[K", format_progress(state_));  // \x1b[K: clear what a longer line left behind
    std::fflush(stderr);
    line_open_ = true;
  } else {
    fmt::print(stderr, "{}\n", format_progress(state_));
  }
}

void Progress::message(const std::string& text) {
  if (quiet_) return;
  fmt::print(stderr, "{}{}\n", line_open_ ? "\r\x1b[K" : "", text);
  if (line_open_) draw();
}

void Progress::end() {
  if (ended_) return;
  ended_ = true;
  if (quiet_ || state_.done == 0) return;
  draw();
  if (line_open_) fmt::print(stderr, "\n");
  line_open_ = false;
}

}  // namespace semvslam
