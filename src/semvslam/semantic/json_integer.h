#pragma once

#include <fmt/core.h>

#include <cmath>
#include <concepts>
#include <limits>
#include <nlohmann/json.hpp>
#include <stdexcept>
#include <utility>
#include <vector>

namespace semvslam {

/// A whole number of a document. The JSON library's own get<int>() casts whatever number is written there: 1e20 is then
/// undefined behaviour, 2^40 another number without a word.
/// Throws std::invalid_argument naming what was found when it is no number, has a fraction or does not fit T.
template <std::integral T>
T integer_of(const nlohmann::json& j) {
  const auto fail = [&j](const char* why) -> T { throw std::invalid_argument(fmt::format("{} {}", j.dump(), why)); };
  constexpr const char* kTooLarge = "is out of range for a whole number here";
  switch (j.type()) {
    case nlohmann::json::value_t::number_unsigned: {
      const auto value = *j.get_ptr<const nlohmann::json::number_unsigned_t*>();
      return std::in_range<T>(value) ? static_cast<T>(value) : fail(kTooLarge);
    }
    case nlohmann::json::value_t::number_integer: {
      const auto value = *j.get_ptr<const nlohmann::json::number_integer_t*>();
      return std::in_range<T>(value) ? static_cast<T>(value) : fail(kTooLarge);
    }
    case nlohmann::json::value_t::number_float: {
      const auto value = *j.get_ptr<const nlohmann::json::number_float_t*>();
      if (std::trunc(value) != value) return fail("is no whole number");
      // Both bounds are powers of two (or zero), exact as doubles; the largest T itself need not be.
      const double below = std::ldexp(1., std::numeric_limits<T>::digits);
      const double least = static_cast<double>(std::numeric_limits<T>::min());
      return value >= least && value < below ? static_cast<T>(value) : fail(kTooLarge);
    }
    case nlohmann::json::value_t::boolean:
      return static_cast<T>(*j.get_ptr<const nlohmann::json::boolean_t*>());
    default:
      throw std::invalid_argument(fmt::format("a whole number is needed, not {}", j.type_name()));
  }
}

/// The member of that name; throws as integer_of() does, with the member's name, and as the library does when it is
/// absent.
template <std::integral T>
T integer_at(const nlohmann::json& j, const char* key) {
  const nlohmann::json& value = j.at(key);
  try {
    return integer_of<T>(value);
  } catch (const std::invalid_argument& e) {
    throw std::invalid_argument(fmt::format("'{}': {}", key, e.what()));
  }
}

/// The member of that name, a list of whole numbers; throws as integer_at() does, or when it is no list.
template <std::integral T>
std::vector<T> integers_at(const nlohmann::json& j, const char* key) {
  const nlohmann::json& list = j.at(key);
  if (!list.is_array()) throw std::invalid_argument(fmt::format("'{}' is no list", key));
  std::vector<T> out;
  out.reserve(list.size());
  try {
    for (const nlohmann::json& value : list) out.push_back(integer_of<T>(value));
  } catch (const std::invalid_argument& e) {
    throw std::invalid_argument(fmt::format("'{}': {}", key, e.what()));
  }
  return out;
}

}  // namespace semvslam
