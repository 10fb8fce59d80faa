#include "semvslam/pipeline/slam.h"

#include <fmt/format.h>

#include <algorithm>
#include <map>
#include <mutex>

#include "semvslam/data/file_io.h"
#include "semvslam/map/map_file.h"
#include "semvslam/pipeline/key_frame_classes.h"
#include "semvslam/pipeline/mapping_stage.h"
#include "semvslam/pipeline/saved_map.h"
#include "semvslam/pipeline/segmentation_stage.h"

namespace semvslam {

// Ownership: the tracker belongs to the thread of process(), the mapper to the mapping stage.
struct Slam::Impl {
  Impl(const Config& c, std::shared_ptr<const ObservationModel> m, MapUse u, Map map)
      : config(c),
        model(std::move(m)),
        use(u),
        tracker(c.tracking, c.orb, c.dynamic, model, use),
        loaded_key_frames(map.key_frames().size()),
        loaded_landmarks(map.landmark_count()),
        mapping(config, std::move(map), timers) {}

  Status check_input(const RgbdFrame& frame) const;
  std::optional<Segmentation> mask_for(const RgbdFrame& frame);
  void note(const std::string& line);
  void tell(const std::string& line);
  void tell_events();
  TrackResult track(const RgbdFrame& frame, const Segmentation* segmentation);
  /// What mapping is asked for by the tracker; `result` is completed where that begins a world.
  void submit(Tracker::Output& tracked, TrackResult& result);
  void record(const Tracker::Output& tracked, TimeStamp stamp);
  /// Numbers of tracked frames; record_mutex must be locked.
  std::map<SubMapId, std::uint64_t> frames_of_sub_maps(const Map& map) const;
  SubMapId main_of(const std::map<SubMapId, std::uint64_t>& frames) const;
  SubMapId main_sub_map(const Map& map) const;
  /// All but the stages; record_mutex must be locked.
  SlamStatistics statistics(const Mapper& mapper) const;
  template <typename Visit>
  void for_key_frames_of_session(const Map& map, std::optional<SubMapId> sub_map, const Visit& visit) const {
    const SubMapId wanted = sub_map ? *sub_map : main_sub_map(map);
    for (auto it = map.key_frames().lower_bound(map.first_of_session()); it != map.key_frames().end(); ++it)
      if (it->second.sub_map == wanted) visit(it->second);
  }

  const Config config;
  std::unique_ptr<SegmentationStage> segmentation;  // null: no masks wanted, or none to be had
  const std::shared_ptr<const ObservationModel> model;
  const MapUse use;
  Tracker tracker;
  StageTimers timers;
  std::vector<std::shared_ptr<Sink>> sinks;
  KeyFrameClasses classes;
  const std::uint64_t loaded_key_frames, loaded_landmarks;
  MappingStage mapping;

