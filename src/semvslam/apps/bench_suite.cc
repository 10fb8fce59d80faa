#include "semvslam/apps/bench_suite.h"

#include <fmt/format.h>
#include <glob.h>

#include <algorithm>
#include <charconv>
#include <deque>
#include <set>
#include <system_error>
#include <utility>

#include "semvslam/apps/render_scene.h"
#include "semvslam/base/config_schema.h"
#include "semvslam/base/foreign_text.h"
#include "semvslam/base/yaml_scalars.h"
#include "semvslam/data/camera_file.h"
#include "semvslam/pipeline/config.h"
#include "semvslam/pipeline/presets.h"

namespace semvslam {
namespace fs = std::filesystem;

namespace {

constexpr double kNoLimit = -1;
constexpr std::size_t kMostNameBytes = 100;

Error at(const std::string& where, const Error& error) { return {error.code, where + ": " + error.message}; }

/// Limits as they are written: numbers below zero are none.
struct LimitsText {
  std::string mode;
  double ate_rmse_m = kNoLimit, ate_share_of_way = kNoLimit, tracked_share = kNoLimit;
  bool given = false;

  void add_to(ConfigSchema& s) {
    s.add("limits.mode", &mode, {}, "the mode that is bound; empty = all");
    s.add("limits.ate_rmse_m", &ate_rmse_m, {0, 1e6}, "ATE RMSE at most, m");
    s.add("limits.ate_share_of_way", &ate_share_of_way, {0, 1e6}, "ATE RMSE at most, share of the true way's length");
    s.add("limits.tracked_share", &tracked_share, {0, 1}, "share of the frames tracked at least");
  }
  BenchLimits limits() const {
    const auto number = [](double v) { return v < 0 ? std::nullopt : std::optional(v); };
    return {mode, number(ate_rmse_m), number(ate_share_of_way), number(tracked_share)};
  }
};

/// An entry of `sequences` as it is written.
struct EntryText {
  std::string where, path, name, people, size = "640x480";
  SceneOptions scene;
  int seed = 1;
  bool exact = false;
  std::string scene_key;  // the first key that only a scene has; empty = none
  std::vector<std::string> modes;
  LimitsText limits;
  CameraChoice camera;

  ConfigSchema schema() {
    ConfigSchema s;
    s.add("path", &path, {}, "folder of a recording, or a pattern for several");
    s.add("name", &name, {}, "in the tables");
    s.add("modes", &modes_text_, {}, "instead of the suite's");
    s.add("camera", &camera.file, {}, "camera file instead of the recording's");
    s.add("camera_preset", &camera.preset, {}, "built-in camera instead of the recording's");
    s.add("people", &people, {}, "of a rendered scene: walking, sitting, carrying or none");
    s.add("motion", &scene.motion, {}, "of the camera: xyz, rpy, halfsphere, static or tour");
    s.add("frames", &scene.frames, {1, 1e7}, "how many are rendered");
    s.add("rate", &scene.frame_rate_hz, {0.1, 1000}, "frames per second");
    s.add("size", &size, {}, "of the images, WIDTHxHEIGHT");
    s.add("seed", &seed, {0, 1e9}, "of everything that is random");
    s.add("exact", &exact, "no noise in depth and colour");
    s.add("blur", &scene.motion_blur, "motion blur");
    limits.add_to(s);
    return s;
  }

