#include "semvslam/data/sequence_layout.h"

#include <gmock/gmock.h>

#include "semvslam/data/data_test_support.h"

namespace semvslam {
namespace {

using namespace testing_support;
using ::testing::ElementsAre;
using ::testing::HasSubstr;

class LayoutTest : public ::testing::Test {
 protected:
  void make(std::initializer_list<const char*> files) {
    for (const char* file : files) write_text(folder_ / file, "x");
  }
  SequenceLayout layout() {
    Result<SequenceLayout> found = detect_layout(folder_.path(), 0.02);
    EXPECT_TRUE(found.ok()) << (found.ok() ? "" : found.error().message);
    return found ? *found : SequenceLayout{};
  }
  static std::vector<std::string> names(const SequenceLayout& layout) {
    std::vector<std::string> all;
    for (const ImagePair& pair : layout.pairs.pairs) all.push_back(pair.colour_file + "+" + pair.depth_file);
    return all;
  }
  static std::vector<std::int64_t> stamps_ms(const SequenceLayout& layout) {
    std::vector<std::int64_t> all;
    for (const ImagePair& pair : layout.pairs.pairs) all.push_back(pair.stamp.ns / 1000000);
    return all;
  }
  TemporaryFolder folder_;
};

TEST_F(LayoutTest, ListsGoBeforeAssociations) {
  write_text(folder_ / "rgb.txt", "1 r1\n2 r2\n");
  write_text(folder_ / "depth.txt", "1.01 d1\n2.03 d2\n");
  write_text(folder_ / "associations.txt", "1 x 1 y\n");
  const SequenceLayout found = layout();
  EXPECT_EQ(found.kind, SequenceKind::kTimedLists);
  EXPECT_THAT(names(found), ElementsAre("r1+d1"));
}

TEST_F(LayoutTest, AssociationsWithTimes) {
  write_text(folder_ / "associations.txt", "10.5 rgb/10.5.png 10.6 depth/10.6.png\n11 rgb/11.png 11 depth/11.png\n");
  const SequenceLayout found = layout();
  EXPECT_EQ(found.kind, SequenceKind::kAssociations);
  EXPECT_FALSE(found.stamps_are_frame_numbers);
  EXPECT_THAT(stamps_ms(found), ElementsAre(10500, 11000));
}

TEST_F(LayoutTest, IclNuimNumbersBecomeTimesByTheFrameRate) {
  write_text(folder_ / "associations.txt",
             "0 depth/0.png 0 rgb/0.png\n3 depth/3.png 3 rgb/3.png\n600 depth/600.png 600 rgb/600.png\n");
  SequenceLayout found = layout();
  EXPECT_EQ(found.kind, SequenceKind::kIclNuim);
  EXPECT_THAT(names(found)[1], "rgb/3.png+depth/3.png");
  scale_stamps(found, 30);
  EXPECT_THAT(stamps_ms(found), ElementsAre(0, 100, 20000));
  scale_stamps(found, 30);
  EXPECT_THAT(stamps_ms(found), ElementsAre(0, 100, 20000)) << "only once";
}

TEST_F(LayoutTest, FoldersByEqualNamesInNaturalOrder) {
  make({"rgb/9.jpg", "rgb/10.jpg", "rgb/12.jpg", "rgb/notes.txt", "depth/9.png", "depth/10.png", "depth/11.png"});
  SequenceLayout found = layout();
  EXPECT_EQ(found.kind, SequenceKind::kImageFolders);
  EXPECT_THAT(names(found), ElementsAre("rgb/9.jpg+depth/9.png", "rgb/10.jpg+depth/10.png"));
  EXPECT_EQ(found.pairs.colour_without_depth, 1u);
  EXPECT_EQ(found.pairs.depth_without_colour, 1u);
  scale_stamps(found, 10);
  EXPECT_THAT(stamps_ms(found), ElementsAre(900, 1000)) << "a gap in the numbers is a gap in time";
}

TEST_F(LayoutTest, FoldersByTheNumbersInTheNames) {
  make({"color/frame-000007.color.jpg", "color/frame-000008.color.jpg", "depth/frame-000008.depth.png",
        "depth/frame-000007.depth.png"});
  EXPECT_THAT(names(layout()), ElementsAre("color/frame-000007.color.jpg+depth/frame-000007.depth.png",
                                           "color/frame-000008.color.jpg+depth/frame-000008.depth.png"));
}

TEST_F(LayoutTest, FoldersByTheTimesInTheNames) {
  make({"rgb/1305031102.175304.png", "rgb/1305031102.211214.png", "depth/1305031102.160407.png",
        "depth/1305031102.226738.png"});
  const SequenceLayout found = layout();
  EXPECT_FALSE(found.stamps_are_frame_numbers);
  EXPECT_THAT(names(found), ElementsAre("rgb/1305031102.175304.png+depth/1305031102.160407.png",
                                        "rgb/1305031102.211214.png+depth/1305031102.226738.png"));
  EXPECT_EQ(found.pairs.pairs[0].stamp.ns, 1305031102175304000);
}

TEST_F(LayoutTest, WholeNumbersAsLongAsAnEpochAreTimes) {
  make({"rgb/1305031102175304000.png", "depth/1305031102175304.png"});  // ns and us
  const SequenceLayout found = layout();
  ASSERT_EQ(found.pairs.pairs.size(), 1u);
  EXPECT_EQ(found.pairs.pairs[0].stamp.ns, 1305031102175304000);
}

TEST_F(LayoutTest, FoldersByOrderWhenNamesDoNotTell) {
  make({"rgb/a.png", "rgb/b.png", "depth/x.png", "depth/y.png"});
  const SequenceLayout found = layout();
  EXPECT_THAT(names(found), ElementsAre("rgb/a.png+depth/x.png", "rgb/b.png+depth/y.png"));
  EXPECT_THAT(found.warnings, ElementsAre(HasSubstr("paired by their order")));
  EXPECT_THAT(stamps_ms(found), ElementsAre(0, 1000));
}

TEST_F(LayoutTest, FoldersThatDoNotFitAreAnError) {
  make({"rgb/1.png", "depth/2.png", "depth/3.png"});
  EXPECT_THAT(detect_layout(folder_.path(), 0.02).error().message,
              HasSubstr("no image of rgb/ (1 there) belongs to one of depth/ (2 there)"));
}

}  // namespace
}  // namespace semvslam
