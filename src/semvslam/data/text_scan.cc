#include "semvslam/data/text_scan.h"

#include <fmt/format.h>

#include <algorithm>
#include <cctype>
#include <charconv>
#include <limits>

namespace semvslam {
namespace {

constexpr int kNanosecondDigits = 9;

bool is_blank(char c) { return c == ' ' || c == '\t' || c == '\r' || c == '\v' || c == '\f'; }
bool is_digit(char c) { return c >= '0' && c <= '9'; }

std::string_view trim(std::string_view text) {
  while (!text.empty() && is_blank(text.front())) text.remove_prefix(1);
  while (!text.empty() && is_blank(text.back())) text.remove_suffix(1);
  return text;
}

/// Sign, significant digits and the power of ten of the digit before the first one: value = 0.d1 d2 d3... *
/// 10^magnitude.
struct Decimal {
  bool negative = false;
  std::string digits;
  long magnitude = 0;
};

/// Reads "[eE][+-]digits" from the front; false when it is malformed. Absurd exponents saturate.
bool take_exponent(std::string_view text, long& exponent) {
  if (text.empty()) return true;
  if (text.front() != 'e' && text.front() != 'E') return false;
  text.remove_prefix(1);
  const bool negative = !text.empty() && text.front() == '-';
  if (!text.empty() && (text.front() == '-' || text.front() == '+')) text.remove_prefix(1);
  if (text.empty()) return false;
  for (char c : text) {
    if (!is_digit(c)) return false;
    exponent = std::min(exponent * 10 + (c - '0'), 100000L);
  }
  if (negative) exponent = -exponent;
  return true;
}

std::optional<Decimal> parse_decimal(std::string_view text) {
  Decimal d;
  if (!text.empty() && (text.front() == '-' || text.front() == '+')) {
    d.negative = text.front() == '-';
    text.remove_prefix(1);
  }
  bool any = false, point = false;
  std::size_t i = 0;
  for (; i < text.size() && (is_digit(text[i]) || (text[i] == '.' && !point)); ++i) {
    if (text[i] == '.') {
      point = true;
      continue;
    }
    any = true;
    const bool leading_zero = d.digits.empty() && text[i] == '0';
    if (!leading_zero) d.digits.push_back(text[i]);
    if (!point && !leading_zero) ++d.magnitude;
    if (point && leading_zero) --d.magnitude;
  }
  long exponent = 0;
  if (!any || !take_exponent(text.substr(i), exponent)) return std::nullopt;
  d.magnitude += exponent;
  return d;
}

}  // namespace

std::vector<TextLine> content_lines(std::string_view text) {
  std::vector<TextLine> lines;
  if (text.starts_with("\xEF\xBB\xBF")) text.remove_prefix(3);
  std::size_t number = 0;
  while (!text.empty()) {
    const std::size_t end = text.find('\n');
    const std::string_view line = trim(text.substr(0, end));
    ++number;
    if (!line.empty() && line.front() != '#') lines.push_back({number, line, end != std::string_view::npos});
    text.remove_prefix(end == std::string_view::npos ? text.size() : end + 1);
  }
  return lines;
}

std::vector<std::string_view> split_words(std::string_view line) {
  std::vector<std::string_view> words;
  std::size_t i = 0;
  while (i < line.size()) {
    while (i < line.size() && is_blank(line[i])) ++i;
    const std::size_t begin = i;
    while (i < line.size() && !is_blank(line[i])) ++i;
    if (i > begin) words.push_back(line.substr(begin, i - begin));
  }
  return words;
}

std::optional<TimeStamp> parse_seconds(std::string_view text) {
  const std::optional<Decimal> decimal = parse_decimal(text);
  if (!decimal) return std::nullopt;
  const Decimal& d = *decimal;
  if (d.digits.empty()) return TimeStamp{0};
  const long whole_digits = d.magnitude + kNanosecondDigits;  // digits of the value in nanoseconds before its point
  if (whole_digits > 19) return std::nullopt;                 // 10^19 > 2^63
  std::uint64_t ns = 0;
  for (long i = 0; i < whole_digits; ++i)
    ns = ns * 10 + static_cast<std::uint64_t>(i < static_cast<long>(d.digits.size()) ? d.digits[i] - '0' : 0);
  if (whole_digits >= 0 && whole_digits < static_cast<long>(d.digits.size()) && d.digits[whole_digits] >= '5') ++ns;
  if (ns > static_cast<std::uint64_t>(std::numeric_limits<std::int64_t>::max())) return std::nullopt;
  return TimeStamp{d.negative ? -static_cast<std::int64_t>(ns) : static_cast<std::int64_t>(ns)};
}

bool is_non_finite_word(std::string_view text) {
  if (!text.empty() && (text.front() == '-' || text.front() == '+')) text.remove_prefix(1);
  std::string lower(text);
  std::transform(lower.begin(), lower.end(), lower.begin(), [](unsigned char c) { return std::tolower(c); });
  return lower == "nan" || lower == "inf" || lower == "infinity";
}

std::optional<double> parse_double(std::string_view text) {
  if (!text.empty() && text.front() == '+') {
    text.remove_prefix(1);
    if (!text.empty() && text.front() == '-') return std::nullopt;
  }
  double value = 0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
  if (error != std::errc() || end != text.data() + text.size()) return std::nullopt;
  return value;
}

std::string format_seconds(TimeStamp stamp) {
  // The magnitude as unsigned: -INT64_MIN does not exist.
  const bool negative = stamp.ns < 0;
  const std::uint64_t ns = negative ? 0 - static_cast<std::uint64_t>(stamp.ns) : static_cast<std::uint64_t>(stamp.ns);
  return fmt::format("{}{}.{:09}", negative ? "-" : "", ns / 1000000000u, ns % 1000000000u);
}

}  // namespace semvslam
