#pragma once

#include <Eigen/Geometry>
#include <cstdint>
#include <string>

#include "semvslam/geometry/camera.h"
#include "semvslam/map/map.h"

namespace semvslam {

/// What there is to say about a saved map.
struct MapReport {
  std::string file;
  std::uintmax_t bytes = 0;
  std::uint32_t version = 0;  // of the file
  std::size_t key_frames = 0, landmarks = 0, observations = 0;
  Eigen::AlignedBox3d extent;                     // of the landmarks, world frame, metres; empty without any
  double recorded_from_s = 0, recorded_to_s = 0;  // least and largest stamp of a key frame; 0 without any
  Camera camera;
  int levels = 0;  // of the pyramid
};

MapReport report_of(const Map& map, const std::string& file, std::uintmax_t bytes);
std::string format_text(const MapReport& report);
std::string format_json(const MapReport& report);

}  // namespace semvslam
