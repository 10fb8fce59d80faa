#pragma once

#include <string>
#include <vector>

#include "semvslam/eval/statistics.h"

namespace semvslam {

/// A table of texts. Titles, names and reasons may be foreign; the writers below escape what they must.
struct Table {
  std::string title, note;           // note: some sentences, below the table; may be empty
  std::vector<std::string> columns;  // headings
  std::size_t text_columns = 1;      // from the left; the others hold numbers
  std::vector<std::vector<std::string>> rows;
};

/// A heading, the table, its note.
std::string to_markdown(const Table& table);
std::string to_html(const Table& table);

/// A number for people: two or three digits, at most four decimals, never an exponent ("0.014", "0.39", "6.20", "417");
/// "-" for what is not finite.
std::string three_digits(double value);

/// Tables and figures show lengths in millimetres.
inline constexpr double kMmPerM = 1e3;

/// "6.20 (5.80-6.40)": median and range, times `scale`; the median alone where all are equal as written, nothing
/// without a value.
std::string format_spread(const Spread& spread, double scale = 1);

/// The same for counts: "0", "1 (0-4)".
std::string format_counts(const Spread& spread);

}  // namespace semvslam
