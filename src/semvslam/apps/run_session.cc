#include "semvslam/apps/run_session.h"

#include <fmt/core.h>

#include <chrono>
#include <mutex>
#include <thread>

#include "semvslam/apps/interrupt.h"
#include "semvslam/apps/progress.h"
#include "semvslam/apps/run_output.h"
#include "semvslam/apps/truth_masks.h"
#include "semvslam/base/bounded_queue.h"
#include "semvslam/base/process_stats.h"
#include "semvslam/base/stage_timer.h"
#include "semvslam/data/file_io.h"
#include "semvslam/data/prefetch.h"
#include "semvslam/data/text_scan.h"
#include "semvslam/dynamic/dynamic_overlay.h"
#include "semvslam/map/map_file.h"
#include "semvslam/pipeline/segment_ahead.h"
#include "semvslam/semantic/segmentation_files.h"

namespace semvslam {
namespace {

using Clock = std::chrono::steady_clock;
constexpr std::size_t kFramesAhead = 6;
constexpr std::size_t kMasksAhead = 2;
constexpr std::uint64_t kSkipsShown = 3;  // on the terminal; all are in run.log

double seconds_since(Clock::time_point start) { return std::chrono::duration<double>(Clock::now() - start).count(); }

/// Writes stats.json about once a second, and the map every few seconds, from a thread of its own: asking the system
/// waits for a mapping step, and replacing a file waits for the disk; neither may stand between two frames.
class Checkpoints {
 public:
  Checkpoints(const Slam& slam, const RunOutput& output) : slam_(slam), output_(output) {
    thread_ = std::jthread([this] {
      // A failure here shows again, and is reported, when the final results are written.
      while (const auto record = records_.pop()) {
        static_cast<void>(output_.write("stats.json", format_statistics(*record, slam_.statistics())));
        write_map();
      }
    });
  }
  ~Checkpoints() { records_.close(); }

  /// Calls `record` and takes its result when a second has passed since the last one.
  template <typename MakeRecord>
  void offer(const MakeRecord& record) {
    if (seconds_since(last_) < 0.9) return;
    last_ = Clock::now();
    RunRecord now = record();
    records_.try_push(now);  // refused while the disk is slower than a second: the next one will do
  }

 private:
  void write_map() {
    if (seconds_since(last_map_) < 5) return;
    const std::vector<Eigen::Vector3d> landmarks = slam_.landmark_positions(SubMapId(0));
    if (landmarks.empty()) return;
    static_cast<void>(output_.write_map(slam_.key_frame_trajectory(SubMapId(0)), landmarks));
    last_map_ = Clock::now();
  }

  const Slam& slam_;
  const RunOutput& output_;
  Clock::time_point last_ = Clock::now() - std::chrono::seconds(10);
  Clock::time_point last_map_ = last_;  // the thread's own
  BoundedQueue<RunRecord> records_{1};
  std::jthread thread_;  // last: ends before what it uses
};

/// Keeps the camera's pace: waits until a frame is due, and tells which frames come too late.
class Pace {
 public:
  explicit Pace(double frame_rate_hz) : period_s_(1 / frame_rate_hz) {}

  /// Waits until `stamp` is due. @return false when the next frame is due already: this one should be dropped.
  bool keep(TimeStamp stamp) {
    if (!started_) started_ = true, first_ = stamp, start_ = Clock::now();
    const double due_s = static_cast<double>(stamp.ns - first_.ns) * 1e-9;
    if (seconds_since(start_) > due_s + period_s_) return false;
    std::this_thread::sleep_until(start_ +
                                  std::chrono::duration_cast<Clock::duration>(std::chrono::duration<double>(due_s)));
    return true;
  }

 private:
  const double period_s_;
  bool started_ = false;
  TimeStamp first_;
  Clock::time_point start_;
};

/// Writes what the system has to say to the log and the terminal.
class NoticeSink final : public Sink {
 public:
  explicit NoticeSink(RunOutput& output) : output_(output) {}
  void on_frame(const RgbdFrame&, const TrackResult&) override {}
  void on_notice(const std::string& line) override {
    output_.log("warning", line);
    fmt::print(stderr, "semvslam: warning: {}\n", line);
  }
  void on_event(const std::string& line) override { output_.log("info", line); }

 private:
  RunOutput& output_;
};

/// Writes a picture per frame of what the policy made of it.
class DebugFrameSink final : public Sink {
 public:
  DebugFrameSink(std::filesystem::path folder, RunOutput& output) : folder_(std::move(folder)), output_(output) {}
  void on_frame(const RgbdFrame& frame, const TrackResult& result) override {
    const cv::Mat picture = draw_dynamic(frame, *result.dynamic, std::string(to_string(result.state)));
    const Status status = write_picture(folder_ / fmt::format("{:06}.png", frame.id.value), picture);
    if (!status && !failed_) output_.log("warning", status.error().message);
    failed_ = !status;
  }

