#include "semvslam/eval/svg_chart.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <regex>

namespace semvslam {
namespace {

TEST(DrawSvg, EqualAspectKeepsACircleRound) {
  ChartSeries circle{"c", "#123456", {}, {}, false};
  for (int k = 0; k <= 360; ++k) {
    circle.x.push_back(3 * std::cos(k * 0.0174532925));
    circle.y.push_back(3 * std::sin(k * 0.0174532925));
  }
  const std::string svg = draw_svg(600, 300, "t", {}, {{"", "", "", 0, 0, 600, 300, true, false, {circle}}});
  const std::string path = svg.substr(svg.find("d=\"M"));
  double low_x = 1e9, high_x = -1e9, low_y = 1e9, high_y = -1e9;
  const std::regex point("[ML]([-0-9.]+) ([-0-9.]+)");
  for (std::sregex_iterator it(path.begin(), path.end(), point), end; it != end; ++it) {
    low_x = std::min(low_x, std::stod((*it)[1])), high_x = std::max(high_x, std::stod((*it)[1]));
    low_y = std::min(low_y, std::stod((*it)[2])), high_y = std::max(high_y, std::stod((*it)[2]));
  }
  EXPECT_NEAR(high_x - low_x, high_y - low_y, 0.5);
  EXPECT_GT(high_y - low_y, 150);
}

TEST(DrawSvg, OneValueAndNoValueStillGiveADrawing) {
  const ChartSeries point{"p", "#000000", {2}, {5}, false}, none{"n", "#000000", {NAN}, {NAN}, false};
  for (const ChartSeries& series : {point, none}) {
    const std::string svg = draw_svg(300, 300, "t", {}, {{"", "", "", 0, 0, 300, 300, false, true, {series}}});
    EXPECT_THAT(svg, ::testing::HasSubstr("</svg>"));
    EXPECT_THAT(svg, ::testing::Not(::testing::HasSubstr("nan")));
    EXPECT_THAT(svg, ::testing::Not(::testing::HasSubstr("inf")));
  }
}

TEST(DrawSvg, ALogarithmicAxisBreaksTheLineAtWhatIsNotPositive) {
  const ChartSeries line{"l", "#000000", {0, 1, 2, 3, 4}, {1, 100, 0, 10, 1000}, false};
  Chart chart{"", "", "", 0, 0, 400, 300, false, true, {line}, true};
  const std::string svg = draw_svg(400, 300, "", {}, {chart});
  const std::string path = svg.substr(svg.find("d=\"M"));
  EXPECT_EQ(std::count(path.begin(), path.end(), 'M'), 2);
  for (const char* tick : {">1<", ">10<", ">100<", ">1000<"}) EXPECT_THAT(svg, ::testing::HasSubstr(tick));
}

}  // namespace
}  // namespace semvslam