  Result<SuiteEntry> entry() const {
    SuiteEntry out{path, std::nullopt, name, modes, std::nullopt, camera};
    if (limits.given) out.limits = limits.limits();
    if (path.empty() == people.empty())
      return invalid_input(where + ": a sequence needs either 'path' or, to be rendered, 'people'");
    if (!path.empty() && !scene_key.empty())
      return invalid_input(
          fmt::format("{}: '{}' is for rendered scenes and does not go with 'path'", where, scene_key));
    if (!camera.file.empty() && !camera.preset.empty())
      return invalid_input(where + ": 'camera' and 'camera_preset' exclude each other");
    if (people.empty()) return out;
    if (!camera.file.empty() || !camera.preset.empty())
      return invalid_input(where + ": a rendered scene has a camera of its own: 'camera' goes with 'path'");
    out.scene = scene;
    out.scene->people = people;
    out.scene->seed = static_cast<std::uint64_t>(seed);
    out.scene->noise = !exact;
    if (!parse_size(size, out.scene->width_px, out.scene->height_px))
      return invalid_input(fmt::format("{}: size is WIDTHxHEIGHT like 640x480, got {}", where, in_quotes(size)));
    if (const Status status = out.scene->check(); !status) return at(where, status.error());
    if (out.name.empty()) out.name = fmt::format("{}_{}{}", people, scene.motion, exact ? "_exact" : "");
    return out;
  }

 private:
  std::string modes_text_;  // only to be known: values go to `modes`
};

/// The suite as it is written.
class SuiteText {
 public:
  SuiteText() { limits_.add_to(schema_); }

  Status take(const YamlScalar& scalar) {
    const auto [head, rest] = split(scalar.path);
    if (head == "modes") return take_modes(suite_.modes, fresh_modes_, rest, scalar);
    if (head == "sequences") return take_sequence(rest, scalar);
    if (head == "set" && !rest.empty()) {
      suite_.assignments.push_back(rest + '=' + scalar.value);
      return check_assignment(suite_.assignments.back(), scalar.where);
    }
    // Below a key that is not known at all, the key is what should be named.
    const std::string& key = knows(head) ? scalar.path : head;
    return schema_.set(fmt::format("{}={}", key, scalar.value), scalar.where);
  }

  Result<BenchSuite> finish(const std::string& origin) {
    for (const EntryText& text : entries_) {
      Result<SuiteEntry> entry = text.entry();
      if (!entry) return entry.error();
      suite_.entries.push_back(std::move(*entry));
    }
    const Result<Delta> delta = Delta::parse(delta_);
    if (!delta) return at(origin + ": rpe_delta", delta.error());
    suite_.rpe_delta = *delta;
    suite_.max_frames = static_cast<std::uint64_t>(max_frames_);
    suite_.limits = limits_.limits();
    choose_baseline(suite_);
    if (const Status status = suite_.check(); !status) return at(origin, status.error());
    return std::move(suite_);
  }

  BenchSuite& suite() { return suite_; }

 private:
  bool knows(const std::string& head) const {
    const std::vector<std::string> keys = schema_.keys();
    return std::any_of(keys.begin(), keys.end(),
                       [&](const std::string& key) { return key == head || key.starts_with(head + '.'); });
  }

  static std::pair<std::string, std::string> split(const std::string& path) {
    const auto dot = path.find('.');
    if (dot == std::string::npos) return {path, ""};
    return {path.substr(0, dot), path.substr(dot + 1)};
  }

  /// A list "modes.0", "modes.1"... or one text with commas. @param fresh whether the list still holds the default
  static Status take_modes(std::vector<std::string>& modes, bool& fresh, const std::string& rest,
                           const YamlScalar& scalar) {
    if (std::exchange(fresh, false)) modes.clear();
    for (std::string& mode : rest.empty() ? split_list(scalar.value) : std::vector{scalar.value}) {
      if (const auto known = preset_of(mode); !known) return at(scalar.where, known.error());
      modes.push_back(std::move(mode));
    }
    return Status::success();
  }

  /// In every mode the same values exist; what they mean together is checked later.
  static Status check_assignment(const std::string& assignment, const std::string& where) {
    Config config;
    return config.schema().set(assignment, where + ": set");
  }

