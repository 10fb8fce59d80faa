#pragma once

#include <compare>
#include <cstdint>
#include <functional>

namespace semvslam {

/// An id that is a type of its own, so that a landmark's id cannot index key frames. Explicit to build; ordered;
/// hashable.
template <typename Tag>
struct Id {
  static constexpr std::uint32_t kNone = 0xffffffffu;
  std::uint32_t value = kNone;

  constexpr Id() = default;
  constexpr explicit Id(std::uint32_t v) : value(v) {}
  constexpr bool valid() const { return value != kNone; }
  friend constexpr auto operator<=>(Id, Id) = default;
};

using FrameId = Id<struct FrameTag>;  // position in the input stream, from 0
using KeyFrameId = Id<struct KeyFrameTag>;
using LandmarkId = Id<struct LandmarkTag>;
using InstanceId = Id<struct InstanceTag>;  // one segmented object of one image

}  // namespace semvslam

template <typename Tag>
struct std::hash<semvslam::Id<Tag>> {
  std::size_t operator()(semvslam::Id<Tag> id) const noexcept {
    return std::hash<std::uint64_t>{}(id.value * 0x9E3779B97F4A7C15ull);
  }
};
