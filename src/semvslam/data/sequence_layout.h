#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "semvslam/base/result.h"
#include "semvslam/data/tum_files.h"

namespace semvslam {

/// How a recording lies in its folder.
enum class SequenceKind {
  kTimedLists,    // TUM RGB-D, Bonn: rgb.txt + depth.txt
  kAssociations,  // associations.txt with time stamps
  kIclNuim,       // associations.txt with frame numbers for stamps
  kImageFolders,  // a colour folder and a depth folder
};

struct SequenceLayout {
  SequenceKind kind = SequenceKind::kTimedLists;
  PairList pairs;                         // files relative to the sequence folder
  bool stamps_are_frame_numbers = false;  // 1 s = 1 frame, until scale_stamps
  std::vector<std::string> warnings;      // one line each
  /// "TUM lists", "associations", "ICL-NUIM", "image folders".
  std::string kind_name() const;
};

/// Looks at a folder and pairs its images. In this order:
///  1. rgb.txt + depth.txt: paired by nearest time stamp, at most `max_gap_s` apart;
///  2. associations.txt, association.txt or associate.txt; ICL-NUIM when every stamp is a whole number that is also the
///     number in both file names;
///  3. rgb/, color/, colour/, image/ or images/ beside depth/: by time when the file names are decimal seconds
///     (1305031102.175304.png) or whole numbers of 13 / 16 / 19 digits (ms, us, ns); else by equal file names; else by
///     equal last numbers in the names (frame-000017.color.png); else, when there are as many of both, by their order.
/// Errors: no such folder, no sequence in it (says what was looked for), lists that do not parse, not one pair.
Result<SequenceLayout> detect_layout(const std::filesystem::path& folder, double max_gap_s);

/// Turns frame numbers into times: number / frame rate.
void scale_stamps(SequenceLayout& layout, double frame_rate_hz);

}  // namespace semvslam
