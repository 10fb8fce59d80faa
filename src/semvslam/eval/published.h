#pragma once

#include <array>
#include <cstddef>
#include <optional>
#include <span>
#include <string_view>

namespace semvslam {

/// The recordings with people that the paper reports on (TUM RGB-D, freiburg3), in its order.
enum class PaperSequence : std::size_t {
  kWalkingXyz,
  kWalkingRpy,
  kWalkingHalfsphere,
  kWalkingStatic,
  kSittingXyz,
  kSittingRpy,
  kSittingHalfsphere,
  kSittingStatic,
};
inline constexpr std::size_t kPaperSequences = 8;

/// Which of them a recording is, by the name of its folder: as it is downloaded (rgbd_dataset_freiburg3_walking_xyz) or
/// as it is called for short (freiburg3_walking_xyz, fr3_walking_xyz). Rendered scenes with such a motion are none.
std::optional<PaperSequence> paper_sequence(std::string_view folder_name);

/// What others published about a system, measured by them on other machines. Values that were not given are absent.
struct PublishedSystem {
  std::string_view system;
  std::array<double, kPaperSequences> ate_rmse_values_m;  // 0 = not given
  std::string_view tracking_ms;                           // as printed, may be a range; empty = not given
  std::string_view hardware;                              // that this time was measured on

  std::optional<double> ate_rmse_m(PaperSequence sequence) const;
  /// The same by the name of a folder; absent too where that is none of the paper's recordings.
  std::optional<double> ate_rmse_m(std::string_view folder_name) const;
};
/// Tables VI and VII of the paper, and one system without a GPU that came later.
std::span<const PublishedSystem> published_systems();

/// RMSE and SD of the relative pose error over the paper's fixed step.
struct PublishedRelativeError {
  std::string_view system;
  struct Values {
    double translation_rmse_m, translation_sd_m, rotation_rmse_deg, rotation_sd_deg;
  };
  std::array<Values, kPaperSequences> values;
};
/// Tables IV and V of the paper.
std::span<const PublishedRelativeError> published_relative_errors();

}  // namespace semvslam
