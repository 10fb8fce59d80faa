#include "semvslam/eval/bar_chart.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <regex>
#include <vector>

namespace semvslam {
namespace {

using ::testing::HasSubstr;
using ::testing::Not;

/// Heights of the bars, px, in the order in which they are drawn.
std::vector<double> bar_heights(const std::string& svg) {
  std::vector<double> out;
  const std::regex bar("height=\"([0-9.]+)\" fill=\"#[0-9a-f]{6}\"");
  for (std::sregex_iterator it(svg.begin(), svg.end(), bar), end; it != end; ++it) out.push_back(std::stod((*it)[1]));
  return out;
}

TEST(DrawBars, HeightsAreInProportionWhereValuesAreAlike) {
  const std::string svg =
      draw_bars({"t", "mm", {"a", "b"}, {{"orb", "#111111", {10, 4}}, {"full", "#222222", {5, 2}}}}, 300);
  const std::vector<double> h = bar_heights(svg);
  ASSERT_EQ(h.size(), 4u);  // by group
  EXPECT_NEAR(h[0] / h[1], 2, 0.01);
  EXPECT_NEAR(h[0] / h[2], 2.5, 0.01);
  EXPECT_THAT(svg, Not(HasSubstr("logarithmic")));
}

TEST(DrawBars, ValuesFarApartGetALogarithmicAxisThatShowsThemAll) {
  const std::string svg = draw_bars({"t", "mm", {"a"}, {{"orb", "#111111", {400}}, {"full", "#222222", {0.5}}}}, 300);
  const std::vector<double> h = bar_heights(svg);
  ASSERT_EQ(h.size(), 2u);
  EXPECT_GT(h[1], 5);
  EXPECT_GT(h[0], 2 * h[1]);
  EXPECT_LT(h[0], 250);
  EXPECT_THAT(svg, HasSubstr("mm, logarithmic"));
}

TEST(DrawBars, LongValuesStandUprightBelowTheTop) {
  for (const double least : {0.0341, 0.0011}) {  // on a linear axis and on a logarithmic one
    const std::string svg =
        draw_bars({"t", "deg", {"a"}, {{"x", "#111111", {0.0342}}, {"y", "#222222", {least}}}}, 300);
    std::smatch place;
    ASSERT_TRUE(std::regex_search(
        svg, place, std::regex("translate\\([0-9.]+,([0-9.]+)\\) rotate\\(-90\\)\" text-anchor=\"start\">0.034")));
    EXPECT_GT(std::stod(place[1]), 28 + 5 * 6) << "the box begins at 28 px, five digits are 30 px long";
  }
}

TEST(DrawBars, WhatIsMissingHasNoBar) {
  const std::string svg = draw_bars({"t", "mm", {"a", "b"}, {{"orb", "#111111", {NAN, 3}}}}, 300);
  EXPECT_EQ(bar_heights(svg).size(), 1u);
  EXPECT_THAT(svg, Not(HasSubstr("nan")));
}

TEST(DrawBars, NothingAtAllIsStillADrawing) {
  const std::string svg = draw_bars({"t", "mm", {}, {}}, 300);
  EXPECT_THAT(svg, HasSubstr("</svg>"));
  EXPECT_THAT(svg, Not(HasSubstr("inf")));
}

TEST(DrawBars, NamesAreEscaped) {
  EXPECT_THAT(draw_bars({"<t>", "&", {"<g>"}, {{"x", "#111111", {1}}}}, 300), Not(HasSubstr("<g>")));
}

}  // namespace
}  // namespace semvslam
