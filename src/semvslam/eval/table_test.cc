#include "semvslam/eval/table.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>

namespace semvslam {
namespace {

using ::testing::HasSubstr;

const Table kTable{"A | B", "a note", {"name", "n"}, 1, {{"<b>&|x", "1"}, {"y", "2"}}};

TEST(Table, AsMarkdown) {
  EXPECT_EQ(to_markdown(kTable),
            "## A \\| B\n\n| name | n |\n|---|---:|\n| &lt;b>&\\|x | 1 |\n| y | 2 |\n\na note\n\n");
}

TEST(Table, AsHtmlIsEscaped) {
  const std::string html = to_html(kTable);
  EXPECT_THAT(html, HasSubstr("<td class=\"text\">&lt;b&gt;&amp;|x</td><td>1</td>"));
  EXPECT_THAT(html, ::testing::Not(HasSubstr("<b>")));
}

TEST(ThreeDigits, AreEnoughAndNeverAnExponent) {
  EXPECT_EQ(three_digits(0.3937), "0.39");
  EXPECT_EQ(three_digits(0), "0.00");
  EXPECT_EQ(three_digits(0.00012), "0.0001");
  EXPECT_EQ(three_digits(0.0138), "0.014");
  EXPECT_EQ(three_digits(0.0999), "0.10");
  EXPECT_EQ(three_digits(6.2), "6.20");
  EXPECT_EQ(three_digits(9.996), "10.0");
  EXPECT_EQ(three_digits(12.34), "12.3");
  EXPECT_EQ(three_digits(99.97), "100");
  EXPECT_EQ(three_digits(417.2), "417");
  EXPECT_EQ(three_digits(-12.34), "-12.3");
  EXPECT_EQ(three_digits(1e7), "10000000");
  EXPECT_EQ(three_digits(INFINITY), "-");
  EXPECT_EQ(three_digits(NAN), "-");
}

TEST(FormatSpread, ShowsARangeWhereThereIsOne) {
  EXPECT_EQ(format_spread({3, 0.0062, 0.0058, 0.0064}, 1e3), "6.20 (5.80-6.40)");
  EXPECT_EQ(format_spread({3, 0.0062, 0.0062, 0.006201}, 1e3), "6.20");
  EXPECT_EQ(format_spread({}), "");
  EXPECT_EQ(format_counts({3, 1, 0, 4}), "1 (0-4)");
  EXPECT_EQ(format_counts({2, 0.5, 0, 1}), "0.5 (0-1)");
}

}  // namespace
}  // namespace semvslam
