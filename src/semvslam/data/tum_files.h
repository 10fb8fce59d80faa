#pragma once

#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "semvslam/base/result.h"
#include "semvslam/base/time_stamp.h"

namespace semvslam {

/// One line of rgb.txt or depth.txt.
struct TimedFile {
  TimeStamp stamp;
  std::string file;  // relative to the list's folder
};

/// A list of images as it was understood. What is odd in a list but leaves the rest usable is repaired and counted:
/// lines in the wrong order are sorted by stamp; of lines with one stamp the first is kept; a line whose stamp is NaN
/// or infinite is dropped; so is a last line that breaks off (a recording that was cut).
struct FileList {
  std::vector<TimedFile> entries;  // strictly increasing stamps
  std::size_t out_of_order = 0, duplicates = 0, non_finite = 0, cut_off = 0;
  /// One line, e.g. "2 lines out of order (sorted), 1 duplicate stamp (first kept)"; empty when nothing was odd.
  std::string oddities() const;
};

/// A colour and a depth image of one moment.
struct ImagePair {
  TimeStamp stamp;  // of the colour image
  std::string colour_file, depth_file;
};

struct PairList {
  std::vector<ImagePair> pairs;  // strictly increasing stamps
  FileList report;               // only its counts
  std::size_t colour_without_depth = 0, depth_without_colour = 0;
};

/// Parses rgb.txt / depth.txt: `stamp file`, the file name may hold blanks. Comments (#), blank lines and CRLF are
/// fine.
/// @param name of the file, for messages. Errors name file and line: no stamp, no file name.
Result<FileList> parse_file_list(std::string_view text, const std::string& name);

/// Parses associations.txt: `stamp file stamp file`, colour first (TUM) or depth first (ICL-NUIM): told apart by the
/// word "depth" in the first line's file names, colour first when neither has it.
Result<PairList> parse_associations(std::string_view text, const std::string& name);

/// Pairs each colour image with the depth image nearest in time, at most `max_gap_s` apart; each image is used once and
/// the closest pairs are made first (as the TUM benchmark's associate tool does).
PairList associate(const FileList& colour, const FileList& depth, double max_gap_s);

}  // namespace semvslam
