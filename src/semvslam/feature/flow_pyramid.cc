#include "semvslam/feature/flow_pyramid.h"

#include <algorithm>
#include <cstring>
#include <stdexcept>

namespace semvslam {
namespace {

/// Index inside 0..n-1 that a place outside mirrors, the border itself not repeated.
int mirrored(int i, int n) {
  if (n == 1) return 0;
  while (i < 0 || i >= n) i = i < 0 ? -i : 2 * (n - 1) - i;
  return i;
}

void fill_margin(cv::Mat& padded, int margin) {
  const int width = padded.cols - 2 * margin, height = padded.rows - 2 * margin;
  for (int y = margin; y < margin + height; ++y) {
    std::uint8_t* row = padded.ptr<std::uint8_t>(y) + margin;
    for (int k = 1; k <= margin; ++k) {
      row[-k] = row[mirrored(-k, width)];
      row[width - 1 + k] = row[mirrored(width - 1 + k, width)];
    }
  }
  const auto copy_row = [&](int to, int from) {
    std::memcpy(padded.ptr<std::uint8_t>(margin + to), padded.ptr<std::uint8_t>(margin + from),
                static_cast<std::size_t>(padded.cols));
  };
  for (int k = 1; k <= margin; ++k) {
    copy_row(-k, mirrored(-k, height));
    copy_row(height - 1 + k, mirrored(height - 1 + k, height));
  }
}

}  // namespace

void FlowPyramid::half_sample(const cv::Mat& src, cv::Mat& dst) {
  // 256 times the largest value and the half that rounds stay below 2^16. Two more columns on either side lie in the
  // margin; an even number in all.
  constexpr int kReach = 2;
  const int half = dst.cols + kReach, n = 2 * half;
  column_.resize(static_cast<std::size_t>(2 * n));
  for (int y = 0; y < dst.rows; ++y) {
    const auto row = [&](int dy) {
      return src.data + (2 * y + dy) * static_cast<std::ptrdiff_t>(src.step[0]) - kReach;
    };
    const std::uint8_t *a = row(-2), *b = row(-1), *c = row(0), *d = row(1), *e = row(2);
    std::uint16_t* __restrict column = column_.data(), * __restrict even = column + n, * __restrict odd = even + half;
#pragma GCC ivdep
    for (int x = 0; x < n; ++x) column[x] = static_cast<std::uint16_t>(a[x] + e[x] + 4 * (b[x] + d[x]) + 6 * c[x]);
      // Apart, all that follows has neighbouring values in neighbouring lanes.
#pragma GCC ivdep
    for (int x = 0; x < half; ++x) {
      even[x] = column[2 * x];
      odd[x] = column[2 * x + 1];
    }
    std::uint8_t* __restrict out = dst.ptr<std::uint8_t>(y);
#pragma GCC ivdep
    for (int x = 0; x < dst.cols; ++x) {
      const auto sum =
          static_cast<std::uint16_t>(even[x] + even[x + 2] + 4 * (odd[x] + odd[x + 1]) + 6 * even[x + 1] + 128);
      out[x] = static_cast<std::uint8_t>(sum >> 8);
    }
  }
}

void FlowPyramid::build(const cv::Mat& gray, int levels, int window_px) {
  if (gray.type() != CV_8UC1 || gray.empty())
    throw std::invalid_argument("FlowPyramid: the image must be CV_8UC1 and not empty");
  margin_px_ = patch_lanes(window_px) + 2;
  std::vector<cv::Size> sizes{gray.size()};
  while (static_cast<int>(sizes.size()) <= levels) {
    const cv::Size half((sizes.back().width + 1) / 2, (sizes.back().height + 1) / 2);
    if (half.width <= window_px || half.height <= window_px) break;
    sizes.push_back(half);
  }
  levels_.resize(sizes.size());
  padded_.resize(sizes.size());
  for (std::size_t i = 0; i < sizes.size(); ++i) {
    const cv::Size room(2 * margin_px_, 2 * margin_px_);
    padded_[i].create(sizes[i] + room, CV_8UC1);
    levels_[i] = padded_[i](cv::Rect(cv::Point(margin_px_, margin_px_), sizes[i]));
    if (i == 0)
      gray.copyTo(levels_[0]);
    else
      half_sample(levels_[i - 1], levels_[i]);
    fill_margin(padded_[i], margin_px_);
  }
}

}  // namespace semvslam
