// The map of the static scene as points.
#include <algorithm>

#include "semvslam/dense/dense_file.h"
#include "semvslam/dense/voxel_map.h"
#include "semvslam/python/arrays.h"

namespace py = pybind11;
using namespace py::literals;

namespace semvslam {
namespace {

class PointMap {
 public:
  PointMap(const Camera& camera, const py::dict& values) : options_(options_of(values)), map_(camera, options_) {}

  void add(const RgbdFrame& frame, const py::array_t<double, py::array::c_style | py::array::forcecast>& pose,
           const py::object& moving) {
    const cv::Mat mask = moving.is_none() ? cv::Mat() : mask_of(py::array(moving), "moving");
    raise_if(map_.integrate(frame, mask, motion_of(pose)));
  }
  py::tuple points() {
    const std::vector<CloudPoint> cloud = map_.points();
    const auto n = static_cast<py::ssize_t>(cloud.size());
    py::array_t<float> xyz({n, py::ssize_t{3}});
    py::array_t<std::uint8_t> rgb({n, py::ssize_t{3}});
    float* position = xyz.mutable_data();
    std::uint8_t* colour = rgb.mutable_data();
    for (const CloudPoint& p : cloud) {
      position = std::copy_n(p.position_m.data(), 3, position);
      colour = std::ranges::copy(p.rgb, colour).out;
    }
    return py::make_tuple(xyz, rgb);
  }
  void write(const py::object& path) {
    const std::filesystem::path file = path_of(path);
    const DenseFormat format = value_or_raise(dense_format(file));
    DenseMap map{map_.points(), {}, {}, options_.octree_m};
    if (is_octree(format)) map.leaves = map_.octree(map.points);
    raise_if(write_dense_map(file, map));
  }

 private:
  static DenseOptions options_of(const py::dict& values) {
    DenseOptions options;
    ConfigSchema schema;
    options.add_to(schema);
    set_values(std::move(schema), values);
    raise_if(options.check());
    return options;
  }

  DenseOptions options_;
  VoxelMap map_;
};

}  // namespace

void bind_dense(py::module_& m) {
  py::class_<PointMap>(m, "DenseMap",
                       "Key frames fused in voxels: one point each, without what moved and what was looked through.")
      .def(py::init<const Camera&, const py::dict&>(), "camera"_a, py::kw_only(), "values"_a = py::dict(),
           "values: of keys dense.*, as `semvslam config` lists them.")
      .def("add", &PointMap::add, "frame"_a, "world_from_camera"_a, "moving"_a = py::none(),
           "A Frame with depth, its final pose [4, 4], and bool [height, width], set where something moves.")
      .def("points", &PointMap::points, "(float32 [n, 3] metres, uint8 [n, 3] RGB)")
      .def("write", &PointMap::write, "path"_a, "Points (.ply, .pcd) or an octree (.bt, .ot), by the name.");
}

}  // namespace semvslam
