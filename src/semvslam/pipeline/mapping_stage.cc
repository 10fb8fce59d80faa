#include "semvslam/pipeline/mapping_stage.h"

#include <fmt/format.h>

#include <utility>

namespace semvslam {

MappingStage::MappingStage(const Config& config, Map map, StageTimers& timers)
    : config_(config),
      timers_(timers),
      mapper_(config.mapping, std::move(map)),
      requests_(static_cast<std::size_t>(config.mapping_queue)) {}

MappingStage::~MappingStage() {
  requests_.close();
  if (thread_.joinable()) thread_.join();
}

void MappingStage::map_key_frame(KeyFrameRequest request) {
  std::shared_ptr<const LocalMap> local;
  std::string event;
  {
    std::lock_guard lock(map_mutex_);
    const Map& map = mapper_.map();
    NewKeyFrame key_frame{
        request.frame,     request.stamp, {}, std::move(request.features), std::move(request.landmarks),
        map.next_sub_map()};
    if (request.reference.valid()) {
      key_frame.camera_from_world = request.camera_from_reference * map.camera_from_world(request.reference).value();
      key_frame.sub_map = map.sub_map_of(request.reference);
    }
    for (const LandmarkUse& use : request.uses)
      mapper_.count_use(use.landmark, use.visible, use.found, use.seen_through);
    local = mapper_.step(key_frame);
    if (const std::optional<SubMapJoin>& join = mapper_.joined())
      event = fmt::format("frame {} at {:.6f} s: sub-map {} is joined with sub-map {}", request.frame.value,
                          request.stamp.seconds(), number_of(join->from), number_of(join->into));
    const MappingTimes& t = mapper_.times();
    timers_["mapping.create"].add_ms(t.create_ms);
    timers_["mapping.join"].add_ms(t.join_ms);
    timers_["mapping.revisit"].add_ms(t.revisit_ms);
    timers_["mapping.loop"].add_ms(t.loop_ms);
    timers_["mapping.fuse"].add_ms(t.fuse_ms);
    timers_["mapping.bundle"].add_ms(t.bundle_ms);
    timers_["mapping.cull"].add_ms(t.cull_ms);
    timers_["mapping"].add_ms(t.total_ms);
  }
  if (!event.empty()) {
    std::lock_guard lock(slot_mutex_);
    events_.push_back(std::move(event));
  }
  publish(std::move(local));
}

void MappingStage::renew_local_map(const LocalMapRequest& request) {
  std::shared_ptr<const LocalMap> local;
  {
    std::lock_guard lock(map_mutex_);
    const auto timer = timers_["mapping.local_map"].time();
    local = mapper_.local_map(request.reference);
  }
  publish(std::move(local));
}

void MappingStage::search(const SearchRequest& request) {
  std::optional<FoundAgain> again;
  {
    std::lock_guard lock(map_mutex_);
    const auto timer = timers_["mapping.relocalise"].time();
    if (std::optional<Relocalisation> r = mapper_.relocalise(*request.features)) {
      const SE3 reference = mapper_.map().key_frame(r->key_frame)->camera_from_world;
      again = FoundAgain{request.features,
                         std::move(r->landmarks),
                         {r->key_frame, r->camera_from_world * reference.inverse()},
                         mapper_.local_map(r->key_frame)};
    }
  }
  {
    std::lock_guard lock(slot_mutex_);
    found_ = std::move(again);
    if (!found_) ++in_vain_;
    searching_ = false;
  }
  published_.notify_all();
}

void MappingStage::publish(std::shared_ptr<const LocalMap> local) {
  {
    std::lock_guard lock(slot_mutex_);
    newest_ = std::move(local);
  }
  published_.notify_all();
}

void MappingStage::run() {
  try {
    while (std::optional<Request> request = requests_.pop()) {
      if (auto* key_frame = std::get_if<KeyFrameRequest>(&*request))
        map_key_frame(std::move(*key_frame));
      else if (auto* local_map = std::get_if<LocalMapRequest>(&*request))
        renew_local_map(*local_map);
      else
        search(std::get<SearchRequest>(*request));
    }
  } catch (...) {
    {
      std::lock_guard lock(slot_mutex_);
      failure_ = std::current_exception();
    }
    requests_.close();
    published_.notify_all();
  }
}

void MappingStage::start() {
  if (!thread_.joinable()) thread_ = std::jthread([this] { run(); });
}

void MappingStage::wait_for_map_of(FrameId frame) {
  std::unique_lock lock(slot_mutex_);
  published_.wait(lock, [&] { return (newest_ && newest_->reference_frame == frame) || failure_ != nullptr; });
}

void MappingStage::submit(KeyFrameRequest request) {
  const bool first = !request.reference.valid();
  const FrameId frame = request.frame;
  if (config_.deterministic) return map_key_frame(std::move(request));
  start();
  requests_.push(std::move(request));
  // Nothing can be tracked before there is a map, and the first one takes a millisecond.
  if (first) wait_for_map_of(frame);
}

void MappingStage::submit(const LocalMapRequest& request) {
  if (config_.deterministic) return renew_local_map(request);
  start();
  requests_.push(request);
}

void MappingStage::submit(SearchRequest request) {
  constexpr std::uint64_t kEvery = 5;
  if (++wanted_ > kEvery && wanted_ % kEvery != 0) return;
  if (config_.deterministic) return search(request);
  {
    std::lock_guard lock(slot_mutex_);
    if (searching_) return;
    searching_ = true;
  }
  start();
  Request wrapped = std::move(request);
  if (config_.realtime) {
    if (requests_.try_push(wrapped)) return;  // found by a later frame
    std::lock_guard lock(slot_mutex_);
    searching_ = false;
  } else if (requests_.push(std::move(wrapped))) {
    // A recording has time: no more frames than this one are lost.
    std::unique_lock lock(slot_mutex_);
    published_.wait(lock, [&] { return !searching_ || failure_ != nullptr; });
  }
}

bool MappingStage::resume(Tracker& tracker) {
  std::lock_guard lock(slot_mutex_);
  const std::optional<FoundAgain> found = std::exchange(found_, std::nullopt);
  if (!found || !tracker.resume(*found)) return false;
  newest_ = found->local;
  return true;
}

void MappingStage::end_of_searches() {
  wanted_ = 0;
  std::lock_guard lock(slot_mutex_);
  in_vain_ = 0;
}

bool MappingStage::searched_in_vain() const {
  std::lock_guard lock(slot_mutex_);
  return !searching_ && in_vain_ >= config_.mapping.sub_maps.after_searches;
}

std::vector<std::string> MappingStage::take_events() {
  std::lock_guard lock(slot_mutex_);
  return std::exchange(events_, {});
}

std::shared_ptr<const LocalMap> MappingStage::newest_map() const {
  std::lock_guard lock(slot_mutex_);
  return newest_;
}

Status MappingStage::status() const {
  std::lock_guard lock(slot_mutex_);
  if (!failure_) return Status::success();
  try {
    std::rethrow_exception(failure_);
  } catch (const std::exception& e) {
    return Error{ErrorCode::kInternal, fmt::format("mapping stopped: {}", e.what())};
  }
}

Status MappingStage::finish() {
  requests_.close();
  if (thread_.joinable()) thread_.join();
  Status ended = status();
  if (!ended || std::exchange(finished_, true)) return ended;
  std::lock_guard lock(map_mutex_);
  const auto timer = timers_["mapping.final_bundle"].time();
  for (int i = 0; i < config_.mapping.final_bundles; ++i) mapper_.adjust_all();
  return ended;
}

}  // namespace semvslam
