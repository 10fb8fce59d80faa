#pragma once

#include <cstdint>
#include <span>
#include <string>

#include "semvslam/base/result.h"
#include "semvslam/map/map.h"

namespace semvslam {

/// A map as bytes: camera, noise model, pyramid levels, key frames with their features and masks, landmarks with their
/// observations, what the next ids are. The same map gives the same bytes.
std::string format_map_content(const Map& map);

/// The map that these are the bytes of, to the last bit. Any bytes may be given: each number is looked at, and how many
/// things are announced is compared with the bytes left before room is made for them.
/// @param name of the file, for messages. Errors (kInvalidInput): what is wrong, and in which key frame or landmark.
Result<Map> parse_map_content(std::span<const std::uint8_t> bytes, const std::string& name);

}  // namespace semvslam