 private:
  const std::filesystem::path folder_;
  RunOutput& output_;
  bool failed_ = false;
};

class Session {
 public:
  Session(FrameSource& source, const Config& config, Slam& slam, RunOutput& output, const RunOptions& options,
          RunRecord record)
      : source_(source),
        segmented_(source, segment_ahead_of(slam), static_cast<std::size_t>(config.segment_at_once), kMasksAhead),
        slam_(slam),
        output_(output),
        options_(options),
        realtime_(config.realtime),
        record_(std::move(record)),
        progress_(total_frames(source, options), options.quiet) {}

  /// @return why the run ended before the source did; a success at the end of the source, at max_frames and on a
  /// signal.
  Status run();
  RunRecord record(const std::string& end) const;

 private:
  static std::optional<std::uint64_t> total_frames(const FrameSource& source, const RunOptions& options) {
    if (!source.size()) return options.max_frames;
    const std::uint64_t all = *source.size();
    return options.max_frames ? std::min(all, *options.max_frames) : all;
  }
  Status use(SegmentedFrame frame);
  void skip(const Error& error);
  void note_state(const TrackResult& result);

  FrameSource& source_;
  SegmentAhead segmented_;
  Slam& slam_;
  RunOutput& output_;
  const RunOptions& options_;
  const bool realtime_;
  RunRecord record_;
  StageTimer input_{"input"};
  Progress progress_;
  Clock::time_point start_ = Clock::now();
  TrackingState state_ = TrackingState::kInitializing;
  bool disk_trouble_ = false;
};

RunRecord Session::record(const std::string& end) const {
  RunRecord out = record_;
  out.wall_s = seconds_since(start_);
  out.cpu_s = process_cpu_seconds() - options_.before.cpu_s;
  out.peak_memory_bytes = peak_memory_bytes();
  out.input = input_.summary();
  out.end = end;
  return out;
}

void Session::skip(const Error& error) {
  ++record_.skipped;
  output_.log("warning", "skipped: " + error.message);
  if (record_.skipped <= kSkipsShown) progress_.message("semvslam: warning: skipped: " + error.message);
  if (record_.skipped == kSkipsShown)
    progress_.message("semvslam: warning: further skipped frames are listed in run.log");
}

void Session::note_state(const TrackResult& result) {
  if (result.state == state_) return;
  output_.log("info", fmt::format("frame {} at {:.6f} s: {} -> {}", result.frame.value, result.stamp.seconds(),
                                  to_string(state_), to_string(result.state)));
  state_ = result.state;
}

Status Session::use(SegmentedFrame next) {
  const Result<TrackResult> result =
      next.has_segmentation ? slam_.process(next.frame, std::move(next.segmentation)) : slam_.process(next.frame);
  if (!result) {
    if (result.error().code == ErrorCode::kInternal) return result.error();
    skip(result.error());
    return Status::success();
  }
  note_state(*result);
  if (result->state != TrackingState::kTracking) return Status::success();
  const Status written = output_.add_pose({result->stamp, result->world_from_camera}, result->sub_map);
  if (!written && !disk_trouble_) progress_.message("semvslam: warning: " + written.error().message + "; trying on");
  disk_trouble_ = !written;
  return Status::success();
}

Status Session::run() {
  Pace pace(source_.camera().frame_rate_hz);
  Checkpoints checkpoints(slam_, output_);
  start_ = Clock::now();
  while (InterruptGuard::received() == 0 && (!options_.max_frames || record_.read < *options_.max_frames)) {
    Result<std::optional<SegmentedFrame>> next = [&] {
      const auto timing = input_.time();
      return segmented_.next();
    }();
    if (!next && segmented_.fatal()) return next.error();
    if (next && !*next) break;
    ++record_.read;
    if (!next) {
      skip(next.error());
    } else if (realtime_ && !pace.keep((*next)->frame.stamp)) {
      ++record_.dropped;
    } else if (const Status status = use(std::move(**next)); !status) {
      return status;
    }
    progress_.update(record_.read, std::string(to_string(state_)));
    checkpoints.offer([&] { return record("running"); });
  }
  progress_.end();
  return Status::success();
}

std::string end_text(const Status& status, int signal) {
  if (!status) return status.error().message;
  if (signal == SIGINT) return "interrupted (SIGINT)";
  if (signal != 0) return "interrupted (SIGTERM)";
  return "complete";
}

Status write_key_frame_masks(const std::filesystem::path& folder, const std::vector<KeyFrameMask>& masks) {
  for (const KeyFrameMask& mask : masks) {
    if (!mask.moving.is_set_anywhere()) continue;
    const std::string name = fmt::format("{}.png", format_seconds(mask.stamp));
    if (Status status = write_picture(folder / name, mask.moving.mask()); !status) return status;
  }
  return Status::success();
}

/// The system, in the saved map where there is one; what was loaded goes into `record`.
Result<std::unique_ptr<Slam>> make_slam(const Config& config, const Camera& camera, const RunOptions& options,
                                        RunRecord& record) {
  if (options.map.empty()) return Slam::create(config, camera);
  const Clock::time_point start = Clock::now();
  Result<Map> map = read_map(options.map);
  if (!map) return map.error();
  record.map = options.map.string();
  record.map_load_s = seconds_since(start);
  return Slam::create(config, camera, std::move(*map));
}

Error nothing_tracked(const RunOutcome& outcome, const RunOptions& options) {
  const std::uint64_t frames = outcome.record.read;
  const std::string log = (options.out / "run.log").string();
  if (options.map.empty())
    return {ErrorCode::kInvalidInput, fmt::format("none of the {} frames could be tracked (see {})", frames, log)};
  std::string what =
      fmt::format("{}: none of the {} frames was found in this map (see {})", options.map.string(), frames, log);
  if (!outcome.apart.empty())
    what += fmt::format("; what was tracked all the same begins in {}",
                        numbered(options.out / "trajectory.txt", outcome.apart.begin()->first).string());
  return {ErrorCode::kInvalidInput, what};
}

void keep_first(Status& first, Status status) {
  if (first && !status) first = std::move(status);
}

/// A map that a run could begin in stays what it is where nothing was found in it.
Status save_maps(const Slam& slam, const RunOutcome& outcome, const std::filesystem::path& file) {
  Status first;
  if (outcome.statistics.tracked > 0) keep_first(first, slam.save_map(file));
  for (const auto& [sub_map, results] : outcome.apart)
    keep_first(first, slam.save_map(numbered(file, sub_map), sub_map));
  return first;
}

}  // namespace

Result<RunOutcome> run_session(std::unique_ptr<FrameSource> source, Config& config, const RunOptions& options) {
  const InterruptGuard interrupt;
  RunRecord record;
  // First: a map that cannot be used is no reason to remove earlier results.
  Result<std::unique_ptr<Slam>> slam = make_slam(config, source->camera(), options, record);
  if (!slam) return slam.error();
  Result<RunOutput> output = RunOutput::create(options.out);
  if (!output) return output.error();
  (*slam)->add_sink(std::make_shared<NoticeSink>(*output));
  if (!options.debug_frames.empty()) {
    if (const Status status = make_folder(options.debug_frames); !status) return status.error();
    (*slam)->add_sink(std::make_shared<DebugFrameSink>(options.debug_frames, *output));
  }
  if (!options.key_frame_masks.empty())
    if (const Status status = make_folder(options.key_frame_masks); !status) return status.error();
  // Now: after the run is late to find out that there is no place for them.
  std::vector<std::filesystem::path> files = options.dense_maps;
  files.push_back(options.save_map);
  for (const std::filesystem::path& file : files)
    if (file.has_parent_path())
      if (const Status status = make_folder(file.parent_path()); !status) return status.error();
  std::shared_ptr<TruthMaskSink> truth;
  if (!options.truth_masks.empty()) {
    Result<std::shared_ptr<TruthMaskSink>> opened =
        TruthMaskSink::open(options.truth_masks, config.orb, config.dynamic.dilate_px);
    if (!opened) return opened.error();
    truth = std::move(*opened);
    (*slam)->add_sink(truth);
  }
  if (const Status status = output->write("config.yaml", config.schema().dump_yaml()); !status) return status.error();
  record.sequence = source->description();
  record.mode = config.mode;
  record.deterministic = config.deterministic;
  record.realtime = config.realtime;
  record.start_up_s = process_age_seconds() - options.before.age_s;
  output->log("info", fmt::format("semvslam {}: {}", SEMVSLAM_VERSION, record.sequence));

  RunOutcome outcome;
  {
    const std::unique_ptr<FrameSource> ahead = prefetch(std::move(source), kFramesAhead);
    Session session(*ahead, config, **slam, *output, options, std::move(record));
    outcome.status = session.run();
    outcome.signal = InterruptGuard::received();
    keep_first(outcome.status, (*slam)->finish());
    outcome.record = session.record(end_text(outcome.status, outcome.signal));
    if (truth) outcome.record.truth = truth->counts();
  }
  outcome.statistics = (*slam)->statistics();
  static_cast<SubMapResults&>(outcome) = SubMapResults::of(**slam, outcome.statistics.sub_map);
  for (const SubMapStatistics& s : outcome.statistics.apart)
    outcome.apart.emplace(s.sub_map, SubMapResults::of(**slam, s.sub_map));
  keep_first(outcome.status, output->write_results(outcome, outcome.apart));
  if (!options.save_map.empty()) keep_first(outcome.status, save_maps(**slam, outcome, options.save_map));
  if (!options.key_frame_masks.empty()) {
    keep_first(outcome.status, write_key_frame_masks(options.key_frame_masks, outcome.key_frame_masks));
    for (const auto& [sub_map, results] : outcome.apart)
      keep_first(outcome.status, write_key_frame_masks(options.key_frame_masks, results.key_frame_masks));
  }
  keep_first(outcome.status, output->write("stats.json", format_statistics(outcome.record, outcome.statistics)));
  if (outcome.status && outcome.signal == 0 && outcome.statistics.tracked == 0)
    outcome.status = nothing_tracked(outcome, options);
  for (const std::string& line : format_apart(outcome.statistics)) output->log("warning", line);
  output->log("info", outcome.record.end);
  return outcome;
}

}  // namespace semvslam
