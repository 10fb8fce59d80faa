#pragma once

#include <cstdint>
#include <opencv2/core.hpp>
#include <vector>

#include "semvslam/motion/region_growth.h"

namespace semvslam {

/// Where the parts may be that the masks of moving things lack: a hand, a leg below the hem that a mask ends at, what
/// is seen of a person between the slats of a chair. Per frame: add() everything that moves, spread(), then ask.
class MoverReach {
 public:
  /// @param depth CV_16UC1 or CV_32FC1; empty: nothing is connected with anything.
  /// @param reach_m how far a part may lie from the mask that lacks it; at least 0.
  MoverReach(const Camera& camera, const cv::Mat& depth, double reach_m);

  /// Something that moves. @param mask CV_8UC1 of the window's size, non-zero = the thing; the window lies in the
  /// image.
  /// @param depth_m median of its depth, 0 = unknown: then nothing can be said about its reach.
  void add(const cv::Rect& window, const cv::Mat& mask, float depth_m);
  /// Measures the distances; once, after the last add().
  void spread();

  /// Metres from the nearest mask along the surface that the depth image shows, as a limb is connected with its body; 0
  /// inside, infinite where no surface leads to and beyond the reach. @param pixel recorded.
  float distance_m(const cv::Point2f& pixel) const {
    return distances_m_[static_cast<std::size_t>(grid_.cell_of(pixel))];
  }
  /// Whether two depths meet there, one of them that of a thing that moves and is within reach in the picture: such a
  /// corner is made by both. @param pixel recorded.
  bool is_at_edge(const cv::Point2f& pixel) const;

 private:
  struct Mover {
    cv::Rect reach;  // in the picture
    float depth_m = 0;
  };
  CellGrid grid_;
  double fx_px_, reach_m_;
  std::vector<Mover> movers_;
  enum class Place : std::uint8_t { kOutside, kInside, kCore };  // of the masks
  std::vector<Place> places_;                                    // per cell
  std::vector<int> cores_;                                       // cells that distances are measured from
  std::vector<float> distances_m_;                               // per cell
};

}  // namespace semvslam
