#include "semvslam/semantic/json_integer.h"

#include <gmock/gmock.h>

#include <cstdint>

namespace semvslam {
namespace {

using nlohmann::json;
using testing::ElementsAre;
using testing::HasSubstr;
using testing::ThrowsMessage;

TEST(JsonInteger, WholeNumbersThatFitAreTakenHoweverTheyAreWritten) {
  EXPECT_EQ(integer_of<int>(json::parse("-7")), -7);
  EXPECT_EQ(integer_of<int>(json::parse("640.0")), 640);
  EXPECT_EQ(integer_of<int>(json::parse("6.4e2")), 640);
  EXPECT_EQ(integer_of<int>(json::parse("true")), 1);
  EXPECT_EQ(integer_of<int>(json::parse("-2147483648")), INT32_MIN);
  EXPECT_EQ(integer_of<int>(json::parse("-2147483648.0")), INT32_MIN);
  EXPECT_EQ(integer_of<std::uint32_t>(json::parse("4294967295")), UINT32_MAX);
  EXPECT_EQ(integer_of<std::int64_t>(json::parse("-9223372036854775808")), INT64_MIN);
}

TEST(JsonInteger, OthersAreRefused) {
  for (const char* text : {"2147483648", "2147483648.0", "-2147483649", "1e20", "-1e300", "18446744073709551615", "0.5",
                           "\"3\"", "null", "[3]", "{}"})
    EXPECT_THROW(integer_of<int>(json::parse(text)), std::invalid_argument) << text;
  for (const char* text : {"-1", "-1.0", "4294967296", "4294967296.0"})
    EXPECT_THROW(integer_of<std::uint32_t>(json::parse(text)), std::invalid_argument) << text;
  EXPECT_THROW(integer_of<std::int64_t>(json::parse("9223372036854775808.0")), std::invalid_argument);
}

TEST(JsonInteger, MembersAreNamed) {
  const json j = json::parse(R"({"width": 1e20, "runs": [3, 5], "bad": [3, -5], "text": "3"})");
  EXPECT_THAT([&] { integer_at<int>(j, "width"); },
              ThrowsMessage<std::invalid_argument>(HasSubstr("'width': 1e+20 is out of range")));
  EXPECT_THAT(integers_at<std::uint32_t>(j, "runs"), ElementsAre(3, 5));
  EXPECT_THAT([&] { integers_at<std::uint32_t>(j, "bad"); }, ThrowsMessage<std::invalid_argument>(HasSubstr("'bad'")));
  EXPECT_THAT([&] { integers_at<int>(j, "text"); }, ThrowsMessage<std::invalid_argument>(HasSubstr("no list")));
  EXPECT_THROW(integer_at<int>(j, "absent"), json::exception);
}

}  // namespace
}  // namespace semvslam
