#include "semvslam/base/yaml_scalars.h"

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace semvslam {
namespace {

std::string scalars_error(const std::string& text) {
  const auto result = yaml_scalars(text, "f.yaml");
  return result ? "no error" : result.error().message;
}

TEST(YamlScalars, KeepTheirPathAndLine) {
  const auto scalars = yaml_scalars("a: 1\nb:\n  - x\n  - {c: 2, d: [p, q]}\ne:\n  f.g: yes\n", "f.yaml");
  ASSERT_TRUE(scalars) << scalars.error().message;
  std::vector<std::string> lines;
  for (const YamlScalar& s : *scalars) lines.push_back(s.where + " " + s.path + "=" + s.value);
  EXPECT_THAT(lines, ::testing::ElementsAre("f.yaml:1 a=1", "f.yaml:3 b.0=x", "f.yaml:4 b.1.c=2", "f.yaml:4 b.1.d.0=p",
                                            "f.yaml:4 b.1.d.1=q", "f.yaml:6 e.f.g=yes"));
  EXPECT_TRUE(yaml_scalars("", "f.yaml")->empty());
}

TEST(YamlScalars, RefuseWhatHasNoMeaning) {
  using ::testing::HasSubstr;
  EXPECT_THAT(scalars_error("a: 1\nb: [1\n"), HasSubstr("f.yaml:3: not valid YAML"));
  EXPECT_THAT(scalars_error("- a\n"), HasSubstr("f.yaml:1: expected 'key: value'"));
  EXPECT_THAT(scalars_error("a: 1\nb:\n"), HasSubstr("f.yaml:2: 'b' has no value"));
  EXPECT_THAT(scalars_error("a: []\n"), HasSubstr("'a' has no value"));
  EXPECT_THAT(scalars_error("a: 1\na: 2\n"), HasSubstr("f.yaml:2: 'a' is set twice"));
  EXPECT_THAT(scalars_error("a: {b: 1}\na.b: 2\n"), HasSubstr("'a.b' is set twice"));
  EXPECT_THAT(scalars_error("a: 1\nb=2: 3\n"), HasSubstr("f.yaml:2: keys must be plain words"));
  EXPECT_THAT(scalars_error("? [a, b]\n: 1\n"), HasSubstr("keys must be plain words"));
  EXPECT_THAT(scalars_error("a: " + std::string(40, '[') + "1" + std::string(40, ']') + "\n"),
              HasSubstr("nested too deeply"));
  EXPECT_THAT(scalars_error(std::string(2 << 20, ' ')), HasSubstr("1 MB"));
}

TEST(YamlScalars, AreNotMultipliedByAliasesWithoutEnd) {
  std::string text = "a0: &a0 [x, x, x, x, x, x, x, x, x, x]\n";
  for (int i = 1; i < 9; ++i) text += fmt::format("a{0}: &a{0} [*a{1}, *a{1}, *a{1}, *a{1}, *a{1}]\n", i, i - 1);
  EXPECT_THAT(scalars_error(text), ::testing::HasSubstr("more than 10000 values"));
}

}  // namespace
}  // namespace semvslam
