// Cameras, frames, recordings, trajectories.
#include <fmt/format.h>

#include <algorithm>
#include <opencv2/imgproc.hpp>

#include "semvslam/data/camera_file.h"
#include "semvslam/data/sequence.h"
#include "semvslam/data/trajectory_io.h"
#include "semvslam/python/arrays.h"
#include "semvslam/python/pose_list.h"
#include "semvslam/python/recording.h"

namespace py = pybind11;
using namespace py::literals;

namespace semvslam {
namespace {

using Stamps = py::array_t<std::int64_t, py::array::c_style | py::array::forcecast>;
using Matrices = py::array_t<double, py::array::c_style | py::array::forcecast>;

Camera make_camera(int width_px, int height_px, double fx_px, double fy_px, double cx_px, double cy_px, double k1,
                   double k2, double p1, double p2, double k3, double depth_units_per_m, double baseline_m,
                   double frame_rate_hz) {
  const Camera camera{width_px,          height_px,  fx_px,        fy_px, cx_px, cy_px, {k1, k2, p1, p2, k3},
                      depth_units_per_m, baseline_m, frame_rate_hz};
  raise_if(camera.check());
  return camera;
}

RgbdFrame make_frame(std::int64_t stamp_ns, const py::array& rgb, const py::object& depth, const py::object& mask) {
  RgbdFrame frame;
  frame.stamp = {stamp_ns};
  const cv::Mat image = colour_of(rgb, "rgb");
  if (image.channels() == 3) {
    frame.colour = image;
    cv::cvtColor(image, frame.gray, cv::COLOR_BGR2GRAY);
  } else {
    frame.gray = image;
  }
  if (!depth.is_none()) frame.depth = depth_of(py::array(depth), "depth");
  if (!mask.is_none()) frame.mask = mask_of(py::array(mask), "mask");
  return frame;
}

Trajectory make_trajectory(const Stamps& stamps_ns, const Matrices& world_from_camera) {
  if (stamps_ns.ndim() != 1 || world_from_camera.ndim() != 3 || world_from_camera.shape(0) != stamps_ns.shape(0))
    throw py::value_error("a trajectory is of stamps [n] and as many poses [n, 4, 4]");
  Trajectory out;
  for (py::ssize_t i = 0; i < stamps_ns.shape(0); ++i) {
    const TimeStamp stamp{stamps_ns.at(i)};
    if (!out.empty() && stamp <= out.back().stamp)
      throw py::value_error(fmt::format("pose {} of the trajectory is not later than the one before it", i));
    out.push_back({stamp, motion_of(Matrices(world_from_camera[py::int_(i)]))});
  }
  return out;
}

Stamps stamps_array(const Trajectory& trajectory) {
  Stamps out(static_cast<py::ssize_t>(trajectory.size()));
  std::ranges::transform(trajectory, out.mutable_data(), [](const StampedPose& pose) { return pose.stamp.ns; });
  return out;
}

Matrices pose_array(const Trajectory& trajectory) {
  Matrices out({static_cast<py::ssize_t>(trajectory.size()), py::ssize_t{4}, py::ssize_t{4}});
  double* to = out.mutable_data();
  for (const StampedPose& pose : trajectory) to = std::copy_n(matrix_of(pose.world_from_camera).data(), 16, to);
  return out;
}

void bind_camera(py::module_& m) {
  py::class_<Camera>(
      m, "Camera",
      "A pinhole camera with Brown distortion (OpenCV's k1 k2 p1 p2 k3) whose depth is registered to "
      "colour. Camera frame: x right, y down, z forward; pixel (0, 0) is the centre of the top left one.")
      .def(py::init(&make_camera), py::kw_only(), "width_px"_a, "height_px"_a, "fx_px"_a, "fy_px"_a, "cx_px"_a,
           "cy_px"_a, "k1"_a = 0., "k2"_a = 0., "p1"_a = 0., "p2"_a = 0., "k3"_a = 0.,
           "depth_units_per_m"_a = Camera().depth_units_per_m, "baseline_m"_a = Camera().baseline_m,
           "frame_rate_hz"_a = Camera().frame_rate_hz,
           "depth_units_per_m: of 16-bit depth images (5000 in TUM recordings, 1000 = millimetres). baseline_m: of the "
           "structured-light pair behind the depth, whose noise grows with depth^2 / (fx baseline).")
      .def_static(
          "preset", [](const std::string& name) { return value_or_raise(camera_preset(name)); }, "name"_a,
          "A built-in camera: tum_fr1, tum_fr2, tum_fr3, bonn, icl.")
      .def_static(
          "read", [](const py::object& path) { return value_or_raise(read_camera(path_of(path))); }, "path"_a,
          "From a file with a line 'key: value' each (the README's run).")
      .def_readonly("width_px", &Camera::width_px)
      .def_readonly("height_px", &Camera::height_px)
      .def_readonly("fx_px", &Camera::fx_px)
      .def_readonly("fy_px", &Camera::fy_px)
      .def_readonly("cx_px", &Camera::cx_px)
      .def_readonly("cy_px", &Camera::cy_px)
      .def_property_readonly(
          "distortion",
          [](const Camera& c) {
            return py::make_tuple(c.distortion.k1, c.distortion.k2, c.distortion.p1, c.distortion.p2, c.distortion.k3);
          },
          "k1, k2, p1, p2, k3")
      .def_readonly("depth_units_per_m", &Camera::depth_units_per_m)
      .def_readonly("baseline_m", &Camera::baseline_m)
      .def_readonly("frame_rate_hz", &Camera::frame_rate_hz)
      .def("__repr__", [](const Camera& c) {
        return fmt::format("<semvslam.Camera {}x{} px, fx {:.1f}, fy {:.1f}>", c.width_px, c.height_px, c.fx_px,
                           c.fy_px);
      });
}

void bind_frames(py::module_& m) {
  py::class_<RgbdFrame>(m, "Frame", "One moment of an RGB-D stream. Its arrays are views and cannot be written to.")
      .def(
          py::init(&make_frame), "stamp_ns"_a, "rgb"_a, "depth"_a, "mask"_a = py::none(),
          "rgb: uint8 [height, width, 3], or [height, width] for grey. depth: [height, width] of uint16 in the "
          "camera's units or float32 in metres, 0 or NaN = not measured; None where there is none. mask: bool or uint8 "
          "[height, width], set = pixel of something that may move. All are copied.")
      .def_property_readonly("stamp_ns", [](const RgbdFrame& f) { return f.stamp.ns; })
      .def_property_readonly(
          "rgb", [](const RgbdFrame& f) { return view_of(f.colour); }, "uint8 [height, width, 3], or None")
      .def_property_readonly(
          "gray", [](const RgbdFrame& f) { return view_of(f.gray); }, "uint8 [height, width]")
      .def_property_readonly(
          "depth", [](const RgbdFrame& f) { return view_of(f.depth); }, "[height, width], or None")
      .def("__repr__", [](const RgbdFrame& f) {
        return fmt::format("<semvslam.Frame at {:.6f} s, {}x{} px>", f.stamp.seconds(), f.gray.cols, f.gray.rows);
      });

  py::class_<Recording>(m, "Sequence", "A recording: iterate over its frames, once.")
      .def(py::init([](const py::object& folder, const py::object& camera_file, const std::string& camera_preset,
                       bool colour, bool strict) {
             SequenceOptions options;
             if (!camera_file.is_none()) options.camera_file = path_of(camera_file).string();
             options.camera_preset = camera_preset;
             options.want_colour = colour;
             return Recording(path_of(folder), options, strict);
           }),
           "folder"_a, py::kw_only(), "camera_file"_a = py::none(), "camera_preset"_a = "", "colour"_a = true,
           "strict"_a = false,
           "In the layout of TUM RGB-D, Bonn or ICL-NUIM, or two folders of images; its camera as `semvslam run` finds "
           "it. colour: decode it (modes with a network and dense maps want it). strict: a frame that cannot be read "
           "raises; else it is left out.")
      .def_property_readonly("camera", [](const Recording& r) { return r.source().camera(); })
      .def("__len__", [](const Recording& r) { return r.source().size().value_or(0); })
      .def("__iter__", [](const py::object& self) { return self; })
      .def("__next__", &Recording::next)
      .def(
          "ground_truth", [](const Recording& r) { return PoseList{value_or_raise(read_ground_truth(r.folder()))}; },
          "Its reference Trajectory. Raises where it has none.")
      .def("__repr__", [](const Recording& r) { return "<semvslam.Sequence " + r.source().description() + ">"; });
}

void bind_trajectory(py::module_& m) {
  py::class_<PoseList>(m, "Trajectory", "Poses by time.")
      .def(py::init([](const Stamps& stamps_ns, const Matrices& poses) {
             return PoseList{make_trajectory(stamps_ns, poses)};
           }),
           "stamps_ns"_a, "world_from_camera"_a, "int64 [n], increasing, and rigid motions [n, 4, 4].")
      .def_static(
          "read", [](const py::object& path) { return PoseList{value_or_raise(read_trajectory(path_of(path)))}; },
          "path"_a, "From a TUM file: `t tx ty tz qx qy qz qw`.")
      .def(
          "write",
          [](const PoseList& t, const py::object& path) { raise_if(write_trajectory(path_of(path), t.poses)); },
          "path"_a, "To a TUM file, in one step.")
      .def_property_readonly(
          "stamps_ns", [](const PoseList& t) { return stamps_array(t.poses); }, "int64 [n], a copy")
      .def_property_readonly(
          "world_from_camera", [](const PoseList& t) { return pose_array(t.poses); },
          "float64 [n, 4, 4], metres; a copy")
      .def("__len__", [](const PoseList& t) { return t.poses.size(); })
      .def("__repr__",
           [](const PoseList& t) { return fmt::format("<semvslam.Trajectory of {} poses>", t.poses.size()); });
}

}  // namespace

void bind_data(py::module_& m) {
  bind_camera(m);
  bind_trajectory(m);
  bind_frames(m);
  m.def("camera_presets", &camera_preset_names, "Names of the built-in cameras.");
}

}  // namespace semvslam
