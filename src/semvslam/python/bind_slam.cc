// The system itself.
#include <fmt/format.h>
#include <pybind11/stl.h>

#include <algorithm>
#include <memory>
#include <optional>
#include <string>

#include "semvslam/pipeline/segment_ahead.h"
#include "semvslam/python/arrays.h"
#include "semvslam/python/pose_list.h"
#include "semvslam/python/recording.h"
#include "semvslam/python/system.h"

namespace py = pybind11;
using namespace py::literals;

namespace semvslam {
namespace {

std::optional<SubMapId> sub_map_of(const std::optional<std::uint32_t>& number) {
  return number ? std::optional(SubMapId(*number)) : std::nullopt;
}

py::dict to_dict(const SubMapStatistics& s) {
  return py::dict("sub_map"_a = s.sub_map.value, "tracked"_a = s.tracked, "key_frames"_a = s.key_frames,
                  "landmarks"_a = s.landmarks);
}

py::dict to_dict(const SlamStatistics& s) {
  py::dict out = to_dict(static_cast<const SubMapStatistics&>(s));
  out["frames"] = s.frames;
  out["lost"] = s.lost;
  py::list apart;
  for (const SubMapStatistics& one : s.apart) apart.append(to_dict(one));
  out["apart"] = apart;
  out["sub_maps_begun"] = s.sub_maps_begun;
  out["sub_maps_joined"] = s.sub_maps_joined;
  out["loaded_key_frames"] = s.loaded_key_frames;
  out["loaded_landmarks"] = s.loaded_landmarks;
  out["relocalised"] = s.relocalised;
  out["revisits"] = s.revisits;
  out["loops"] = s.loops;
  out["notices"] = s.notices;
  py::dict stages;
  for (const StageSummary& stage : s.stages)
    stages[py::str(stage.name)] =
        py::dict("count"_a = stage.count, "mean_ms"_a = stage.mean_ms, "median_ms"_a = stage.median_ms,
                 "p95_ms"_a = stage.p95_ms, "max_ms"_a = stage.max_ms);
  out["stages"] = stages;
  return out;
}

py::array_t<double> to_array(const std::vector<Eigen::Vector3d>& points) {
  py::array_t<double> out({static_cast<py::ssize_t>(points.size()), py::ssize_t{3}});
  double* to = out.mutable_data();
  for (const Eigen::Vector3d& p : points) to = std::copy_n(p.data(), 3, to);
  return out;
}

py::list masks_of(const System& system, const std::optional<std::uint32_t>& sub_map) {
  const auto masks = system.ask([&](const Slam& slam) { return slam.key_frame_masks(sub_map_of(sub_map)); });
  const cv::Size size(system.camera().width_px, system.camera().height_px);
  py::list out;
  for (const KeyFrameMask& mask : masks) out.append(py::make_tuple(mask.stamp.ns, bools_of(mask.moving.mask(), size)));
  return out;
}

/// The frames of a recording with their segmentations, which threads make ahead of whoever iterates.
class FramesAhead {
 public:
  /// Both must outlive this object.
  FramesAhead(System& system, Recording& recording) : must_be_whole_(recording.must_be_whole()) {
    Slam& slam = system.slam();
    const auto at_once = static_cast<std::size_t>(slam.effective_config().segment_at_once);
    ahead_ = std::make_unique<SegmentAhead>(recording.lend(), segment_ahead_of(slam), at_once, kWaiting);
  }
  ~FramesAhead() {
    const py::gil_scoped_release others_may_run;
    ahead_.reset();
  }
  FramesAhead(const FramesAhead&) = delete;
  FramesAhead& operator=(const FramesAhead&) = delete;

  py::tuple next() {
    for (;;) {
      Result<std::optional<SegmentedFrame>> frame = [&] {
        const py::gil_scoped_release others_may_run;
        return ahead_->next();
      }();
      if (!frame && !must_be_whole_ && !ahead_->fatal()) continue;
      std::optional<SegmentedFrame> read = value_or_raise(std::move(frame));
      if (!read) throw py::stop_iteration();
      return py::make_tuple(std::move(read->frame), std::move(read->segmentation));
    }
  }

