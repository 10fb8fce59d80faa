#include "semvslam/data/camera_file.h"

#include <fmt/format.h>
#include <yaml-cpp/yaml.h>

#include <algorithm>
#include <cctype>
#include <cmath>

#include "semvslam/base/foreign_text.h"
#include "semvslam/data/file_io.h"
#include "semvslam/data/text_scan.h"

namespace semvslam {
namespace {

constexpr std::size_t kMaxCameraFileBytes = 64 * 1024;

/// A key of the file: where its value goes. `alias_of` is another spelling of the same value.
struct Key {
  const char* name;
  double* field;
  bool required;
};

/// The camera's values as doubles, all of them, so that one loop reads them.
struct Values {
  double width = 0, height = 0;
  Camera camera;

  std::vector<Key> keys() {
    BrownDistortion& d = camera.distortion;
    return {{"width", &width, true},
            {"height", &height, true},
            {"fx", &camera.fx_px, true},
            {"fy", &camera.fy_px, true},
            {"cx", &camera.cx_px, true},
            {"cy", &camera.cy_px, true},
            {"k1", &d.k1, false},
            {"k2", &d.k2, false},
            {"p1", &d.p1, false},
            {"p2", &d.p2, false},
            {"k3", &d.k3, false},
            {"depth_units_per_m", &camera.depth_units_per_m, false},
            {"depth_factor", &camera.depth_units_per_m, false},
            {"depth_scale", &camera.depth_units_per_m, false},
            {"baseline", &camera.baseline_m, false},
            {"fps", &camera.frame_rate_hz, false}};
  }
};

std::string nearest_key(const std::vector<Key>& keys, std::string_view key) {
  const auto distance = [&](const Key& k) { return edit_distance(k.name, key.substr(0, 40)); };
  return std::min_element(keys.begin(), keys.end(),
                          [&](const Key& a, const Key& b) { return distance(a) < distance(b); })
      ->name;
}

/// yaml-cpp recurses into nested collections; a camera file has none, so anything nested is refused before it is
/// parsed.
bool is_nested(std::string_view text) {
  for (const TextLine& line : content_lines(text))
    if (line.text.substr(0, line.text.find('#')).find_first_of("[{&*!?") != std::string_view::npos) return true;
  return false;
}

Status read_entry(const std::string& key, const YAML::Node& value, int line, const std::string& name,
                  const std::vector<Key>& keys, std::vector<const Key*>& seen) {
  const auto fail = [&](const std::string& what) {
    return Status(Error{ErrorCode::kInvalidInput, fmt::format("{}:{}: {}", name, line, what)});
  };
  const auto known = std::find_if(keys.begin(), keys.end(), [&](const Key& k) { return key == k.name; });
  if (known == keys.end())
    return fail(fmt::format("unknown key {}; did you mean '{}'?", in_quotes(key), nearest_key(keys, key)));
  for (const Key* k : seen)
    if (k->field == known->field) return fail(fmt::format("'{}' is set a second time (first as '{}')", key, k->name));
  const std::optional<double> number = value.IsScalar() ? parse_double(value.Scalar()) : std::nullopt;
  if (!number || !std::isfinite(*number)) return fail(fmt::format("'{}' must be a finite number", key));
  *known->field = *number;
  seen.push_back(&*known);
  return Status::success();
}

Result<Camera> checked(Values values, const std::string& name) {
  const auto fail = [&](const std::string& what) { return Error{ErrorCode::kInvalidInput, name + ": " + what}; };
  for (const auto& [key, value] : {std::pair{"width", values.width}, std::pair{"height", values.height}})
    if (!(value >= 1 && value <= 65536 && value == std::floor(value)))
      return fail(fmt::format("'{}' must be a whole number of pixels, got {}", key, value));
  values.camera.width_px = static_cast<int>(values.width);
  values.camera.height_px = static_cast<int>(values.height);
  if (values.camera.fy_px < 0)
    return fail(fmt::format("fy is negative ({}): write {} (ICL-NUIM's sign only says that its y axis points up)",
                            values.camera.fy_px, -values.camera.fy_px));
  if (Status s = values.camera.check(); !s) return fail(s.error().message);
  return values.camera;
}

Camera preset(double fx, double fy, double cx, double cy, BrownDistortion distortion) {
  Camera camera;
  camera.width_px = 640;
  camera.height_px = 480;
  camera.fx_px = fx;
  camera.fy_px = fy;
  camera.cx_px = cx;
  camera.cy_px = cy;
  camera.distortion = distortion;
  camera.depth_units_per_m = 5000;
  camera.frame_rate_hz = 30;
  return camera;
}

}  // namespace

Result<Camera> parse_camera(const std::string& text, const std::string& name) {
  const auto fail = [&](const std::string& what) { return Error{ErrorCode::kInvalidInput, name + ": " + what}; };
  if (is_nested(text))
    return fail("a camera file is a flat list of 'key: number' lines; no lists, maps, tags or anchors");
  Values values;
  const std::vector<Key> keys = values.keys();
  std::vector<const Key*> seen;
  try {
    const YAML::Node root = YAML::Load(text);
    if (!root.IsMap()) return fail("not a list of 'key: number' lines");
    for (const auto& entry : root) {
      const int line = entry.first.Mark().line + 1;
      if (!entry.first.IsScalar()) return fail(fmt::format("line {}: a key must be a word", line));
      if (Status s = read_entry(entry.first.Scalar(), entry.second, line, name, keys, seen); !s) return s.error();
    }
  } catch (const YAML::Exception& e) {
    return Error{ErrorCode::kInvalidInput,
                 fmt::format("{}:{}: not valid YAML: {}", name, e.mark.line + 1, in_quotes(e.msg))};
  }
  for (const Key& key : keys) {
    const bool set = std::any_of(seen.begin(), seen.end(), [&](const Key* k) { return k->field == key.field; });
    if (key.required && !set) return fail(fmt::format("key '{}' is missing", key.name));
  }
  return checked(values, name);
}

Result<Camera> read_camera(const std::filesystem::path& path) {
  const Result<std::string> text = read_text_file(path, kMaxCameraFileBytes);
  if (!text) return text.error();
  return parse_camera(*text, path.string());
}

std::string format_camera(const Camera& c) {
  // {} of a double is the shortest text that reads back as the same double.
  const BrownDistortion& d = c.distortion;
  return fmt::format(
      "width: {}\nheight: {}\nfps: {}\nfx: {}\nfy: {}\ncx: {}\ncy: {}\nk1: {}\nk2: {}\np1: {}\np2: {}\nk3: {}\n"
      "depth_units_per_m: {}\nbaseline: {}\n",
      c.width_px, c.height_px, c.frame_rate_hz, c.fx_px, c.fy_px, c.cx_px, c.cy_px, d.k1, d.k2, d.p1, d.p2, d.k3,
      c.depth_units_per_m, c.baseline_m);
}

Result<Camera> camera_preset(std::string_view name) {
  // TUM: vision.in.tum.de/data/datasets/rgbd-dataset/file_formats (fr3 images are published undistorted).
  if (name == "tum_fr1") return preset(517.3, 516.5, 318.6, 255.3, {0.2624, -0.9531, -0.0054, 0.0026, 1.1633});
  if (name == "tum_fr2") return preset(520.9, 521.0, 325.1, 249.7, {0.2312, -0.7849, -0.0033, -0.0001, 0.9172});
  if (name == "tum_fr3") return preset(535.4, 539.2, 320.1, 247.6, {});
  // Bonn: ipb.uni-bonn.de/data/rgbd-dynamic-dataset.
  if (name == "bonn")
    return preset(542.822841, 542.576870, 315.593520, 237.756098, {0.039903, -0.099343, -0.000730, -0.000144, 0.0});
  // ICL-NUIM publishes fy = -480 because its y axis points up. Its image rows run downwards like everybody's, so the
  // same pixels seen by a camera whose y axis points down, as ours, have fy = +480; read_ground_truth mirrors its poses
  // to fit.
  if (name == "icl") return preset(481.2, 480.0, 319.5, 239.5, {});
  return invalid_input(fmt::format("no built-in camera {}; there are: {}", in_quotes(std::string(name)),
                                   fmt::join(camera_preset_names(), ", ")));
}

std::vector<std::string> camera_preset_names() { return {"tum_fr1", "tum_fr2", "tum_fr3", "bonn", "icl"}; }

std::string camera_preset_of_folder(const std::string& folder_name) {
  std::string name = folder_name;
  std::transform(name.begin(), name.end(), name.begin(), [](unsigned char c) { return std::tolower(c); });
  const auto has = [&](const char* part) { return name.find(part) != std::string::npos; };
  for (const char* number : {"1", "2", "3"})
    if (has((std::string("freiburg") + number).c_str()) || name.starts_with(std::string("fr") + number + '_'))
      return std::string("tum_fr") + number;
  if (has("rgbd_bonn")) return "bonn";
  if (has("frei_png") || has("living_room_traj") || has("office_room_traj") || has("icl_nuim") || has("icl-nuim"))
    return "icl";
  return "";
}

}  // namespace semvslam
