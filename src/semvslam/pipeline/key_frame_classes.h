#pragma once

#include <map>
#include <mutex>
#include <optional>
#include <vector>

#include "semvslam/base/ids.h"
#include "semvslam/semantic/segmentation.h"

namespace semvslam {

/// What the key frames of a session show, class by class. Any thread.
class KeyFrameClasses {
 public:
  /// @param segmentation of the key frame itself, or a late one, of which nothing is kept; null = none.
  void keep(FrameId key_frame, const Segmentation* segmentation);
  /// Empty where nothing was kept.
  std::optional<std::vector<ClassMask>> of(FrameId key_frame) const;

 private:
  mutable std::mutex mutex_;
  std::map<FrameId, std::vector<ClassMask>> classes_;
};

}  // namespace semvslam