  struct Record {
    TimeStamp stamp;
    RelativePose relative;
  };
  mutable std::mutex record_mutex;  // where the map is looked at as well: locked after it
  std::vector<Record> records;
  std::uint64_t frames = 0, lost = 0, found_again = 0;
  DynamicTotals dynamic;
  std::vector<std::string> notices;
  FrameId next_frame{0};
  std::optional<TimeStamp> last_stamp;  // of the frame before it
  bool finished = false;
};

Slam::Slam(std::unique_ptr<Impl> impl) : impl_(std::move(impl)) {}

Slam::~Slam() = default;

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

void Slam::Impl::tell(const std::string& line) {
  for (const auto& sink : sinks) sink->on_event(line);
}

void Slam::Impl::tell_events() {
  for (const std::string& line : mapping.take_events()) tell(line);
}

Status Slam::Impl::check_input(const RgbdFrame& frame) const {
  const cv::Size size(model->camera().width_px, model->camera().height_px);
  const auto invalid = [&](const std::string& what) {
    return Error{ErrorCode::kInvalidInput, fmt::format("frame {}: {}", next_frame.value, what)};
  };
  if (finished) return invalid("the run is finished: mapping has ended, begin another one in its saved map");
  if (last_stamp && frame.stamp <= *last_stamp)
    return invalid(fmt::format("its time stamp, {:.9f} s, is not later than that of the frame before it, {:.9f} s",
                               frame.stamp.seconds(), last_stamp->seconds()));
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
  if (Status status = s.mapping.status(); !status) return status.error();
  s.next_frame.value += 1;
  s.last_stamp = frame.stamp;
  if (s.segmentation) {
    if (Status status = s.segmentation->status(); !status) {
      s.note(status.error().message + "; going on without masks, by motion consistency");
      s.tracker.use_motion();
    }
  }
  return s.track(frame, segmentation ? &*segmentation : nullptr);
}

TrackResult Slam::Impl::track(const RgbdFrame& frame, const Segmentation* mask) {
  if (mapping.resume(tracker)) {
    std::lock_guard lock(record_mutex);
    ++found_again;
  }
  tell_events();
  const bool may_request = !config.realtime || mapping.has_room();
  const bool may_begin = config.mapping.sub_maps.enabled && may_request && mapping.searched_in_vain();
  const std::shared_ptr<const LocalMap> local = mapping.newest_map();
  Tracker::Output tracked = tracker.step(frame, mask, local, may_request, may_begin);
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
  if (local) result.sub_map = local->sub_map;
  result.inliers = tracked.inliers;
  result.is_key_frame = tracked.key_frame.has_value();
  result.mask_source = tracked.dynamic->mask_source;
  result.tracking_ms = tracked.times.total_ms;
  result.dynamic = tracked.dynamic;
  if (tracked.key_frame) classes.keep(frame.id, mask);
  submit(tracked, result);
  record(tracked, frame.stamp);
  if (tracked.search) mapping.submit(std::move(*tracked.search));
  for (const auto& sink : sinks) sink->on_frame(frame, result);
  return result;
}

void Slam::Impl::submit(Tracker::Output& tracked, TrackResult& result) {
  const bool begins = tracked.key_frame && !tracked.key_frame->reference.valid();
  if (tracked.key_frame) mapping.submit(std::move(*tracked.key_frame));
  if (tracked.local_map) mapping.submit(*tracked.local_map);
  if (!begins) return;
  const std::shared_ptr<const LocalMap> local = mapping.newest_map();
  if (!local || local->reference_frame != result.frame) return;  // mapping has broken off
  tracked.relative = RelativePose{local->reference, SE3()};
  result.sub_map = local->sub_map;
  if (local->sub_map != SubMapId(0))
    tell(fmt::format("frame {} at {:.6f} s: the camera is nowhere in the map: sub-map {} begins", result.frame.value,
                     result.stamp.seconds(), number_of(local->sub_map)));
}

void Slam::Impl::record(const Tracker::Output& tracked, TimeStamp stamp) {
  const bool is_lost = tracked.state == TrackingState::kLost;
  if (!is_lost) mapping.end_of_searches();
  std::lock_guard lock(record_mutex);
  ++frames;
  lost += is_lost;
  if (tracked.relative) records.push_back({stamp, *tracked.relative});
  dynamic.add(*tracked.dynamic);
}

Status Slam::finish() {
  impl_->finished = true;
  Status status = impl_->mapping.finish();
  impl_->tell_events();
  return status;
}

Status Slam::save_map(const std::filesystem::path& path, std::optional<SubMapId> sub_map) const {
  // A step that broke off may have left half a map: no good one is replaced by it.
  if (Status status = impl_->mapping.status(); !status) return status;
  const std::string file = impl_->mapping.query([&](const Mapper& mapper) {
    const Map part = mapper.map().part(sub_map ? *sub_map : impl_->main_sub_map(mapper.map()));
    return part.key_frames().empty() ? std::string() : format_map(part);
  });
  if (file.empty())
    return Error{ErrorCode::kInvalidInput, fmt::format("{}: not written, the map is empty", path.string())};
  return write_file_atomically(path, file);
}

std::map<SubMapId, std::uint64_t> Slam::Impl::frames_of_sub_maps(const Map& map) const {
  std::map<SubMapId, std::uint64_t> frames_of;
  for (const auto& [sub_map, first] : map.sub_maps()) frames_of[sub_map] = 0;
  if (frames_of.size() == 1)  // nearly always; asking for each would take longer the longer the run
    frames_of.begin()->second = records.size();
  else
    for (const Record& r : records) ++frames_of.at(map.sub_map_of(r.relative.reference));
  return frames_of;
}

SubMapId Slam::Impl::main_of(const std::map<SubMapId, std::uint64_t>& frames_of) const {
  if (frames_of.empty() || use != MapUse::kBuild) return SubMapId(0);
  return std::ranges::max_element(frames_of, {}, [](const auto& entry) { return entry.second; })->first;
}

SubMapId Slam::Impl::main_sub_map(const Map& map) const {
  std::lock_guard lock(record_mutex);
  return main_of(frames_of_sub_maps(map));
}

Trajectory Slam::trajectory(std::optional<SubMapId> sub_map) const {
  return impl_->mapping.query([&](const Mapper& mapper) {
    const Map& map = mapper.map();
    const SubMapId wanted = sub_map ? *sub_map : impl_->main_sub_map(map);
    std::lock_guard lock(impl_->record_mutex);
    Trajectory trajectory;
    trajectory.reserve(impl_->records.size());
    for (const Impl::Record& r : impl_->records) {
      if (map.sub_map_of(r.relative.reference) != wanted) continue;
      const SE3 reference = map.camera_from_world(r.relative.reference).value();
      trajectory.push_back({r.stamp, (r.relative.camera_from_reference * reference).inverse()});
    }
    return trajectory;
  });
}

Trajectory Slam::key_frame_trajectory(std::optional<SubMapId> sub_map) const {
  return impl_->mapping.query([&](const Mapper& mapper) {
    Trajectory trajectory;
    impl_->for_key_frames_of_session(mapper.map(), sub_map, [&](const KeyFrame& key_frame) {
      trajectory.push_back({key_frame.stamp, key_frame.camera_from_world.inverse()});
    });
    return trajectory;
  });
}

std::vector<KeyFrameMask> Slam::key_frame_masks(std::optional<SubMapId> sub_map) const {
  return impl_->mapping.query([&](const Mapper& mapper) {
    std::vector<KeyFrameMask> masks;
    impl_->for_key_frames_of_session(mapper.map(), sub_map, [&](const KeyFrame& key_frame) {
      masks.push_back(
          {key_frame.frame, key_frame.stamp, key_frame.features->moving, impl_->classes.of(key_frame.frame)});
    });
    return masks;
  });
}

std::vector<Eigen::Vector3d> Slam::landmark_positions(std::optional<SubMapId> sub_map) const {
  return impl_->mapping.query([&](const Mapper& mapper) {
    return mapper.map().landmark_positions(sub_map ? *sub_map : impl_->main_sub_map(mapper.map()));
  });
}

SlamStatistics Slam::statistics() const {
  SlamStatistics statistics = impl_->mapping.query([&](const Mapper& mapper) {
    std::lock_guard lock(impl_->record_mutex);
    return impl_->statistics(mapper);
  });
  statistics.stages = impl_->timers.summaries();
  if (impl_->segmentation)
    for (const StageSummary& stage : impl_->segmentation->times()) statistics.stages.push_back(stage);
  return statistics;
}

SlamStatistics Slam::Impl::statistics(const Mapper& mapper) const {
  const Map& map = mapper.map();
  const std::map<SubMapId, std::uint64_t> frames_of = frames_of_sub_maps(map);
  SlamStatistics statistics;
  statistics.frames = frames;
  statistics.lost = lost;
  statistics.loaded_key_frames = loaded_key_frames;
  statistics.loaded_landmarks = loaded_landmarks;
  statistics.relocalised = found_again;
  statistics.revisits = static_cast<std::uint64_t>(mapper.revisits());
  statistics.loops = static_cast<std::uint64_t>(mapper.loops());
  statistics.sub_maps_begun = std::max(map.next_sub_map().value, 1u) - 1;
  statistics.sub_maps_joined = static_cast<std::uint64_t>(mapper.joins());
  statistics.sub_map = main_of(frames_of);
  for (const auto& [id, tracked] : frames_of) {
    const SubMapStatistics one{id, tracked, map.key_frames_of(id).size(), map.landmark_ids(id).size()};
    if (id == statistics.sub_map)
      static_cast<SubMapStatistics&>(statistics) = one;
    else
      statistics.apart.push_back(one);
  }
  statistics.dynamic = dynamic;
  statistics.notices = notices;
  return statistics;
}

const Config& Slam::effective_config() const { return impl_->config; }

Status Slam::check_invariants() const {
  return impl_->mapping.query([](const Mapper& mapper) { return mapper.map().check_invariants(); });
}

}  // namespace semvslam
