#pragma once

#include <cstdint>
#include <opencv2/core.hpp>
#include <optional>
#include <span>
#include <vector>

namespace semvslam {

/// A mask kept small, as the runs of set pixels of each row: some kilobytes where the image takes 300. For masks that
/// are kept for long, like those of key frames.
class MaskRuns {
 public:
  struct Run {
    std::uint16_t begin = 0, end = 0;  // columns; the end is the first that is not set
  };

  /// Set nowhere, of no size.
  MaskRuns() = default;
  /// @param mask CV_8UC1, non-zero = set, at most 65535 pixels wide; may be empty. Another type is a programming error
  /// (throws).
  explicit MaskRuns(const cv::Mat& mask);
  /// From the runs of each row. @return nothing where no mask has such runs: as many rows as the size says, the runs of
  /// a row inside it, ascending, with a pixel between them at least.
  static std::optional<MaskRuns> of_rows(cv::Size size, const std::vector<std::vector<Run>>& rows);

  cv::Size size() const { return size_; }
  bool is_set_anywhere() const { return !runs_.empty(); }
  /// Whether the pixel nearest to a recorded position is set; nothing outside the image is.
  bool contains(cv::Point2f pixel) const;
  /// CV_8UC1 of size(), 255 = set; empty for one of no size.
  cv::Mat mask() const;
  /// The runs of row y of size(), from left to right.
  std::span<const Run> row(int y) const;
  std::size_t memory_bytes() const;

 private:
  cv::Size size_;
  std::vector<std::uint32_t> first_;  // per row and one more: index of its first run
  std::vector<Run> runs_;
};

}  // namespace semvslam
