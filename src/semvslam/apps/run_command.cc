#include <fmt/core.h>

#include <CLI/CLI.hpp>
#include <limits>
#include <memory>
#include <string>
#include <vector>

#include "semvslam/apps/command.h"
#include "semvslam/apps/run_session.h"
#include "semvslam/data/file_io.h"
#include "semvslam/data/sequence.h"
#include "semvslam/dense/dense_file.h"

namespace semvslam {
namespace {

constexpr const char* kDefaultMode = "full";

struct RunArguments {
  std::string sequence, out, config_file, mode, camera, preset, masks, debug_frames, key_frame_masks, truth_masks, map,
      save_map;
  std::vector<std::string> assignments, dense_maps;
  std::uint64_t max_frames = 0;
  bool deterministic = false, realtime = false, quiet = false, localise = false;
};

/// Applies the file, then --set, then the options that have names of their own: the more special wins.
Status assign_values(const RunArguments& a, const std::string& file_text, Config& config) {
  ConfigSchema schema = config.schema();
  if (!a.config_file.empty())
    if (Status status = schema.load_yaml(file_text, a.config_file); !status) return status;
  for (const std::string& assignment : a.assignments)
    if (Status status = schema.set(assignment); !status) return status;
  if (!a.mode.empty())
    if (Status status = schema.set("mode=" + a.mode, "--mode"); !status) return status;
  if (a.deterministic) config.deterministic = true;
  if (a.realtime) config.realtime = true;
  if (a.localise) config.mapping.frozen = true;
  return config.check();
}

/// The mode's preset, and what the user set on top of it. The mode itself may stand in any of the user's places.
Status fill_config(const RunArguments& a, Config& config) {
  std::string file_text;
  if (!a.config_file.empty()) {
    Result<std::string> text = read_text_file(a.config_file, 1 << 20);
    if (!text) return text.error();
    file_text = std::move(*text);
  }
  Config wanted;
  wanted.mode = kDefaultMode;
  if (Status status = assign_values(a, file_text, wanted); !status) return status;
  if (Status status = config.apply_mode(wanted.mode); !status) return status;
  return assign_values(a, file_text, config);
}

Result<int> run(const RunArguments& a) {
  Config config;
  if (const Status status = fill_config(a, config); !status) return status.error();
  SequenceOptions sequence_options;
  sequence_options.camera_file = a.camera;
  sequence_options.camera_preset = a.preset;
  sequence_options.mask_folder = a.masks;
  RunOptions options;
  options.out = a.out;
  options.quiet = a.quiet;
  options.debug_frames = a.debug_frames;
  options.key_frame_masks = a.key_frame_masks;
  if (!a.truth_masks.empty()) {
    Result<std::filesystem::path> masks = find_folder(a.sequence, a.truth_masks);
    if (!masks) return masks.error();
    options.truth_masks = std::move(*masks);
  }
  for (const std::string& file : a.dense_maps) {
    if (const Result<DenseFormat> format = dense_format(file); !format) return format.error();
    options.dense_maps.emplace_back(file);
  }
  options.map = a.map;
  options.save_map = a.save_map;
  if (config.mapping.frozen && !(a.dense_maps.empty() && a.key_frame_masks.empty()))
    return Error{ErrorCode::kInvalidInput,
                 "--dense-map and --key-frame-masks are of a run's key frames: only localising "
                 "(--localise, mapping.frozen) makes none"};
  if (a.max_frames > 0) options.max_frames = a.max_frames;
  return run_recording(a.sequence, std::move(sequence_options), config, options);
}

}  // namespace

CommandHandler setup_run(CLI::App& parser) {
  auto a = std::make_shared<RunArguments>();
  parser.add_option("SEQUENCE", a->sequence, "folder of a recording: TUM RGB-D, Bonn, ICL-NUIM or plain images")
      ->required();
  parser.add_option("--out", a->out, "folder for the results; made when missing, earlier results in it are replaced")
      ->required();
  parser.add_option("--config", a->config_file, "YAML file with values ('semvslam config' shows all of them)");
  parser.add_option("--set", a->assignments, "one value, key=value; may be repeated")->allow_extra_args(false);
  parser.add_option("--mode", a->mode,
                    "which evidence of motion is used (the key 'mode'): orb, boxes, masks, masks+repair, masks+motion, "
                    "motion or full (default)");
  parser.add_option("--camera", a->camera, "camera YAML, where the recording has none or another one is wanted");
  parser.add_option("--camera-preset", a->preset, "built-in camera, e.g. tum_fr3");
  parser.add_option("--masks", a->masks, "folder with one PNG per frame, non-zero = pixel of something that may move");
  parser.add_option("--debug-frames", a->debug_frames, "folder for a picture per frame of what was taken for moving");
  parser.add_option("--key-frame-masks", a->key_frame_masks,
                    "folder for a PNG per key frame, 255 = pixel of something that moves; none where nothing does");
  parser.add_option("--truth-masks", a->truth_masks,
                    "folder with the true masks (PNG, as given or in the sequence): stats.json gets a part `truth`");
  parser
      .add_option(
          "--dense-map", a->dense_maps,
          "file for a map of the static scene, made of the key frames at the end: .ply or .pcd, coloured points; "
          ".bt or .ot, an octree of what is occupied and what is free; may be repeated")
      ->allow_extra_args(false);
  parser.add_option("--save-map", a->save_map, "file for the map at the end, for --map and 'semvslam map'");
  CLI::Option* map = parser.add_option(
      "--map", a->map,
      "saved map to begin in: the camera is looked for in it, then the map grows; poses are in its world");
  parser.add_flag("--localise", a->localise, "only say where the camera is in the saved map: nothing in it changes")
      ->needs(map);
  parser.add_option("--max-frames", a->max_frames, "stop after this many frames")
      ->check(CLI::Range(1, std::numeric_limits<int>::max()));
  parser.add_flag("--deterministic", a->deterministic, "two runs give the same bytes (slower: one thread)");
  parser.add_flag("--realtime", a->realtime, "keep the pace of the stamps, drop frames that come too late");
  parser.add_flag("--quiet", a->quiet, "no progress and no warnings on the terminal");
  return [a] { return run(*a); };
}

}  // namespace semvslam
