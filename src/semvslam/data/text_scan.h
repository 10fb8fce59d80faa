#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "semvslam/base/time_stamp.h"

namespace semvslam {

/// A line of a text file without its line ending and without surrounding blanks.
struct TextLine {
  std::size_t number = 0;  // from 1
  std::string_view text;
  bool terminated = true;  // false: the file ends inside this line
};

/// Lines of `text` that carry something: blank lines, `#` comment lines, a byte order mark and CR of CRLF are skipped.
/// The views point into `text`.
std::vector<TextLine> content_lines(std::string_view text);

/// The words of a line, separated by blanks or tabs.
std::vector<std::string_view> split_words(std::string_view line);

/// What a decimal number of seconds says, in nanoseconds and without passing through a double: "1305031102.175304",
/// "-0.5", "1.305031102175304e+09". Digits below a nanosecond are rounded half away from zero.
/// Nothing when `text` is not a finite decimal number as a whole or does not fit in 64 bits.
std::optional<TimeStamp> parse_seconds(std::string_view text);

/// True for the spellings of "not a number" and of infinity (nan, -nan, inf, infinity; any case).
bool is_non_finite_word(std::string_view text);

/// A double; nothing when `text` is not a number as a whole. "nan" and "inf" are numbers here: callers check for
/// finite.
std::optional<double> parse_double(std::string_view text);

/// Seconds with exactly nine decimals: "1305031102.175304000".
std::string format_seconds(TimeStamp stamp);

}  // namespace semvslam
