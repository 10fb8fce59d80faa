#include "semvslam/pipeline/slam.h"

#include <fmt/format.h>

#include <algorithm>
#include <exception>
#include <mutex>
#include <thread>
#include <variant>

#include "semvslam/base/bounded_queue.h"
#include "semvslam/data/file_io.h"
#include "semvslam/map/map_file.h"
#include "semvslam/pipeline/key_frame_classes.h"
#include "semvslam/pipeline/saved_map.h"
#include "semvslam/pipeline/segmentation_stage.h"

namespace semvslam {

// Ownership: the tracker belongs to the thread of process(), the mapper to the mapping stage (its own thread, or the
// calling one when deterministic). Between them: a bounded queue of requests one way, a slot with the newest local map
// the other.
struct Slam::Impl {
  Impl(const Config& c, std::shared_ptr<const ObservationModel> m, MapUse use, Map map)
      : config(c),
        model(std::move(m)),
        tracker(c.tracking, c.orb, c.dynamic, model, use),
        loaded_key_frames(map.key_frames().size()),
        loaded_landmarks(map.landmark_count()),
        mapper(c.mapping, std::move(map)),
        requests(static_cast<std::size_t>(c.mapping_queue)) {}

  void map_key_frame(KeyFrameRequest request);
  void renew_local_map(const LocalMapRequest& request);
  void publish(std::shared_ptr<const LocalMap> local);
  void search(const SearchRequest& request);
  void run_mapping();
  void start_mapping();
  void submit(KeyFrameRequest request);
  void submit(LocalMapRequest request);
  void submit(SearchRequest request);
  void resume_where_found();
  std::shared_ptr<const LocalMap> newest_map() const {
    std::lock_guard lock(slot_mutex);
    return newest;
  }
  void wait_for_first_map() {
    std::unique_lock lock(slot_mutex);
    published.wait(lock, [&] { return newest != nullptr || failure != nullptr; });
  }
  Status failure_status() const;
  Status check_input(const RgbdFrame& frame) const;
  std::optional<Segmentation> mask_for(const RgbdFrame& frame);
  void note(const std::string& line);
  TrackResult track(const RgbdFrame& frame, const Segmentation* segmentation);
  template <typename Visit>
  void for_key_frames_of_session(const Visit& visit) const {
    const Map& map = mapper.map();
    const auto first = map.key_frames().lower_bound(map.first_of_session());
    std::for_each(first, map.key_frames().end(), [&](const auto& entry) { visit(entry.second); });
  }

  const Config config;
  std::unique_ptr<SegmentationStage> segmentation;  // null: no masks wanted, or none to be had
  const std::shared_ptr<const ObservationModel> model;
  Tracker tracker;
  StageTimers timers;
  std::vector<std::shared_ptr<Sink>> sinks;
  KeyFrameClasses classes;
  const std::uint64_t loaded_key_frames, loaded_landmarks;

  mutable std::mutex map_mutex;  // a query never sees half a mapping step
  Mapper mapper;

  using Request = std::variant<KeyFrameRequest, LocalMapRequest, SearchRequest>;
  BoundedQueue<Request> requests;  // blocks when full, unless realtime: then the tracker asks again later
  mutable std::mutex slot_mutex;
  std::condition_variable published;
  std::shared_ptr<const LocalMap> newest;
  bool searching = false;           // a lost frame is being looked for; one at a time
  std::optional<FoundAgain> found;  // taken by the next frame
  std::exception_ptr failure;
  std::jthread mapping_thread;