  Status take_sequence(const std::string& path, const YamlScalar& scalar) {
    const auto [position, key] = split(path);
    std::size_t index = 0;  // `sequences: one` is a list of one
    if (!position.empty()) {
      const auto [end, code] = std::from_chars(position.data(), position.data() + position.size(), index);
      if (code != std::errc() || end != position.data() + position.size() || index > entries_.size())
        return invalid_input(scalar.where + ": 'sequences' is a list: put '- ' before each of its entries");
    }
    if (index == entries_.size()) entries_.emplace_back().where = scalar.where;
    EntryText& entry = entries_[index];
    const auto [head, rest] = split(key);
    bool filled = false;
    if (head == "modes") return take_modes(entry.modes, filled, rest, scalar);
    static const std::set<std::string> scene_keys = {"people", "motion", "frames", "rate",
                                                     "size",   "seed",   "exact",  "blur"};
    if (entry.scene_key.empty() && scene_keys.contains(key)) entry.scene_key = key;
    entry.limits.given = entry.limits.given || head == "limits";
    return entry.schema().set(fmt::format("{}={}", key.empty() ? "path" : key, scalar.value), scalar.where);
  }

  BenchSuite suite_;
  std::deque<EntryText> entries_;
  LimitsText limits_;
  std::string delta_ = "1s";
  int max_frames_ = 0;
  bool fresh_modes_ = true;
  std::string unused_;  // keys that are taken apart elsewhere, to be known as the nearest ones
  ConfigSchema schema_ = [this] {
    ConfigSchema s;
    s.add("name", &suite_.name, {}, "of the suite");
    s.add("about", &suite_.about, {}, "one line for the list of suites");
    s.add("sequences", &unused_, {}, "list of folders, patterns and rendered scenes");
    s.add("modes", &unused_, {}, "that every sequence is run in");
    s.add("set", &unused_, {}, "configuration values for all runs");
    s.add("baseline", &suite_.baseline, {}, "mode that improvements refer to");
    s.add("rpe_delta", &delta_, {}, "step of the relative pose error: seconds (1s) or frames (1f)");
    s.add("runs", &suite_.runs, {1, 1000}, "of every sequence in every mode");
    s.add("max_frames", &max_frames_, {0, 1e9}, "of each run; 0 = all");
    s.add("deterministic", &suite_.deterministic, "two runs give the same bytes; one thread");
    s.add("truth_masks", &suite_.truth_masks, "count features by the true masks in a recording's folder mask/");
    return s;
  }();
};

Status check_once(const std::vector<std::string>& modes) {
  std::set<std::string> seen;
  for (const std::string& mode : modes)
    if (!seen.insert(mode).second) return invalid_input(fmt::format("mode {} is listed twice", in_quotes(mode)));
  return Status::success();
}

/// Folders that a path or pattern means.
std::vector<fs::path> matches(const fs::path& pattern) {
  std::error_code code;
  if (fs::is_directory(pattern, code)) return {pattern};
  glob_t found{};
  std::vector<fs::path> out;
  if (::glob(pattern.c_str(), 0, nullptr, &found) == 0)
    for (std::size_t i = 0; i < found.gl_pathc; ++i)
      if (fs::is_directory(found.gl_pathv[i], code)) out.emplace_back(found.gl_pathv[i]);
  ::globfree(&found);
  return out;
}

/// The folder's name (of a link its own), also of "." and of a path that ends in a slash; those of TUM's downloads as
/// everybody writes them: fr3_walking_xyz.
std::string name_of(const fs::path& folder) {
  fs::path whole = fs::absolute(folder).lexically_normal();
  if (whole.filename().empty()) whole = whole.parent_path();
  std::string name = whole.filename().string();
  constexpr std::string_view kTum = "rgbd_dataset_freiburg";
  if (name.starts_with(kTum)) name.replace(0, kTum.size(), "fr");
  return is_plain_name(name) ? name : "sequence";
}

}  // namespace

bool is_plain_name(std::string_view name) {
  return !name.empty() && name.size() <= kMostNameBytes && name != "." && name != ".." &&
         std::none_of(name.begin(), name.end(), [](unsigned char c) { return c < 0x20 || c == 0x7f || c == '/'; });
}

std::vector<std::string> split_list(std::string_view text) {
  std::vector<std::string> out;
  while (!text.empty()) {
    const auto comma = std::min(text.find(','), text.size());
    if (comma > 0) out.emplace_back(text.substr(0, comma));
    text.remove_prefix(std::min(comma + 1, text.size()));
  }
  return out;
}

void choose_baseline(BenchSuite& suite) {
  if (suite.baseline.empty() && std::find(suite.modes.begin(), suite.modes.end(), "orb") != suite.modes.end())
    suite.baseline = "orb";
}

Status BenchSuite::check() const {
  if (!is_plain_name(name))
    return invalid_input(fmt::format("{} cannot be a suite's name: it names a folder", in_quotes(name)));
  if (entries.empty()) return invalid_input("no 'sequences': nothing to run");
  if (modes.empty()) return invalid_input("no 'modes': nothing to run");
  std::set<std::string> known(modes.begin(), modes.end());
  if (Status status = check_once(modes); !status) return status;
  for (const SuiteEntry& entry : entries) {
    if (Status status = check_once(entry.modes); !status) return status;
    if (!entry.name.empty() && !is_plain_name(entry.name))
      return invalid_input(fmt::format("{} cannot be a sequence's name: it names a folder", in_quotes(entry.name)));
    if (const std::string& preset = entry.camera.preset; !preset.empty())
      if (const auto camera = camera_preset(preset); !camera) return camera.error();
    known.insert(entry.modes.begin(), entry.modes.end());
  }
  for (const std::string& mode : known) {
    Config config;
    if (Status status = config.apply_mode(mode); !status) return status;
    for (const std::string& assignment : assignments)
      if (Status status = config.schema().set(assignment); !status) return status;
    if (const Status status = config.check(); !status) return at("mode " + mode, status.error());
  }
  if (!baseline.empty() && !known.contains(baseline))
    return invalid_input(fmt::format("baseline {} is none of the modes", in_quotes(baseline)));
  std::vector<const BenchLimits*> all = {&limits};
  for (const SuiteEntry& entry : entries)
    if (entry.limits) all.push_back(&*entry.limits);
  for (const BenchLimits* l : all)
    if (const auto mode = preset_of(l->mode); !l->mode.empty() && !mode) return at("limits.mode", mode.error());
  return Status::success();
}

Result<BenchSuite> parse_suite(const std::string& text, const std::string& origin, const std::string& name) {
  const auto scalars = yaml_scalars(text, origin);
  if (!scalars) return scalars.error();
  SuiteText suite;
  suite.suite().name = name;
  for (const YamlScalar& scalar : *scalars)
    if (const Status status = suite.take(scalar); !status) return status.error();
  return suite.finish(origin);
}

BenchSuite suite_of_folders(const std::vector<std::string>& folders) {
  BenchSuite suite;
  suite.name = "recordings";
  suite.modes = {"orb", "full"};
  for (const std::string& folder : folders) suite.entries.push_back({folder, std::nullopt, "", {}, std::nullopt, {}});
  return suite;
}

FoundRecordings find_recordings(const BenchSuite& suite, const fs::path& base) {
  FoundRecordings out;
  std::set<std::string> taken;
  const auto add = [&](const SuiteEntry& entry, const fs::path& folder, const std::string& wanted) {
    std::string name = wanted;
    for (int n = 2; !taken.insert(name).second; ++n) name = fmt::format("{}_{}", wanted, n);
    CameraChoice camera = entry.camera;
    if (!camera.file.empty()) camera.file = fs::absolute(base / camera.file).lexically_normal().string();
    out.recordings.push_back({name, folder, entry.scene, entry.modes.empty() ? suite.modes : entry.modes,
                              entry.limits.value_or(suite.limits), std::move(camera)});
  };
  for (const SuiteEntry& entry : suite.entries) {
    if (entry.scene) {
      add(entry, {}, entry.name);
      continue;
    }
    const std::vector<fs::path> folders = matches(base / entry.path);
    if (folders.empty()) out.missing.push_back((base / entry.path).string());
    for (const fs::path& folder : folders) add(entry, folder, entry.name.empty() ? name_of(folder) : entry.name);
  }
  return out;
}

}  // namespace semvslam
