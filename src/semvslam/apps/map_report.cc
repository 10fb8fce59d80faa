#include "semvslam/apps/map_report.h"

#include <fmt/core.h>

#include <algorithm>
#include <nlohmann/json.hpp>

#include "semvslam/map/map_file.h"

namespace semvslam {

MapReport report_of(const Map& map, const std::string& file, std::uintmax_t bytes) {
  MapReport report;
  report.file = file;
  report.bytes = bytes;
  report.version = kMapFileVersion;
  report.camera = map.model().camera();
  report.key_frames = map.key_frames().size();
  report.landmarks = map.landmark_count();
  report.levels = map.model().levels();
  for (const LandmarkId id : map.landmark_ids()) {
    const Landmark& landmark = *map.landmark(id);
    report.observations += landmark.observations.size();
    report.extent.extend(landmark.position);
  }
  for (const auto& [id, key_frame] : map.key_frames()) {
    const double stamp_s = key_frame.stamp.seconds();
    const bool first = id == map.key_frames().begin()->first;
    report.recorded_from_s = first ? stamp_s : std::min(report.recorded_from_s, stamp_s);
    report.recorded_to_s = first ? stamp_s : std::max(report.recorded_to_s, stamp_s);
  }
  return report;
}

std::string format_text(const MapReport& r) {
  const Camera& c = r.camera;
  std::string out =
      fmt::format("{}: map file of version {}, {:.1f} MB\n", r.file, r.version, static_cast<double>(r.bytes) / 1e6);
  out += fmt::format("key frames    {}\n", r.key_frames);
  out += fmt::format("landmarks     {}, seen {} times\n", r.landmarks, r.observations);
  if (!r.extent.isEmpty()) {
    const Eigen::Vector3d &a = r.extent.min(), &b = r.extent.max();
    out += fmt::format("extent        x {:.2f} to {:.2f}, y {:.2f} to {:.2f}, z {:.2f} to {:.2f} m\n", a.x(), b.x(),
                       a.y(), b.y(), a.z(), b.z());
  }
  if (r.key_frames > 0) out += fmt::format("recorded      {:.3f} to {:.3f} s\n", r.recorded_from_s, r.recorded_to_s);
  out += fmt::format("camera        {}x{}, fx {} fy {} cx {} cy {}\n", c.width_px, c.height_px, c.fx_px, c.fy_px,
                     c.cx_px, c.cy_px);
  if (!c.distortion.is_zero()) {
    const BrownDistortion& d = c.distortion;
    out += fmt::format("lens          k1 {} k2 {} p1 {} p2 {} k3 {}\n", d.k1, d.k2, d.p1, d.p2, d.k3);
  }
  return out;
}

std::string format_json(const MapReport& r) {
  using Json = nlohmann::ordered_json;
  const Camera& c = r.camera;
  const BrownDistortion& d = c.distortion;
  const auto corner = [&](const Eigen::Vector3d& p) { return r.extent.isEmpty() ? Json() : Json{p.x(), p.y(), p.z()}; };
  const Json json = {{"file", r.file},
                     {"bytes", r.bytes},
                     {"version", r.version},
                     {"key_frames", r.key_frames},
                     {"landmarks", r.landmarks},
                     {"observations", r.observations},
                     {"extent_m", {{"min", corner(r.extent.min())}, {"max", corner(r.extent.max())}}},
                     {"recorded_from_s", r.recorded_from_s},
                     {"recorded_to_s", r.recorded_to_s},
                     {"camera",
                      {{"width", c.width_px},
                       {"height", c.height_px},
                       {"fx", c.fx_px},
                       {"fy", c.fy_px},
                       {"cx", c.cx_px},
                       {"cy", c.cy_px},
                       {"k1", d.k1},
                       {"k2", d.k2},
                       {"p1", d.p1},
                       {"p2", d.p2},
                       {"k3", d.k3}}},
                     {"orb_levels", r.levels}};
  return json.dump(2, ' ', false, Json::error_handler_t::replace) + "\n";
}

}  // namespace semvslam
