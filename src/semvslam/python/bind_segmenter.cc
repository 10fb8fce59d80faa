// Objects of an image.
#include <fmt/format.h>

#include <memory>
#include <mutex>

#include "semvslam/python/arrays.h"
#include "semvslam/semantic/segmenter.h"

namespace py = pybind11;
using namespace py::literals;

namespace semvslam {
namespace {

/// One image at a time; further callers wait.
class ImageSegmenter {
 public:
  ImageSegmenter(const py::object& model, const std::string& precision, int threads, int input_width_px, double score) {
    SegmenterOptions options;
    options.keep_up = false;
    if (!model.is_none()) options.model = path_of(model).string();
    options.precision = precision;
    options.threads = threads;
    options.input_width_px = input_width_px;
    options.score = score;
    segmenter_ = value_or_raise(make_segmenter(options, RoleTable()));
  }

  Segmentation segment(const py::array& rgb) {
    const SegmentationRequest request{FrameId(0), TimeStamp{}, colour_of(rgb, "rgb"), ""};
    Result<Segmentation> found = [&] {
      const py::gil_scoped_release others_may_run;
      const std::lock_guard lock(mutex_);
      return segmenter_->segment(request);
    }();
    return value_or_raise(std::move(found));
  }
  const Segmenter& get() const { return *segmenter_; }

 private:
  std::unique_ptr<Segmenter> segmenter_;
  std::mutex mutex_;
};

py::list instances_of(const Segmentation& segmentation) {
  py::list out;
  for (const Instance& i : segmentation.instances) {
    cv::Mat mask = cv::Mat::zeros(segmentation.size, CV_8UC1);
    i.mask.copyTo(mask(i.window));
    out.append(py::dict("class"_a = i.class_name, "role"_a = std::string(to_string(i.role)), "score"_a = i.score,
                        "box"_a = py::make_tuple(i.box.x, i.box.y, i.box.x + i.box.width, i.box.y + i.box.height),
                        "mask"_a = bools_of(mask, {})));
  }
  return out;
}

}  // namespace

void bind_segmenter(py::module_& m) {
  py::class_<Segmentation>(m, "Segmentation", "What is to be seen in one image.")
      .def_property_readonly("instances", &instances_of,
                             "A list of dicts, best first: class, role, score, box (x0, y0, x1, y1; px), mask (bool "
                             "[height, width]).")
      .def("__len__", [](const Segmentation& s) { return s.instances.size(); })
      .def(
          "mask_of",
          [](const Segmentation& s, const std::string& name) { return bools_of(s.mask_of_class(name), s.size); },
          "class_name"_a, "bool [height, width]: where instances of the class are.")
      .def("__repr__", [](const Segmentation& s) {
        return fmt::format("<semvslam.Segmentation, {} instances>", s.instances.size());
      });

  py::class_<ImageSegmenter>(m, "Segmenter", "Our Mask R-CNN, for single pictures.")
      .def(py::init<const py::object&, const std::string&, int, int, double>(), py::kw_only(), "model"_a = py::none(),
           "precision"_a = "auto", "threads"_a = 2, "input_width_px"_a = 0, "score"_a = Segmenter::kLeastScoreOfStills,
           "model: folder of a model.json; None: the network that comes along. precision: auto, f32 or int8. "
           "input_width_px: of the image that the network sees, 0 = 1.2 times the model's. score: the least of an "
           "object.")
      .def("segment", &ImageSegmenter::segment, "rgb"_a, "uint8 [height, width, 3] or [height, width] -> Segmentation")
      .def_property_readonly("class_names", [](const ImageSegmenter& s) {
        py::list names;
        for (const std::string& name : s.get().class_names()) names.append(name);
        return names;
      });
}

}  // namespace semvslam
