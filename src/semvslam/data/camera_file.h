#pragma once

#include <filesystem>
#include <string>
#include <string_view>
#include <vector>

#include "semvslam/base/result.h"
#include "semvslam/geometry/camera.h"

namespace semvslam {

/// Parses a camera description, flat YAML with these keys (pixels, metres, hertz):
///   width, height, fx, fy, cx, cy       required
///   k1, k2, p1, p2, k3                  Brown distortion, OpenCV's meaning; default 0
///   depth_units_per_m                   default 5000; also spelled depth_factor or depth_scale
///   baseline                            of the depth sensor, default 0.075
///   fps                                 default 30
/// Errors name `name`, the line and the key: no YAML, an unknown key (with the nearest known one), a missing key, a
/// value that is not a number, a camera that cannot be (Camera::check).
Result<Camera> parse_camera(const std::string& text, const std::string& name);

Result<Camera> read_camera(const std::filesystem::path& path);

/// The text that parse_camera reads back as the same camera, bit for bit.
std::string format_camera(const Camera& camera);

/// Built-in cameras by name: tum_fr1, tum_fr2, tum_fr3 (TUM RGB-D benchmark), bonn (Bonn RGB-D dynamic), icl
/// (ICL-NUIM). Intrinsics as published by the makers of the recordings. Errors: an unknown name.
Result<Camera> camera_preset(std::string_view name);
std::vector<std::string> camera_preset_names();

/// The preset that belongs to a folder's customary name: rgbd_dataset_freiburg1_*, fr1_*, rgbd_bonn_*, *frei_png*, or
/// "".
std::string camera_preset_of_folder(const std::string& folder_name);

}  // namespace semvslam
