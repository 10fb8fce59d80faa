#pragma once

#include <filesystem>
#include <functional>
#include <memory>
#include <string>

#include "semvslam/base/result.h"
#include "semvslam/data/frame.h"

namespace semvslam {

struct SequenceOptions {
  std::string camera_file;              // camera YAML (see camera_file.h); empty = look elsewhere
  std::string camera_preset;            // name of a built-in camera; empty = look elsewhere
  bool want_colour = false;             // fill RgbdFrame::colour
  double max_association_gap_s = 0.02;  // between a colour image and its depth image
  std::string mask_folder;              // PNG per frame, named like the colour image; empty = none (see find_folder)
  /// Told one line per oddity found on opening (unsorted stamps, images without a partner...). May be empty: then the
  /// counts are only in description().
  std::function<void(const std::string&)> on_warning;
};

/// Opens a recording: TUM RGB-D, Bonn, ICL-NUIM, image folders (detect_layout tells how they are recognised).
/// Camera, the first of: options.camera_file, options.camera_preset, camera.yaml in the folder, the built-in camera of
/// the folder's name (camera_preset_of_folder), the ICL-NUIM one for its layout. FrameId is the position in the list of
/// pairs; a frame that cannot be read (missing file, truncated or corrupt image, wrong size or bit depth) is one Error
/// of next() with fatal() == false, and the next call goes on behind it. Errors: no such folder, nothing that is a
/// sequence, no camera, no pair, and when neither the first, the middle nor the last frame can be read: what is wrong
/// with the first.
Result<std::unique_ptr<FrameSource>> open_sequence(const std::filesystem::path& folder, const SequenceOptions& options);

/// The next frame that can be read, past those that cannot; an empty optional at the end. Errors: those after which the
/// source does not go on (FrameSource::fatal).
Result<std::optional<RgbdFrame>> next_readable(FrameSource& source);

/// A folder that belongs to a recording, such as one of masks: `name` as given, or inside the recording. Errors:
/// neither is a folder.
Result<std::filesystem::path> find_folder(const std::filesystem::path& recording, const std::string& name);

/// The reference trajectory of a recording: `path` is a trajectory file, or a sequence folder with groundtruth.txt or,
/// for ICL-NUIM, one *.gt.freiburg file. ICL-NUIM's (known by that name, or as groundtruth.txt of a folder in its
/// layout whose stamps are all whole numbers) has frame numbers for stamps and a camera whose y axis points up; here it
/// is turned into seconds (30 Hz) and our camera frame by mirroring y: (tx, -ty, tz), (-qx, qy, -qz, qw). Errors: as
/// read_trajectory; a folder without one.
Result<Trajectory> read_ground_truth(const std::filesystem::path& path);

}  // namespace semvslam