 private:
  static constexpr std::size_t kWaiting = 2;  // frames
  bool must_be_whole_;
  std::unique_ptr<SegmentAhead> ahead_;
};

void bind_ahead(py::module_& m) {
  py::class_<FramesAhead>(m, "FramesAhead", "Iterates over (Frame, Segmentation or None).")
      .def("__iter__", [](const py::object& self) { return self; })
      .def("__next__", &FramesAhead::next);
}

void bind_result(py::module_& m) {
  py::class_<TrackResult>(m, "TrackResult", "What is known about a frame the moment it has been tracked.")
      .def_property_readonly(
          "frame", [](const TrackResult& r) { return r.frame.value; }, "its number in this run, from 0")
      .def_property_readonly("stamp_ns", [](const TrackResult& r) { return r.stamp.ns; })
      .def_property_readonly(
          "state", [](const TrackResult& r) { return std::string(to_string(r.state)); },
          "'initializing', 'tracking' or 'lost'")
      .def_property_readonly(
          "world_from_camera", [](const TrackResult& r) { return matrix_of(r.world_from_camera); },
          "float64 [4, 4], metres; world = camera of the sub-map's first key frame, or the saved map's world. While "
          "lost: the last known pose. Mapping may improve it later: see Slam.trajectory().")
      .def_property_readonly("sub_map", [](const TrackResult& r) { return r.sub_map.value; })
      .def_readonly("inliers", &TrackResult::inliers, "landmarks that agree with the pose")
      .def_readonly("is_key_frame", &TrackResult::is_key_frame)
      .def_property_readonly(
          "mask_source", [](const TrackResult& r) { return std::string(to_string(r.mask_source)); },
          "where the masks came from that it was tracked with")
      .def_readonly("tracking_ms", &TrackResult::tracking_ms)
      .def_property_readonly(
          "moving",
          [](const TrackResult& r) -> py::object {
            return r.dynamic->moving.empty() ? py::object(py::none()) : bools_of(r.dynamic->moving, {});
          },
          "bool [height, width], pixels of what moves or may; None where nothing does")
      .def("__repr__", [](const TrackResult& r) {
        return fmt::format("<semvslam.TrackResult frame {}, {}, {} inliers>", r.frame.value, to_string(r.state),
                           r.inliers);
      });
}

void bind_system(py::module_& m) {
  py::class_<System>(m, "Slam",
                     "The whole system. Feed frames in the order of their stamps, ask at any time and from any thread, "
                     "finish() at the end.")
      .def(
          py::init<const Camera&, const std::string&, const py::dict&, const py::object&, bool, bool, bool>(),
          "camera"_a, "mode"_a = "full", py::kw_only(), "values"_a = py::dict(), "map"_a = py::none(),
          "localise"_a = false, "deterministic"_a = false, "realtime"_a = false,
          "mode: orb, boxes, masks, masks+repair, masks+motion, motion or full. values: configuration by key, as "
          "`semvslam config` lists them: {'orb.features': 1500}. map: file of a saved map to begin in; localise: which "
          "stays as it is. deterministic: the same bytes every time, on one thread. realtime: never wait, for a live "
          "camera.")
      .def("process", &System::process, "frame"_a, "segmentation"_a = py::none(),
           "Tracks one Frame -> TrackResult. Where the mode wants masks it is segmented first, unless a segmentation "
           "of it is given; with realtime beside it. Raises ValueError for images of another size than the camera's "
           "and for a stamp that is not later than the one before; the frame is not used then.")
      .def("segment", &System::segment, "frame"_a,
           "Segments a Frame for process(), on any thread, to be ahead of tracking -> Segmentation, or None where the "
           "mode wants none. Not with realtime.")
      .def(
          "ahead", [](System& self, Recording& sequence) { return std::make_unique<FramesAhead>(self, sequence); },
          py::keep_alive<0, 1>(), py::keep_alive<0, 2>(), "sequence"_a,
          "Reads a Sequence and segments its frames on threads, ahead of tracking: iterate over it, and give both to "
          "process(). `segment.at_once` says how many at the same time.")
      .def("finish", &System::finish, "Waits for mapping, then adjusts the whole map once more.")
      .def(
          "trajectory",
          [](const System& s, const std::optional<std::uint32_t>& sub_map) {
            return PoseList{s.ask([&](const Slam& slam) { return slam.trajectory(sub_map_of(sub_map)); })};
          },
          "sub_map"_a = py::none(), "All frames tracked, with everything that mapping has learnt since.")
      .def(
          "key_frames",
          [](const System& s, const std::optional<std::uint32_t>& sub_map) {
            return PoseList{s.ask([&](const Slam& slam) { return slam.key_frame_trajectory(sub_map_of(sub_map)); })};
          },
          "sub_map"_a = py::none(), "Trajectory of the key frames.")
      .def("key_frame_masks", &masks_of, "sub_map"_a = py::none(),
           "A list of (stamp_ns, bool [height, width]): what moved in each key frame.")
      .def(
          "landmarks",
          [](const System& s, const std::optional<std::uint32_t>& sub_map) {
            return to_array(s.ask([&](const Slam& slam) { return slam.landmark_positions(sub_map_of(sub_map)); }));
          },
          "sub_map"_a = py::none(), "float64 [n, 3], in the world of the poses, metres.")
      .def(
          "save_map",
          [](const System& s, const py::object& path) {
            const std::filesystem::path file = path_of(path);
            raise_if(s.ask([&](const Slam& slam) { return slam.save_map(file); }));
          },
          "path"_a, "For another session to begin in.")
      .def(
          "statistics",
          [](const System& s) { return to_dict(s.ask([](const Slam& slam) { return slam.statistics(); })); },
          "A dict of what `semvslam run` writes to stats.json: frames, tracked, lost, key frames, milliseconds per "
          "stage, notices (what went wrong without ending the run).");
}

}  // namespace

void bind_slam(py::module_& m) {
  bind_ahead(m);
  bind_result(m);
  bind_system(m);
}

}  // namespace semvslam
