#include "semvslam/web/live_feed.h"

#include <fmt/core.h>

#include <algorithm>
#include <chrono>

#include "semvslam/data/file_io.h"
#include "semvslam/web/run_facts.h"

namespace semvslam {
namespace {

constexpr std::size_t kMostPosesAtOnce = 1000;
constexpr std::chrono::seconds kLongestSilence{15};  // proxies and a page's network stack give up after a minute or so

bool is_running_now(const std::filesystem::path& folder) {
  const Result<std::string> statistics = read_text_file(folder / "stats.json", 1 << 20);
  return statistics && describe_run(*statistics, "").is_running;
}

/// Files that are written as a whole: at the end of a run, two of them now and then before.
bool is_result(const std::string& name) {
  constexpr const char* kResults[] = {"keyframes.txt", "map.ply", "dense.ply", "evaluation.json"};
  return std::find(std::begin(kResults), std::end(kResults), name) != std::end(kResults);
}

std::string event(const char* kind, const LiveCursor& at, const std::string& data) {
  return fmt::format("event: {}\nid: {}:{}\ndata: {}\n\n", kind, at.generation, at.poses, data);
}

}  // namespace

LiveFeed::LiveFeed(std::filesystem::path folder) : folder_(std::move(folder)), tail_(folder_ / "trajectory.txt") {
  tail_.update();
  is_running_ = is_running_now(folder_);
}

void LiveFeed::file_changed(const std::string& name) {
  const bool any = name.empty();
  const std::lock_guard lock(mutex_);
  if (any || is_result(name)) ++generation_;
  if ((any || name == "trajectory.txt") && tail_.update()) ++generation_;
  if (any || name == "stats.json") {
    ++numbers_;
    // The end of a run is when it can be scored: more than numbers change.
    const bool running = is_running_now(folder_);
    if (running != is_running_) ++generation_;
    is_running_ = running;
  }
  changed_.notify_all();
}

void LiveFeed::stop() {
  const std::lock_guard lock(mutex_);
  stopped_ = true;
  changed_.notify_all();
}

LiveCursor LiveFeed::cursor() const {
  const std::lock_guard lock(mutex_);
  return {generation_, tail_.poses().size()};
}

bool LiveFeed::has_news(const Reader& reader) const {
  return reader.at != LiveCursor{generation_, tail_.poses().size()} || reader.numbers != numbers_;
}

std::string LiveFeed::news_for(Reader& reader) const {
  const Trajectory& poses = tail_.poses();
  if (reader.at.generation != generation_ || reader.at.poses > poses.size()) {
    reader = {{generation_, poses.size()}, numbers_};
    return event("scene", reader.at, "");
  }
  std::string out;
  if (reader.at.poses < poses.size()) {
    std::string list;
    const std::size_t end = std::min(poses.size(), reader.at.poses + kMostPosesAtOnce);
    for (std::size_t i = reader.at.poses; i < end; ++i)
      list.append(list.empty() ? "[" : ",").append(format_live_pose(poses[i], poses.front().stamp));
    reader.at.poses = end;
    out += event("poses", reader.at, list + "]");
  }
  if (reader.numbers != numbers_) {
    reader.numbers = numbers_;
    out += event("numbers", reader.at, "");
  }
  return out;
}

std::optional<std::string> LiveFeed::wait_for_news(Reader& reader) {
  std::unique_lock lock(mutex_);
  const bool woken = changed_.wait_for(lock, kLongestSilence, [&] { return stopped_ || has_news(reader); });
  if (stopped_) return std::nullopt;
  return woken ? news_for(reader) : ": still there\n\n";
}

}  // namespace semvslam