  struct Record {
    TimeStamp stamp;
    RelativePose relative;
  };
  mutable std::mutex record_mutex;
  std::vector<Record> records;
  std::uint64_t frames = 0, lost = 0, found_again = 0;
  std::uint64_t lost_in_a_row = 0;
  DynamicTotals dynamic;
  std::vector<std::string> notices;
  FrameId next_frame{0};
  bool finished = false;
};

void Slam::Impl::map_key_frame(KeyFrameRequest request) {
  std::shared_ptr<const LocalMap> local;
  {
    std::lock_guard lock(map_mutex);
    NewKeyFrame key_frame{request.frame, request.stamp, {}, std::move(request.features), std::move(request.landmarks)};
    if (request.reference.valid())
      key_frame.camera_from_world =
          request.camera_from_reference * mapper.map().camera_from_world(request.reference).value();
    for (const LandmarkUse& use : request.uses)
      mapper.count_use(use.landmark, use.visible, use.found, use.seen_through);
    local = mapper.step(key_frame);
    const MappingTimes& t = mapper.times();
    timers["mapping.create"].add_ms(t.create_ms);
    timers["mapping.revisit"].add_ms(t.revisit_ms);
    timers["mapping.loop"].add_ms(t.loop_ms);
    timers["mapping.fuse"].add_ms(t.fuse_ms);
    timers["mapping.bundle"].add_ms(t.bundle_ms);
    timers["mapping.cull"].add_ms(t.cull_ms);
    timers["mapping"].add_ms(t.total_ms);
  }
  publish(std::move(local));
}

void Slam::Impl::renew_local_map(const LocalMapRequest& request) {
  std::shared_ptr<const LocalMap> local;
  {
    std::lock_guard lock(map_mutex);
    const auto timer = timers["mapping.local_map"].time();
    local = mapper.local_map(request.reference);
  }
  publish(std::move(local));
}

void Slam::Impl::publish(std::shared_ptr<const LocalMap> local) {
  {
    std::lock_guard lock(slot_mutex);
    newest = std::move(local);
  }
  published.notify_all();
}

void Slam::Impl::search(const SearchRequest& request) {
  std::optional<FoundAgain> again;
  {
    std::lock_guard lock(map_mutex);
    const auto timer = timers["mapping.relocalise"].time();
    if (std::optional<Relocalisation> r = mapper.relocalise(*request.features)) {
      const SE3 reference = mapper.map().key_frame(r->key_frame)->camera_from_world;
      again = FoundAgain{request.features,
                         std::move(r->landmarks),
                         {r->key_frame, r->camera_from_world * reference.inverse()},
                         mapper.local_map(r->key_frame)};
    }
  }
  {
    std::lock_guard lock(slot_mutex);
    found = std::move(again);
    searching = false;
  }
  published.notify_all();
}

void Slam::Impl::run_mapping() {
  try {
    while (std::optional<Request> request = requests.pop()) {
      if (auto* key_frame = std::get_if<KeyFrameRequest>(&*request))
        map_key_frame(std::move(*key_frame));
      else if (auto* local_map = std::get_if<LocalMapRequest>(&*request))
        renew_local_map(*local_map);
      else
        search(std::get<SearchRequest>(*request));
    }
  } catch (...) {
    {
      std::lock_guard lock(slot_mutex);
      failure = std::current_exception();
    }
    requests.close();
    published.notify_all();
  }
}

void Slam::Impl::start_mapping() {
  if (!mapping_thread.joinable()) mapping_thread = std::jthread([this] { run_mapping(); });
}

void Slam::Impl::submit(KeyFrameRequest request) {
  const bool first = !request.reference.valid();
  if (config.deterministic) {
    map_key_frame(std::move(request));
  } else {
    start_mapping();
    requests.push(std::move(request));
    // Nothing can be tracked before there is a map, and the first one takes a millisecond.
    if (first) wait_for_first_map();
  }
}

void Slam::Impl::submit(LocalMapRequest request) {
  if (config.deterministic) return renew_local_map(request);
  start_mapping();
  requests.push(request);
}

void Slam::Impl::submit(SearchRequest request) {
  // Lost for long, in a place that is not in the map perhaps: no need to search it for every frame.
  constexpr std::uint64_t kEvery = 5;
  if (lost_in_a_row > kEvery && lost_in_a_row % kEvery != 0) return;
  if (config.deterministic) return search(request);
  {
    std::lock_guard lock(slot_mutex);
    if (searching) return;
    searching = true;
  }
  start_mapping();
  Request wrapped = std::move(request);
  if (config.realtime) {
    if (requests.try_push(wrapped)) return;  // found by a later frame
    std::lock_guard lock(slot_mutex);
    searching = false;
  } else if (requests.push(std::move(wrapped))) {
    // A recording has time: no more frames than this one are lost.
    std::unique_lock lock(slot_mutex);
    published.wait(lock, [&] { return !searching || failure != nullptr; });
  }
}

void Slam::Impl::resume_where_found() {
  std::lock_guard lock(slot_mutex);
  if (!found) return;
  if (tracker.resume(*found)) {
    newest = found->local;
    std::lock_guard record_lock(record_mutex);
    ++found_again;
  }
  found.reset();
}

Status Slam::Impl::failure_status() const {
  std::lock_guard lock(slot_mutex);
  if (!failure) return Status::success();
  try {
    std::rethrow_exception(failure);
  } catch (const std::exception& e) {
    return Error{ErrorCode::kInternal, fmt::format("mapping stopped: {}", e.what())};
  }
}

Slam::Slam(std::unique_ptr<Impl> impl) : impl_(std::move(impl)) {}

Slam::~Slam() {
  impl_->requests.close();
  if (impl_->mapping_thread.joinable()) impl_->mapping_thread.join();
}

Result<std::unique_ptr<Slam>> Slam::create(const Config& config, const Camera& camera) {
  return make(config, camera, std::nullopt);
}

Result<std::unique_ptr<Slam>> Slam::create(const Config& config, const Camera& camera, Map map) {
  return make(config, camera, std::move(map));
}

Result<std::unique_ptr<Slam>> Slam::make(const Config& config, const Camera& camera, std::optional<Map> map) {
  if (Status s = camera.check(); !s) return s.error();
  if (Status s = config.check(); !s) return s.error();
  if (config.mapping.frozen && !map)
    return Error{ErrorCode::kInvalidInput, "mapping.frozen: there is no saved map to localise in (--map)"};
  const auto model = std::make_shared<const ObservationModel>(camera, config.noise, level_scales(config.orb));
  MapUse use = MapUse::kBuild;
  if (map) {
    if (Status s = check_saved_map(*map, *model); !s) return s.error();
    use = config.mapping.frozen ? MapUse::kFollow : MapUse::kExtend;
    if (use == MapUse::kExtend) map->set_model(model);
  } else {
    map.emplace(model);
  }
  Config used = config;
  std::unique_ptr<SegmentationStage> segmentation;
  std::string notice;
  if (config.needs_segmentation()) {
    Result<std::unique_ptr<SegmentationStage>> made = SegmentationStage::create(config);
    if (made) {
      segmentation = std::move(*made);
    } else {
      notice = made.error().message + "; going on without masks, by motion consistency";
      used.dynamic.motion = true;
    }
  }
  std::unique_ptr<Slam> slam(new Slam(std::make_unique<Impl>(used, model, use, std::move(*map))));
  slam->impl_->segmentation = std::move(segmentation);
  if (!notice.empty()) slam->impl_->note(notice);
  return slam;
}

void Slam::add_sink(std::shared_ptr<Sink> sink) {
  for (const std::string& line : impl_->notices) sink->on_notice(line);
  impl_->sinks.push_back(std::move(sink));
}

void Slam::Impl::note(const std::string& line) {
  {
    std::lock_guard lock(record_mutex);
    if (std::find(notices.begin(), notices.end(), line) != notices.end()) return;
    notices.push_back(line);
  }
  for (const auto& sink : sinks) sink->on_notice(line);
}

Status Slam::Impl::check_input(const RgbdFrame& frame) const {
  const cv::Size size(model->camera().width_px, model->camera().height_px);
  const auto invalid = [&](const std::string& what) {
    return Error{ErrorCode::kInvalidInput, fmt::format("frame {}: {}", next_frame.value, what)};
  };
  if (frame.gray.type() != CV_8UC1 || frame.gray.size() != size)
    return invalid(fmt::format("the grey image must be 8-bit and {}x{}, it is {}x{}", size.width, size.height,
                               frame.gray.cols, frame.gray.rows));
  if (!frame.depth.empty() &&
      (frame.depth.size() != size || (frame.depth.type() != CV_16UC1 && frame.depth.type() != CV_32FC1)))
    return invalid(fmt::format("the depth image must be 16-bit or float and {}x{}, it is {}x{}", size.width,
                               size.height, frame.depth.cols, frame.depth.rows));
  if (!frame.mask.empty() && (frame.mask.size() != size || frame.mask.type() != CV_8UC1))
    return invalid(fmt::format("the mask must be 8-bit and {}x{}, it is {}x{}", size.width, size.height,
                               frame.mask.cols, frame.mask.rows));
  return Status::success();
}

std::optional<Segmentation> Slam::Impl::mask_for(const RgbdFrame& frame) {
  if (!segmentation) return std::nullopt;
  if (!config.realtime) return segmentation->segment(frame);
  segmentation->offer(frame);
  return segmentation->newest();
}

std::optional<Segmentation> Slam::segment(const RgbdFrame& frame) {
  return impl_->segmentation ? impl_->segmentation->segment(frame) : std::nullopt;
}

Result<TrackResult> Slam::process(const RgbdFrame& frame) {
  if (Status status = impl_->check_input(frame); !status) return status.error();
  RgbdFrame named = frame;
  named.id = impl_->next_frame;
  return process_named(named, impl_->mask_for(named));
}

Result<TrackResult> Slam::process(const RgbdFrame& frame, std::optional<Segmentation> segmentation) {
  if (Status status = impl_->check_input(frame); !status) return status.error();
  RgbdFrame named = frame;
  named.id = impl_->next_frame;
  // The caller numbers its frames as it likes; a frame that was refused has no number here.
  if (segmentation) segmentation->frame = named.id;
  return process_named(named, std::move(segmentation));
}

Result<TrackResult> Slam::process_named(const RgbdFrame& frame, std::optional<Segmentation> segmentation) {
  Impl& s = *impl_;
  if (Status status = s.failure_status(); !status) return status.error();
  s.next_frame.value += 1;
  if (s.segmentation) {
    if (Status status = s.segmentation->status(); !status) {
      s.note(status.error().message + "; going on without masks, by motion consistency");
      s.tracker.use_motion();
    }
  }
  return s.track(frame, segmentation ? &*segmentation : nullptr);
}

TrackResult Slam::Impl::track(const RgbdFrame& frame, const Segmentation* mask) {
  resume_where_found();
  const bool may_request = !config.realtime || requests.size() < static_cast<std::size_t>(config.mapping_queue);
  Tracker::Output tracked = tracker.step(frame, mask, newest_map(), may_request);
  timers["tracking.extract"].add_ms(tracked.times.extract_ms);
  timers["tracking.dynamic"].add_ms(tracked.times.dynamic_ms);
  timers["tracking.frame"].add_ms(tracked.times.frame_ms);
  timers["tracking.local_map"].add_ms(tracked.times.local_map_ms);
  timers["tracking"].add_ms(tracked.times.total_ms);

  TrackResult result;
  result.frame = frame.id;
  result.stamp = frame.stamp;
  result.state = tracked.state;
  result.world_from_camera = tracked.camera_from_world.inverse();
  result.inliers = tracked.inliers;
  result.is_key_frame = tracked.key_frame.has_value();
  result.mask_source = tracked.dynamic->mask_source;
  result.tracking_ms = tracked.times.total_ms;
  result.dynamic = tracked.dynamic;
  if (tracked.key_frame) {
    classes.keep(frame.id, mask);
    submit(std::move(*tracked.key_frame));
  }
  if (tracked.local_map) submit(*tracked.local_map);
  if (tracked.state == TrackingState::kTracking && !tracked.relative) {
    if (const auto local = newest_map()) tracked.relative = RelativePose{local->reference, SE3()};
  }
  {
    std::lock_guard lock(record_mutex);
    ++frames;
    if (tracked.state == TrackingState::kLost)
      ++lost, ++lost_in_a_row;
    else
      lost_in_a_row = 0;
    if (tracked.relative) records.push_back({frame.stamp, *tracked.relative});
    dynamic.add(*tracked.dynamic);
  }
  if (tracked.search) submit(std::move(*tracked.search));
  for (const auto& sink : sinks) sink->on_frame(frame, result);
  return result;
}

Status Slam::finish() {
  impl_->requests.close();
  if (impl_->mapping_thread.joinable()) impl_->mapping_thread.join();
  Status status = impl_->failure_status();
  if (status && !impl_->finished) {
    impl_->finished = true;
    std::lock_guard lock(impl_->map_mutex);
    const Map& map = impl_->mapper.map();
    if (map.next_key_frame() == map.first_of_session()) return status;  // nothing is new
    const auto timer = impl_->timers["mapping.final_bundle"].time();
    for (int i = 0; i < impl_->config.mapping.final_bundles; ++i) impl_->mapper.adjust_all();
  }
  return status;
}

Status Slam::save_map(const std::filesystem::path& path) const {
  // A step that broke off may have left half a map: no good one is replaced by it.
  if (Status status = impl_->failure_status(); !status) return status;
  const std::string file = [&] {
    std::lock_guard lock(impl_->map_mutex);
    return impl_->mapper.map().key_frames().empty() ? std::string() : format_map(impl_->mapper.map());
  }();
  if (file.empty())
    return Error{ErrorCode::kInvalidInput, fmt::format("{}: not written, the map is empty", path.string())};
  return write_file_atomically(path, file);
}

Trajectory Slam::trajectory() const {
  std::scoped_lock lock(impl_->map_mutex, impl_->record_mutex);
  Trajectory trajectory;
  trajectory.reserve(impl_->records.size());
  for (const Impl::Record& r : impl_->records) {
    const SE3 reference = impl_->mapper.map().camera_from_world(r.relative.reference).value();
    trajectory.push_back({r.stamp, (r.relative.camera_from_reference * reference).inverse()});
  }
  return trajectory;
}

Trajectory Slam::key_frame_trajectory() const {
  std::lock_guard lock(impl_->map_mutex);
  Trajectory trajectory;
  impl_->for_key_frames_of_session([&](const KeyFrame& key_frame) {
    trajectory.push_back({key_frame.stamp, key_frame.camera_from_world.inverse()});
  });
  return trajectory;
}

std::vector<KeyFrameMask> Slam::key_frame_masks() const {
  std::lock_guard lock(impl_->map_mutex);
  std::vector<KeyFrameMask> masks;
  impl_->for_key_frames_of_session([&](const KeyFrame& key_frame) {
    masks.push_back({key_frame.frame, key_frame.stamp, key_frame.features->moving, impl_->classes.of(key_frame.frame)});
  });
  return masks;
}

std::vector<Eigen::Vector3d> Slam::landmark_positions() const {
  std::lock_guard lock(impl_->map_mutex);
  return impl_->mapper.map().landmark_positions();
}

SlamStatistics Slam::statistics() const {
  std::scoped_lock lock(impl_->map_mutex, impl_->record_mutex);
  SlamStatistics statistics;
  statistics.frames = impl_->frames;
  statistics.tracked = impl_->records.size();
  statistics.lost = impl_->lost;
  statistics.key_frames = impl_->mapper.map().key_frames().size();
  statistics.landmarks = impl_->mapper.map().landmark_count();
  statistics.loaded_key_frames = impl_->loaded_key_frames;
  statistics.loaded_landmarks = impl_->loaded_landmarks;
  statistics.relocalised = impl_->found_again;
  statistics.revisits = static_cast<std::uint64_t>(impl_->mapper.revisits());
  statistics.loops = static_cast<std::uint64_t>(impl_->mapper.loops());
  statistics.dynamic = impl_->dynamic;
  statistics.notices = impl_->notices;
  statistics.stages = impl_->timers.summaries();
  if (impl_->segmentation)
    for (const StageSummary& stage : impl_->segmentation->times()) statistics.stages.push_back(stage);
  return statistics;
}

const Config& Slam::effective_config() const { return impl_->config; }

Status Slam::check_invariants() const {
  std::lock_guard lock(impl_->map_mutex);
  return impl_->mapper.map().check_invariants();
}

}  // namespace semvslam
