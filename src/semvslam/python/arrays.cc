#include "semvslam/python/arrays.h"

#include <fmt/format.h>

#include <Eigen/LU>
#include <cstring>
#include <memory>
#include <opencv2/imgproc.hpp>

namespace py = pybind11;

namespace semvslam {
namespace {

PyObject* python_type_of(ErrorCode code) {
  switch (code) {
    case ErrorCode::kInvalidInput:
      return PyExc_ValueError;
    case ErrorCode::kNotFound:
      return PyExc_FileNotFoundError;
    case ErrorCode::kIo:
      return PyExc_OSError;
    case ErrorCode::kUnsupported:
      return PyExc_NotImplementedError;
    case ErrorCode::kInternal:
      break;
  }
  return PyExc_RuntimeError;
}

std::string shape_text(const py::array& array) {
  std::string out = fmt::format("{} [", py::str(array.dtype()).cast<std::string>());
  for (py::ssize_t i = 0; i < array.ndim(); ++i) out += fmt::format("{}{}", i > 0 ? ", " : "", array.shape(i));
  return out + "]";
}

[[noreturn]] void refuse(const py::array& array, const char* name, const char* wanted) {
  throw py::value_error(fmt::format("{} must be {}; it is {}", name, wanted, shape_text(array)));
}

/// Raises for what is no image of OpenCV's size.
cv::Size size_of(const py::array& array, const char* name, const char* wanted) {
  constexpr py::ssize_t kLargest = 1 << 15;
  if (array.ndim() < 2 || array.shape(0) < 1 || array.shape(1) < 1 || array.shape(0) > kLargest ||
      array.shape(1) > kLargest)
    refuse(array, name, wanted);
  return {static_cast<int>(array.shape(1)), static_cast<int>(array.shape(0))};
}

template <typename T>
bool holds(const py::array& array) {
  return py::isinstance<py::array_t<T>>(array);
}

/// @param array of T, whatever its strides.
template <typename T>
cv::Mat copy_of(const py::array& array, cv::Size size, int type) {
  const py::array_t<T, py::array::c_style | py::array::forcecast> dense(array);
  cv::Mat out(size, type);
  std::memcpy(out.data, dense.data(), static_cast<std::size_t>(dense.nbytes()));
  return out;
}

}  // namespace

void raise(const Error& error) {
  PyErr_SetString(python_type_of(error.code), error.message.c_str());
  throw py::error_already_set();
}

void raise_if(const Status& status) {
  if (!status) raise(status.error());
}

std::filesystem::path path_of(const py::handle& path) {
  return py::str(py::module_::import("os").attr("fspath")(path)).cast<std::string>();
}

void set_values(ConfigSchema schema, const py::dict& values) {
  for (const auto& [key, value] : values) {
    const std::string text =
        py::isinstance<py::bool_>(value) ? (value.cast<bool>() ? "true" : "false") : py::str(value).cast<std::string>();
    raise_if(schema.set(py::str(key).cast<std::string>() + "=" + text, "values"));
  }
}

cv::Mat colour_of(const py::array& rgb, const char* name) {
  constexpr const char* kWanted = "uint8 [height, width, 3] (RGB) or [height, width] (grey)";
  const cv::Size size = size_of(rgb, name, kWanted);
  const bool is_grey = rgb.ndim() == 2;
  if (!holds<std::uint8_t>(rgb) || !(is_grey || (rgb.ndim() == 3 && rgb.shape(2) == 3))) refuse(rgb, name, kWanted);
  cv::Mat out = copy_of<std::uint8_t>(rgb, size, is_grey ? CV_8UC1 : CV_8UC3);
  if (!is_grey) cv::cvtColor(out, out, cv::COLOR_RGB2BGR);
  return out;
}

cv::Mat depth_of(const py::array& depth, const char* name) {
  constexpr const char* kWanted = "[height, width] of uint16 (the camera's units) or float32 (metres)";
  const cv::Size size = size_of(depth, name, kWanted);
  if (depth.ndim() == 2 && holds<std::uint16_t>(depth)) return copy_of<std::uint16_t>(depth, size, CV_16UC1);
  if (depth.ndim() == 2 && holds<float>(depth)) return copy_of<float>(depth, size, CV_32FC1);
  refuse(depth, name, kWanted);
}

cv::Mat mask_of(const py::array& mask, const char* name) {
  constexpr const char* kWanted = "[height, width] of bool or uint8";
  const cv::Size size = size_of(mask, name, kWanted);
  if (mask.ndim() != 2 || !(holds<bool>(mask) || holds<std::uint8_t>(mask))) refuse(mask, name, kWanted);
  return copy_of<bool>(mask, size, CV_8UC1) * 255;
}

py::object view_of(const cv::Mat& image) {
  if (image.empty()) return py::none();
  auto owner = std::make_unique<cv::Mat>(image);
  const cv::Mat& kept = *owner;
  const auto step = static_cast<py::ssize_t>(kept.step[0]);
  const py::capsule base(owner.release(), [](void* mat) { delete static_cast<cv::Mat*>(mat); });
  const std::vector<py::ssize_t> shape = {kept.rows, kept.cols};
  py::array view;
  switch (kept.type()) {
    case CV_8UC1:
      view = py::array(py::dtype::of<std::uint8_t>(), shape, {step, py::ssize_t{1}}, kept.data, base);
      break;
    case CV_8UC3:
      // Read backwards, from the last channel on.
      view = py::array(py::dtype::of<std::uint8_t>(), {shape[0], shape[1], py::ssize_t{3}},
                       {step, py::ssize_t{3}, py::ssize_t{-1}}, kept.data + 2, base);
      break;
    case CV_16UC1:
      view = py::array(py::dtype::of<std::uint16_t>(), shape, {step, py::ssize_t{2}}, kept.data, base);
      break;
    case CV_32FC1:
      view = py::array(py::dtype::of<float>(), shape, {step, py::ssize_t{4}}, kept.data, base);
      break;
    default:
      throw std::logic_error("an image of a type that has no array");
  }
  view.attr("setflags")(py::arg("write") = false);
  return view;
}

py::array_t<bool> bools_of(const cv::Mat& mask, cv::Size size) {
  if (!mask.empty()) size = mask.size();
  py::array_t<bool> out({size.height, size.width});
  cv::Mat target(size, CV_8UC1, out.mutable_data());
  if (mask.empty())
    target.setTo(0);
  else
    cv::threshold(mask, target, 0, 1, cv::THRESH_BINARY);
  return out;
}

py::array_t<double> matrix_of(const SE3& a_from_b) {
  py::array_t<double> out({4, 4});
  Eigen::Map<Eigen::Matrix<double, 4, 4, Eigen::RowMajor>> matrix(out.mutable_data());
  matrix.setIdentity();
  matrix.topLeftCorner<3, 3>() = a_from_b.rotation_matrix();
  matrix.topRightCorner<3, 1>() = a_from_b.translation();
  return out;
}

SE3 motion_of(const py::array_t<double, py::array::c_style | py::array::forcecast>& matrix) {
  if (matrix.ndim() != 2 || matrix.shape(0) != 4 || matrix.shape(1) != 4)
    refuse(matrix, "a pose", "[4, 4], a rigid motion");
  const Eigen::Map<const Eigen::Matrix<double, 4, 4, Eigen::RowMajor>> m(matrix.data());
  const Eigen::Matrix3d rotation = m.topLeftCorner<3, 3>();
  constexpr double kTolerance = 1e-3;  // numbers that went through a text file
  if (!m.allFinite() || !(rotation * rotation.transpose()).isIdentity(kTolerance) || rotation.determinant() < 0 ||
      !m.row(3).isApprox(Eigen::RowVector4d(0, 0, 0, 1), kTolerance))
    throw py::value_error("a pose must be a rigid motion: a rotation without scale or mirroring, (0, 0, 0, 1) below");
  return {rotation, m.topRightCorner<3, 1>()};
}

}  // namespace semvslam
