#pragma once

#include <condition_variable>
#include <cstdint>
#include <filesystem>
#include <mutex>
#include <optional>
#include <string>

#include "semvslam/web/scene.h"
#include "semvslam/web/trajectory_tail.h"

namespace semvslam {

/// What pages must be told about a run's folder, as server-sent events: poses that were appended, and that other files
/// changed. One thread says which files changed, any number of readers wait.
class LiveFeed {
 public:
  /// What one page knows.
  struct Reader {
    LiveCursor at;
    std::uint64_t numbers = 0;  // version of stats.json; a new page is told once, it may have missed one
  };

  explicit LiveFeed(std::filesystem::path folder);

  /// A file of the folder changed. An empty name: any of them may have.
  void file_changed(const std::string& name);
  /// Wakes all readers for good.
  void stop();
  LiveCursor cursor() const;

  /// Waits for what `reader` lacks, and moves it there. @return text of events (`poses`: an array of
  /// format_live_pose(), `numbers`: read the panel again, `scene`: read everything again), each with the cursor as its
  /// id; a comment where nothing happened for so long that the connection should be looked at; nothing after stop().
  std::optional<std::string> wait_for_news(Reader& reader);

 private:
  bool has_news(const Reader& reader) const;
  std::string news_for(Reader& reader) const;

  const std::filesystem::path folder_;
  mutable std::mutex mutex_;
  std::condition_variable changed_;
  TrajectoryTail tail_;
  std::uint64_t generation_ = 1, numbers_ = 1;
  bool is_running_ = false, stopped_ = false;
};

}  // namespace semvslam
