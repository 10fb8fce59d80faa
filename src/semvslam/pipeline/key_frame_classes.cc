#include "semvslam/pipeline/key_frame_classes.h"

#include <utility>

namespace semvslam {

void KeyFrameClasses::keep(FrameId key_frame, const Segmentation* segmentation) {
  if (segmentation == nullptr || segmentation->frame != key_frame) return;
  std::vector<ClassMask> classes = segmentation->class_masks();
  std::lock_guard lock(mutex_);
  classes_.emplace(key_frame, std::move(classes));
}

std::optional<std::vector<ClassMask>> KeyFrameClasses::of(FrameId key_frame) const {
  std::lock_guard lock(mutex_);
  const auto found = classes_.find(key_frame);
  return found == classes_.end() ? std::nullopt : std::optional(found->second);
}

}  // namespace semvslam
