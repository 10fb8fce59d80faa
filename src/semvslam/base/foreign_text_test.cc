#include "semvslam/base/foreign_text.h"

#include <gtest/gtest.h>

namespace semvslam {
namespace {

TEST(ForeignText, StaysOneShortLine) {
  EXPECT_EQ(in_quotes("fx"), "'fx'");
  EXPECT_EQ(in_quotes("a\nb\tc\x7f"), "'a?b?c?'");
  EXPECT_EQ(in_quotes("Küche"), "'Küche'");
  EXPECT_EQ(in_quotes(std::string(61, 'x')), "'" + std::string(60, 'x') + "...'");
}

TEST(ForeignText, EditDistance) {
  EXPECT_EQ(edit_distance("", "abc"), 3u);
  EXPECT_EQ(edit_distance("fx", "fx"), 0u);
  EXPECT_EQ(edit_distance("featurs", "features"), 1u);
  EXPECT_EQ(edit_distance("ratoi", "ratio"), 1u);
  EXPECT_EQ(edit_distance("kitten", "sitting"), 3u);
}

}  // namespace
}  // namespace semvslam
