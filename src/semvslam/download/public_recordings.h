#pragma once

#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

#include "semvslam/base/result.h"

namespace semvslam {

/// A recording of a public benchmark, as its makers offer it.
struct PublicRecording {
  std::string short_name;  // "fr3_walking_xyz"
  std::string folder;      // that the archive holds: "rgbd_dataset_freiburg3_walking_xyz"
  std::string archive;     // file name: the folder's with .tgz or .zip
  std::string base_url;    // the archive is at base_url + "/" + archive
  /// SHA-256 in hexadecimal digits. The makers publish none: those that we have were published by others who fetched
  /// the archive. Empty = not known.
  std::string sha256;
};

/// Recordings of one benchmark.
struct PublicDataset {
  std::string_view name;   // "tum"
  std::string_view about;  // maker and licence, one line
  std::vector<PublicRecording> recordings;
  std::string_view group;  // a name that stands for those of the paper; empty = none
  std::vector<std::string> group_names;
};

/// TUM RGB-D (Sturm et al. 2012) and Bonn RGB-D Dynamic (Palazzolo et al. 2019).
const std::vector<PublicDataset>& public_datasets();

/// @param name short or the folder's, or the group's. Errors: an unknown dataset or name, with the nearest known one.
Result<std::vector<PublicRecording>> find_public_recordings(std::string_view dataset, std::string_view name);

}  // namespace semvslam
