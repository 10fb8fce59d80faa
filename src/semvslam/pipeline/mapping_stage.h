#pragma once

#include <condition_variable>
#include <cstdint>
#include <exception>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <thread>
#include <variant>
#include <vector>

#include "semvslam/base/bounded_queue.h"
#include "semvslam/base/stage_timer.h"
#include "semvslam/mapping/mapper.h"
#include "semvslam/pipeline/config.h"
#include "semvslam/tracking/messages.h"
#include "semvslam/tracking/tracker.h"

namespace semvslam {

/// The mapper on a thread of its own, or on the calling one when deterministic. Between it and tracking: a bounded
/// queue of requests one way, a slot with the newest local map, and where a lost frame was found, the other. Everything
/// but query(), newest_map() and status() belongs to the thread of tracking.
class MappingStage {
 public:
  /// @param config must outlive this, as `timers` must.
  MappingStage(const Config& config, Map map, StageTimers& timers);
  ~MappingStage();

  /// Waits where the queue is full; for the first key frame of a map or of a sub-map until its snapshot is there.
  void submit(KeyFrameRequest request);
  void submit(const LocalMapRequest& request);
  /// Not every request is followed: lost for long, the camera may be in a place that is not in the map. On a recording
  /// the search has ended when this returns.
  void submit(SearchRequest request);
  bool has_room() const { return requests_.size() < static_cast<std::size_t>(config_.mapping_queue); }

  /// Lets tracking go on from where a lost frame was found, if that is so. @return whether it does.
  bool resume(Tracker& tracker);
  /// The camera is not lost: searches are counted anew.
  void end_of_searches();
  /// Whether a lost camera was looked for often enough to begin a sub-map.
  bool searched_in_vain() const;
  /// What has happened to the map that is worth telling, each one line and once.
  std::vector<std::string> take_events();
  /// Works off what was submitted, then adjusts the whole map; further calls do nothing. @return as status().
  Status finish();

  std::shared_ptr<const LocalMap> newest_map() const;
  /// What broke off mapping, if anything.
  Status status() const;
  /// Calls `query` with the Mapper as it is between two steps.
  template <typename Query>
  auto query(const Query& query) const {
    std::lock_guard lock(map_mutex_);
    return query(mapper_);
  }

 private:
  using Request = std::variant<KeyFrameRequest, LocalMapRequest, SearchRequest>;

  void map_key_frame(KeyFrameRequest request);
  void renew_local_map(const LocalMapRequest& request);
  void search(const SearchRequest& request);
  void publish(std::shared_ptr<const LocalMap> local);
  void run();
  void start();
  void wait_for_map_of(FrameId frame);

  const Config& config_;
  StageTimers& timers_;
  mutable std::mutex map_mutex_;  // a query never sees half a mapping step
  Mapper mapper_;
  BoundedQueue<Request> requests_;  // blocks when full, unless realtime: then the tracker asks again later

  mutable std::mutex slot_mutex_;  // of all up to failure_
  std::condition_variable published_;
  std::shared_ptr<const LocalMap> newest_;
  bool searching_ = false;           // a lost frame is being looked for; one at a time
  int in_vain_ = 0;                  // searches in a row
  std::optional<FoundAgain> found_;  // taken by the next frame
  std::vector<std::string> events_;
  std::exception_ptr failure_;

  std::uint64_t wanted_ = 0;  // searches in a row that were asked for
  bool finished_ = false;
  std::jthread thread_;
};

}  // namespace semvslam
