#include "semvslam/base/config_schema.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <stdexcept>

namespace semvslam {
namespace {

using ::testing::HasSubstr;

struct Options {
  int features = 1000;
  double scale = 1.2;
  bool deterministic = false;
  std::string mode = "orb";
  std::string note;
};

ConfigSchema schema_of(Options& o) {
  ConfigSchema schema;
  schema.add("mode", &o.mode, {"orb", "full"}, "what runs");
  schema.add("orb.features", &o.features, {100, 10000}, "features per frame");
  schema.add("track.motion.note", &o.note, {}, "free text");
  schema.add("orb.scale", &o.scale, {1.01, 2}, "factor between pyramid levels");
  schema.add("track.deterministic", &o.deterministic, "fixed order of all steps");
  return schema;
}

std::string error_of(const std::string& yaml) {
  Options o;
  const Status status = schema_of(o).load_yaml(yaml, "my.yaml");
  return status ? "" : status.error().message;
}

TEST(ConfigSchema, LoadsNestedAndDottedKeys) {
  Options o;
  ASSERT_TRUE(
      schema_of(o).load_yaml("mode: full\norb:\n  features: 500\n  scale: 1.5\ntrack.deterministic: yes\n", "x"));
  EXPECT_EQ(o.mode, "full");
  EXPECT_EQ(o.features, 500);
  EXPECT_DOUBLE_EQ(o.scale, 1.5);
  EXPECT_TRUE(o.deterministic);
}

TEST(ConfigSchema, EmptyDocumentsAndEmptySectionsChangeNothing) {
  EXPECT_EQ(error_of(""), "");
  EXPECT_EQ(error_of("# only a comment\n"), "");
  EXPECT_EQ(error_of("orb:\n"), "");
}

TEST(ConfigSchema, UnknownKeyNamesOriginLineAndNearestKey) {
  EXPECT_EQ(error_of("mode: orb\norb:\n  featurs: 5\n"),
            "my.yaml:3: unknown key 'orb.featurs'; the nearest known one is 'orb.features'");
  EXPECT_THAT(error_of("obr:\n  scale: 1.3\n"),
              HasSubstr("my.yaml:1: unknown key 'obr.scale'; the nearest known one is "
                        "'orb.scale'"));
  EXPECT_THAT(error_of("deterministic: true\n"), HasSubstr("'track.deterministic'"));
}

TEST(ConfigSchema, RefusesWrongTypesAndValuesOutOfRange) {
  EXPECT_EQ(error_of("orb:\n  features: many\n"), "my.yaml:2: orb.features must be an integer, got 'many'");
  EXPECT_THAT(error_of("orb: {features: 10.5}"), HasSubstr("must be an integer"));
  EXPECT_THAT(error_of("orb: {features: 99999999999999}"), HasSubstr("must be an integer"));
  EXPECT_EQ(error_of("orb: {features: 5}"), "my.yaml:1: orb.features must be in 100..10000, got 5");
  EXPECT_THAT(error_of("orb: {scale: .nan}"), HasSubstr("must be a number"));
  EXPECT_THAT(error_of("orb: {scale: nan}"), HasSubstr("must be a number"));
  EXPECT_THAT(error_of("orb: {scale: inf}"), HasSubstr("must be a number"));
  EXPECT_THAT(error_of("mode: fast"), HasSubstr("must be one of orb, full; got 'fast'"));
  EXPECT_THAT(error_of("track: {deterministic: 2}"), HasSubstr("must be true or false"));
  EXPECT_THAT(error_of("orb: {features: [1, 2]}"), HasSubstr("needs one value, got a list"));
  EXPECT_THAT(error_of("orb: {features: }"), HasSubstr("needs one value, got none"));
  EXPECT_THAT(error_of("orb: 7"), HasSubstr("'orb' is a section"));
}

TEST(ConfigSchema, RefusesTextThatIsNoMapping) {
  EXPECT_THAT(error_of("just words"), HasSubstr("my.yaml:1: expected"));
  EXPECT_THAT(error_of("mode: orb\norb: {features: 3\nx"), HasSubstr("not valid YAML"));
  EXPECT_THAT(error_of("? [a, b]\n: c\n"), HasSubstr("keys must be plain words"));
  EXPECT_THAT(error_of("&a orb: &b {features: *b}"), HasSubstr("my.yaml:1"));
}

TEST(ConfigSchema, KeySetTwiceIsAnErrorEvenInTwoNotations) {
  EXPECT_EQ(error_of("orb: {features: 500}\norb.features: 600\n"),
            "my.yaml:2: orb.features is set twice, first at my.yaml:1");
}

TEST(ConfigSchema, NothingChangesOnError) {
  Options o;
  ConfigSchema schema = schema_of(o);
  EXPECT_FALSE(schema.load_yaml("mode: full\norb: {features: 500, scale: 9}\n", "x"));
  EXPECT_EQ(o.mode, "orb");
  EXPECT_EQ(o.features, 1000);
  EXPECT_FALSE(schema.set("orb.features=1"));
  EXPECT_EQ(o.features, 1000);
}

TEST(ConfigSchema, SetsSingleValues) {
  Options o;
  ConfigSchema schema = schema_of(o);
  EXPECT_TRUE(schema.set("orb.features=250"));
  EXPECT_TRUE(schema.set("track.motion.note=a=b: #c"));
  EXPECT_EQ(o.features, 250);
  EXPECT_EQ(o.note, "a=b: #c");
  EXPECT_EQ(schema.set("orb.features").error().message, "--set needs key=value, got 'orb.features'");
  EXPECT_THAT(schema.set("orb.feature=1").error().message, HasSubstr("nearest known one is 'orb.features'"));
}

TEST(ConfigSchema, DumpIsReadBackToTheSameValues) {
  Options written;
  written.features = 321;
  written.scale = 1.1 + 0.2;
  written.deterministic = true;
  written.mode = "full";
  written.note = "true: \"#\" \n line";
  const std::string text = schema_of(written).dump_yaml();
  Options read;
  const Status status = schema_of(read).load_yaml(text, "dump");
  ASSERT_TRUE(status) << status.error().message << "\n" << text;
  EXPECT_EQ(read.features, written.features);
  EXPECT_EQ(read.scale, written.scale);
  EXPECT_EQ(read.deterministic, written.deterministic);
  EXPECT_EQ(read.mode, written.mode);
  EXPECT_EQ(read.note, written.note);
}

TEST(ConfigSchema, DumpGroupsSectionsAndCarriesDocs) {
  Options o;
  EXPECT_EQ(schema_of(o).dump_yaml(),
            "# what runs [orb, full]\n"
            "mode: orb\n"
            "orb:\n"
            "  # features per frame [100..10000]\n"
            "  features: 1000\n"
            "  # factor between pyramid levels [1.01..2]\n"
            "  scale: 1.2\n"
            "track:\n"
            "  motion:\n"
            "    # free text\n"
            "    note: \"\"\n"
            "  # fixed order of all steps\n"
            "  deterministic: false\n");
}

TEST(ConfigSchema, MarkdownShowsDefaultsNotPresentValues) {
  Options o;
  ConfigSchema schema = schema_of(o);
  ASSERT_TRUE(schema.set("orb.features=250"));
  EXPECT_THAT(schema.markdown(), HasSubstr("| `orb.features` | integer | 1000 | 100..10000 | features per frame |"));
  EXPECT_THAT(schema.keys(),
              ::testing::ElementsAre("mode", "orb.features", "track.motion.note", "orb.scale", "track.deterministic"));
}

TEST(ConfigSchema, CollidingOrMalformedKeysAreProgrammingErrors) {
  Options o;
  ConfigSchema schema = schema_of(o);
  EXPECT_THROW(schema.add("mode", &o.features, {}, "twice"), std::logic_error);
  EXPECT_THROW(schema.add("orb", &o.features, {}, "a section"), std::logic_error);
  EXPECT_THROW(schema.add("mode.x", &o.features, {}, "below a value"), std::logic_error);
  EXPECT_THROW(schema.add("Orb.x", &o.features, {}, "upper case"), std::logic_error);
  EXPECT_THROW(schema.add("ok", static_cast<int*>(nullptr), {}, "null"), std::logic_error);
}

}  // namespace
}  // namespace semvslam
