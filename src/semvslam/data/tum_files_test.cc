#include "semvslam/data/tum_files.h"

#include <gmock/gmock.h>

#include <random>
#include <set>
#include <tuple>

namespace semvslam {
namespace {

using ::testing::HasSubstr;

FileList list_of(std::initializer_list<std::int64_t> stamps_ms, const std::string& prefix) {
  FileList list;
  for (std::int64_t ms : stamps_ms) list.entries.push_back({{ms * 1000000}, prefix + std::to_string(ms)});
  return list;
}

std::string file_list_error(const std::string& text) {
  const Result<FileList> list = parse_file_list(text, "rgb.txt");
  return list ? "" : list.error().message;
}

TEST(ParseFileList, ReadsStampsExactlyAndNamesWithBlanks) {
  const Result<FileList> list =
      parse_file_list("# x\r\n1305031102.175304 rgb/a b.png\r\n\r\n1305031102.211214\trgb/c.png\r\n", "x");
  ASSERT_TRUE(list.ok());
  ASSERT_EQ(list->entries.size(), 2u);
  EXPECT_EQ(list->entries[0].stamp.ns, 1305031102175304000);
  EXPECT_EQ(list->entries[0].file, "rgb/a b.png");
  EXPECT_EQ(list->entries[1].file, "rgb/c.png");
  EXPECT_EQ(list->oddities(), "");
}

TEST(ParseFileList, SortsDropsDuplicatesAndNansAndCountsThem) {
  const Result<FileList> list = parse_file_list("3 c\n1 a\n2 b\n2 b2\nnan n\ninf n\n4 d\n5.1", "x");
  ASSERT_TRUE(list.ok());
  ASSERT_EQ(list->entries.size(), 4u);
  EXPECT_EQ(list->entries[1].file, "b") << "the first of a pair of duplicates stays";
  for (std::size_t i = 1; i < 4; ++i) EXPECT_LT(list->entries[i - 1].stamp, list->entries[i].stamp);
  EXPECT_EQ(list->out_of_order, 1u);
  EXPECT_EQ(list->duplicates, 1u);
  EXPECT_EQ(list->non_finite, 2u);
  EXPECT_EQ(list->cut_off, 1u);
  EXPECT_EQ(list->oddities(),
            "1 line out of order (sorted), 1 duplicate time stamp (first kept), 2 time stamps not a number (dropped), "
            "1 last line broken off (dropped)");
}

TEST(ParseFileList, ErrorsNameFileAndLine) {
  EXPECT_THAT(file_list_error("1 a\n\n# c\nhello world\n"), HasSubstr("rgb.txt:4: 'hello' is no time stamp"));
  EXPECT_THAT(file_list_error("1 a\n2\n3 c\n"), HasSubstr("rgb.txt:2: no file name"));
  EXPECT_THAT(file_list_error("1e30 a\n"), HasSubstr("rgb.txt:1: '1e30' is no time stamp"));
  EXPECT_THAT(file_list_error("\x01\x02 a\n"), HasSubstr("'?\?'"));
}

TEST(ParseAssociations, TakesTheStampOfTheColourImageInEitherOrder) {
  const Result<PairList> tum = parse_associations("1.5 rgb/1.png 1.6 depth/1.png\n", "x");
  const Result<PairList> icl = parse_associations("1.6 depth/1.png 1.5 rgb/1.png\n", "x");
  for (const Result<PairList>* list : {&tum, &icl}) {
    ASSERT_TRUE(list->ok());
    ASSERT_EQ((*list)->pairs.size(), 1u);
    EXPECT_EQ((*list)->pairs[0].stamp.ns, 1500000000);
    EXPECT_EQ((*list)->pairs[0].colour_file, "rgb/1.png");
    EXPECT_EQ((*list)->pairs[0].depth_file, "depth/1.png");
  }
}

TEST(ParseAssociations, ErrorsNameTheLineAndABrokenLastLineIsDropped) {
  EXPECT_THAT(parse_associations("1 a 1 b\n1 a 1\n2 a 2 b\n", "as.txt").error().message,
              HasSubstr("as.txt:2: expected 'stamp file stamp file', got 3 words"));
  EXPECT_THAT(parse_associations("1 a x b\n", "as.txt").error().message, HasSubstr("as.txt:1: 'x' is no time stamp"));
  const Result<PairList> cut = parse_associations("2 a 2 b\n1 a 1 b\n1 c 1 d\nnan a 1 b\n3 a 3", "as.txt");
  ASSERT_TRUE(cut.ok());
  EXPECT_EQ(cut->pairs.size(), 2u);
  EXPECT_EQ(cut->pairs[0].stamp.ns, 1000000000);
  EXPECT_EQ(cut->report.cut_off, 1u);
  EXPECT_EQ(cut->report.duplicates, 1u);
  EXPECT_EQ(cut->report.non_finite, 1u);
}

TEST(Associate, PairsTheNearestAndUsesEachOnce) {
  // 100 is nearer to 104 than 110 is; 110 then takes 120, though 104 was nearer to it.
  const PairList list = associate(list_of({100, 110, 200}, "c"), list_of({104, 120, 231}, "d"), 0.02);
  ASSERT_EQ(list.pairs.size(), 2u);
  EXPECT_EQ(list.pairs[0].colour_file, "c100");
  EXPECT_EQ(list.pairs[0].depth_file, "d104");
  EXPECT_EQ(list.pairs[1].colour_file, "c110");
  EXPECT_EQ(list.pairs[1].depth_file, "d120");
  EXPECT_EQ(list.colour_without_depth, 1u);
  EXPECT_EQ(list.depth_without_colour, 1u);
}

TEST(Associate, TheClosestPairWinsWhereTwoWantTheSame) {
  const PairList list = associate(list_of({100, 108}, "c"), list_of({107}, "d"), 0.02);
  ASSERT_EQ(list.pairs.size(), 1u);
  EXPECT_EQ(list.pairs[0].colour_file, "c108");
}

/// The rule in its plain wording: all pairs by gap, then by time; each image once.
std::size_t pairs_by_exhaustion(const FileList& colour, const FileList& depth, std::int64_t max_gap_ns,
                                std::int64_t& gap_sum) {
  std::vector<std::tuple<std::int64_t, std::size_t, std::size_t>> all;
  for (std::size_t c = 0; c < colour.entries.size(); ++c)
    for (std::size_t d = 0; d < depth.entries.size(); ++d) {
      const std::int64_t gap = std::abs(colour.entries[c].stamp.ns - depth.entries[d].stamp.ns);
      if (gap <= max_gap_ns) all.emplace_back(gap, c, d);
    }
  std::sort(all.begin(), all.end());
  std::set<std::size_t> colour_used, depth_used;
  for (const auto& [gap, c, d] : all) {
    if (colour_used.count(c) || depth_used.count(d)) continue;
    colour_used.insert(c);
    depth_used.insert(d);
    gap_sum += gap;
  }
  return colour_used.size();
}

TEST(Associate, GivesWhatExhaustiveSearchGives) {
  std::mt19937 random(5);
  for (int round = 0; round < 50; ++round) {
    std::set<std::int64_t> colour_ns, depth_ns;
    for (int i = 0; i < 60; ++i)
      colour_ns.insert(random() % 1000000007 * 2);  // even and odd: no two gaps alike by chance
    for (int i = 0; i < 50; ++i) depth_ns.insert(random() % 1000000007 * 2 + 1);
    FileList colour, depth;
    for (std::int64_t ns : colour_ns) colour.entries.push_back({{ns}, std::to_string(ns)});
    for (std::int64_t ns : depth_ns) depth.entries.push_back({{ns}, std::to_string(ns)});
    std::int64_t expected_sum = 0, sum = 0;
    const std::size_t expected = pairs_by_exhaustion(colour, depth, 20000000, expected_sum);
    const PairList list = associate(colour, depth, 0.02);
    for (const ImagePair& pair : list.pairs)
      sum += std::abs(std::stoll(pair.colour_file) - std::stoll(pair.depth_file));
    EXPECT_EQ(list.pairs.size(), expected);
    EXPECT_EQ(sum, expected_sum);
  }
}

TEST(Associate, TheToleranceIsInclusiveToTheNanosecond) {
  FileList depth = list_of({120}, "d");
  EXPECT_EQ(associate(list_of({100}, "c"), depth, 0.02).pairs.size(), 1u);
  ++depth.entries[0].stamp.ns;
  EXPECT_EQ(associate(list_of({100}, "c"), depth, 0.02).pairs.size(), 0u);
}

TEST(Associate, StandsStampsAtTheEndsOfTime) {
  FileList colour, depth;
  colour.entries.push_back({{std::numeric_limits<std::int64_t>::min() + 1}, "c"});
  depth.entries.push_back({{std::numeric_limits<std::int64_t>::max()}, "d"});
  EXPECT_TRUE(associate(colour, depth, 0.02).pairs.empty());
}

}  // namespace
}  // namespace semvslam
