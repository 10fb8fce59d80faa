#include "semvslam/data/text_scan.h"

#include <gmock/gmock.h>

#include <limits>

namespace semvslam {
namespace {

using ::testing::ElementsAre;

TEST(ParseSeconds, IsExactWhereADoubleIsNot) {
  EXPECT_EQ(parse_seconds("1305031102.175304")->ns, 1305031102175304000);
  EXPECT_EQ(parse_seconds("1305031102.175304001")->ns, 1305031102175304001);
  EXPECT_EQ(parse_seconds("9223372036.854775807")->ns, std::numeric_limits<std::int64_t>::max());
}

TEST(ParseSeconds, ReadsEveryDecimalSpelling) {
  EXPECT_EQ(parse_seconds("0")->ns, 0);
  EXPECT_EQ(parse_seconds("000.000")->ns, 0);
  EXPECT_EQ(parse_seconds(".5")->ns, 500000000);
  EXPECT_EQ(parse_seconds("5.")->ns, 5000000000);
  EXPECT_EQ(parse_seconds("+7")->ns, 7000000000);
  EXPECT_EQ(parse_seconds("-0.25")->ns, -250000000);
  EXPECT_EQ(parse_seconds("0.000000001")->ns, 1);
  EXPECT_EQ(parse_seconds("1.305031102175304e+09")->ns, 1305031102175304000);
  EXPECT_EQ(parse_seconds("1305031102175304000e-9")->ns, 1305031102175304000);
  EXPECT_EQ(parse_seconds("25E-10")->ns, 3);
}

TEST(ParseSeconds, RoundsBelowANanosecondHalfAwayFromZero) {
  EXPECT_EQ(parse_seconds("1.0000000004")->ns, 1000000000);
  EXPECT_EQ(parse_seconds("1.0000000005")->ns, 1000000001);
  EXPECT_EQ(parse_seconds("-1.0000000005")->ns, -1000000001);
  EXPECT_EQ(parse_seconds("0.0000000005")->ns, 1);
  EXPECT_EQ(parse_seconds("0.00000000049")->ns, 0);
  EXPECT_EQ(parse_seconds("0.999999999999")->ns, 1000000000);
}

TEST(ParseSeconds, RefusesWhatIsNoFiniteNumberOrTooLarge) {
  for (const char* text :
       {"", ".", "-", "+-1", "1e", "1e+", "1.2.3", "1,5", "12x", "0x10", "nan", "inf", "1 2", "e5", "-.e1"})
    EXPECT_FALSE(parse_seconds(text)) << text;
  for (const char* text : {"9223372036.854775808", "1305031102175304000", "1e11", "1e999999999999"})
    EXPECT_FALSE(parse_seconds(text)) << text;
  EXPECT_EQ(parse_seconds("1e-999999999999")->ns, 0);
}

TEST(FormatSeconds, IsTheInverseOfParseSeconds) {
  for (std::int64_t ns : {std::int64_t{0}, std::int64_t{1}, std::int64_t{-1}, std::int64_t{-1500000000},
                          std::int64_t{1305031102175304001}, std::numeric_limits<std::int64_t>::max()})
    EXPECT_EQ(parse_seconds(format_seconds({ns}))->ns, ns);
  EXPECT_EQ(format_seconds({1305031102175304000}), "1305031102.175304000");
  EXPECT_EQ(format_seconds({-250000000}), "-0.250000000");
}

TEST(ContentLines, SkipsCommentsBlanksMarksAndLineEndings) {
  const auto lines = content_lines("\xEF\xBB\xBF# head\r\n\r\n  one two \r\n\t\n#x\nlast");
  ASSERT_EQ(lines.size(), 2u);
  EXPECT_EQ(lines[0].text, "one two");
  EXPECT_EQ(lines[0].number, 3u);
  EXPECT_TRUE(lines[0].terminated);
  EXPECT_EQ(lines[1].text, "last");
  EXPECT_EQ(lines[1].number, 6u);
  EXPECT_FALSE(lines[1].terminated);
}

TEST(SplitWords, SplitsAtBlanksAndTabs) {
  EXPECT_THAT(split_words("  a\tbb   c "), ElementsAre("a", "bb", "c"));
  EXPECT_TRUE(split_words(" \t").empty());
}

TEST(ParseDouble, TakesTheWholeWordOrNothing) {
  EXPECT_EQ(parse_double("+1.5"), 1.5);
  EXPECT_EQ(parse_double("-2e-3"), -2e-3);
  for (const char* text : {"", "1.5x", "+-1", "0x10", " 1"}) EXPECT_FALSE(parse_double(text)) << text;
}

TEST(IsNonFiniteWord, KnowsTheSpellings) {
  for (const char* text : {"nan", "NaN", "-nan", "inf", "-Inf", "+infinity"})
    EXPECT_TRUE(is_non_finite_word(text)) << text;
  for (const char* text : {"", "n", "1", "info"}) EXPECT_FALSE(is_non_finite_word(text)) << text;
}

}  // namespace
}  // namespace semvslam
