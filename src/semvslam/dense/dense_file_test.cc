#include "semvslam/dense/dense_file.h"

#include <gmock/gmock.h>

#include "semvslam/base/temporary_folder_test_support.h"
#include "semvslam/data/file_io.h"

namespace semvslam {
namespace {

using testing::AllOf;
using testing::HasSubstr;

DenseMap small_map() {
  return {{{{1, 2, 3}, {255, 128, 1}, 7}}, LabelNames{{7, "cup"}}, {{octree_code({20, 40, 60}).value(), true}}, 0.05};
}

TEST(DenseFile, TheNameSaysTheFormat) {
  const testing_support::TemporaryFolder folder;
  const DenseMap map = small_map();
  const auto written = [&](const char* name) {
    const Status status = write_dense_map(folder / name, map);
    EXPECT_TRUE(status) << name;
    return read_text_file(folder / name).value();
  };
  EXPECT_EQ(written("a.ply"), format_ply(map.points, map.labels));
  EXPECT_EQ(written("a.pcd"), format_pcd(map.points, map.labels));
  EXPECT_EQ(written("a.labels.ply"), format_ply(coloured_by_label(map.points), map.labels));
  EXPECT_EQ(written("a.bt"), format_bt(map.leaves, .05));
  EXPECT_EQ(written("a.ot"), format_ot(map.leaves, .05));
}

TEST(DenseFile, OtherNamesAreRefusedWithTheKnownOnes) {
  const testing_support::TemporaryFolder folder;
  for (const char* name : {"a.xyz", "ply", "a.PLY", "a.bt.gz"}) {
    const Status other = write_dense_map(folder / name, small_map());
    ASSERT_FALSE(other) << name;
    EXPECT_THAT(other.error().message, AllOf(HasSubstr(name), HasSubstr(".ply or .pcd"), HasSubstr(".bt or .ot")));
  }
}

TEST(DenseFile, AFolderThatIsNotThereIsAnError) {
  const testing_support::TemporaryFolder folder;
  EXPECT_FALSE(write_dense_map(folder / "absent/a.ply", small_map()));
  EXPECT_FALSE(write_dense_map(folder / "absent/a.bt", small_map()));
}

}  // namespace
}  // namespace semvslam
