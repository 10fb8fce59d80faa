#include "semvslam/geometry/mask_runs.h"

#include <algorithm>
#include <limits>
#include <stdexcept>

namespace semvslam {

MaskRuns::MaskRuns(const cv::Mat& mask) : size_(mask.size()) {
  if (mask.empty()) return;
  if (mask.type() != CV_8UC1 || mask.cols > std::numeric_limits<std::uint16_t>::max())
    throw std::invalid_argument("mask runs: the mask must be CV_8UC1 and at most 65535 pixels wide");
  const auto is_set = [](std::uint8_t value) { return value != 0; };
  for (int y = 0; y < mask.rows; ++y) {
    first_.push_back(static_cast<std::uint32_t>(runs_.size()));
    const std::uint8_t* const row = mask.ptr<std::uint8_t>(y);
    const std::uint8_t* const row_end = row + mask.cols;
    for (const std::uint8_t* begin = std::find_if(row, row_end, is_set); begin != row_end;) {
      const std::uint8_t* const end = std::find(begin, row_end, std::uint8_t{0});
      runs_.push_back({static_cast<std::uint16_t>(begin - row), static_cast<std::uint16_t>(end - row)});
      begin = std::find_if(end, row_end, is_set);
    }
  }
  first_.push_back(static_cast<std::uint32_t>(runs_.size()));
}

std::optional<MaskRuns> MaskRuns::of_rows(cv::Size size, const std::vector<std::vector<Run>>& rows) {
  MaskRuns out;
  if (size.empty() && rows.empty()) return out;
  if (size.empty() || size.width > std::numeric_limits<std::uint16_t>::max() ||
      rows.size() != static_cast<std::size_t>(size.height))
    return std::nullopt;
  out.size_ = size;
  for (const std::vector<Run>& row : rows) {
    out.first_.push_back(static_cast<std::uint32_t>(out.runs_.size()));
    int free_from = 0;
    for (const Run& run : row) {
      if (run.begin < free_from || run.end <= run.begin || run.end > size.width) return std::nullopt;
      free_from = run.end + 1;
      out.runs_.push_back(run);
    }
  }
  out.first_.push_back(static_cast<std::uint32_t>(out.runs_.size()));
  return out;
}

std::span<const MaskRuns::Run> MaskRuns::row(int y) const {
  const std::size_t begin = first_[static_cast<std::size_t>(y)], end = first_[static_cast<std::size_t>(y) + 1];
  return std::span(runs_).subspan(begin, end - begin);
}

bool MaskRuns::contains(cv::Point2f pixel) const {
  const int x = cvRound(pixel.x), y = cvRound(pixel.y);
  if (runs_.empty() || x < 0 || y < 0 || x >= size_.width || y >= size_.height) return false;
  return std::ranges::any_of(row(y), [x](const Run& run) { return run.begin <= x && x < run.end; });
}

cv::Mat MaskRuns::mask() const {
  cv::Mat mask = cv::Mat::zeros(size_, CV_8UC1);
  for (int y = 0; y < size_.height; ++y)
    for (const Run& run : row(y))
      std::fill(mask.ptr<std::uint8_t>(y) + run.begin, mask.ptr<std::uint8_t>(y) + run.end, std::uint8_t{255});
  return mask;
}

std::size_t MaskRuns::memory_bytes() const {
  return first_.capacity() * sizeof(std::uint32_t) + runs_.capacity() * sizeof(Run);
}

}  // namespace semvslam
