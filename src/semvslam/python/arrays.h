#pragma once

#include <pybind11/numpy.h>
#include <pybind11/pybind11.h>

#include <filesystem>
#include <opencv2/core.hpp>
#include <string>
#include <utility>
#include <vector>

#include "semvslam/base/config_schema.h"
#include "semvslam/base/result.h"
#include "semvslam/data/frame.h"
#include "semvslam/geometry/se3.h"

namespace semvslam {

/// Raises the Error as what Python has for it: ValueError, FileNotFoundError, OSError, NotImplementedError or
/// RuntimeError.
[[noreturn]] void raise(const Error& error);
void raise_if(const Status& status);
template <typename T>
T value_or_raise(Result<T> result) {
  if (!result) raise(result.error());
  return *std::move(result);
}

/// A path as Python gives it: str or os.PathLike.
std::filesystem::path path_of(const pybind11::handle& path);

/// Sets values from a dict of keys as `semvslam config` lists them: {"orb.features": 1500}. Raises ValueError.
void set_values(ConfigSchema schema, const pybind11::dict& values);

/// An image that the system may keep: a copy. RGB becomes BGR. Raises ValueError with the argument's name.
/// @param rgb uint8 [height, width, 3], or [height, width] for grey.
cv::Mat colour_of(const pybind11::array& rgb, const char* name);
/// @param depth uint16 [height, width] in the camera's units, or float32 in metres.
cv::Mat depth_of(const pybind11::array& depth, const char* name);
/// @param mask bool or uint8 [height, width], non-zero = set; CV_8UC1 with 0 and 255.
cv::Mat mask_of(const pybind11::array& mask, const char* name);

/// The image itself, which lives as long as the array, [height, width] or [height, width, 3]; BGR is seen as RGB. Not
/// writable. None where it is empty.
pybind11::object view_of(const cv::Mat& image);
/// A new bool array [height, width]. @param mask CV_8UC1, non-zero = set; where empty, `size` without any set.
pybind11::array_t<bool> bools_of(const cv::Mat& mask, cv::Size size);

/// float64 [4, 4].
pybind11::array_t<double> matrix_of(const SE3& a_from_b);
/// @param matrix [4, 4] of a rigid motion. Raises ValueError for anything else.
SE3 motion_of(const pybind11::array_t<double, pybind11::array::c_style | pybind11::array::forcecast>& matrix);

/// Each is one subject's classes and functions.
void bind_data(pybind11::module_& m);
void bind_slam(pybind11::module_& m);
void bind_segmenter(pybind11::module_& m);
void bind_dense(pybind11::module_& m);
void bind_eval(pybind11::module_& m);

}  // namespace semvslam
