#include "semvslam/eval/markup.h"

#include <gtest/gtest.h>

namespace semvslam {
namespace {

TEST(EscapeMarkup, LeavesNoTagAndNoEndOfAnAttribute) {
  EXPECT_EQ(escape_markup("<script>alert('a' & \"b\")</script>"),
            "&lt;script&gt;alert(&#39;a&#39; &amp; &quot;b&quot;)&lt;/script&gt;");
}

TEST(EscapeMarkup, ControlCharactersBecomeBlanks) { EXPECT_EQ(escape_markup("a\n\tb\x1b[2J\x7f"), "a  b [2J "); }

TEST(EscapeMarkup, KeepsUtf8AndReplacesWhatIsNone) {
  EXPECT_EQ(escape_markup("K\xc3\xbc\x63he \xe2\x82\xac \xf0\x9f\x98\x80"),
            "K\xc3\xbc\x63he \xe2\x82\xac \xf0\x9f\x98\x80");
  EXPECT_EQ(escape_markup("a\xff<"), "a\xef\xbf\xbd&lt;");
  EXPECT_EQ(escape_markup("\xc3"), "\xef\xbf\xbd");                                  // cut off
  EXPECT_EQ(escape_markup("\xc0\xbc"), "\xef\xbf\xbd\xef\xbf\xbd");                  // '<' in an overlong form
  EXPECT_EQ(escape_markup("\xed\xa0\x80"), "\xef\xbf\xbd\xef\xbf\xbd\xef\xbf\xbd");  // a surrogate
}

}  // namespace
}  // namespace semvslam
