#include "semvslam/web/folder_watch.h"

#include <gmock/gmock.h>
#include <poll.h>

#include <fstream>

#include "semvslam/web/run_folder_test_support.h"

namespace semvslam {
namespace {

using testing::ElementsAre;
using testing::IsEmpty;
using testing_support::write;

TEST(FolderWatch, TellsEachChangedFileOnce) {
  const testing_support::TemporaryFolder folder;
  Result<FolderWatch> watch = FolderWatch::create(folder.path());
  ASSERT_TRUE(watch);
  EXPECT_THAT(watch->changed(), IsEmpty());
  std::ofstream(folder / "a") << "1";
  write(folder / "b", "2");
  pollfd wanted{watch->descriptor(), POLLIN, 0};
  EXPECT_EQ(::poll(&wanted, 1, 0), 1);
  EXPECT_THAT(watch->changed(), testing::IsSupersetOf({"a", "b"}));
  EXPECT_THAT(watch->changed(), IsEmpty());
  std::filesystem::remove(folder / "a");
  EXPECT_THAT(watch->changed(), ElementsAre("a"));
}

TEST(FolderWatch, AMissingFolderIsAnError) {
  const testing_support::TemporaryFolder folder;
  EXPECT_EQ(FolderWatch::create(folder / "none").error().code, ErrorCode::kNotFound);
}

}  // namespace
}  // namespace semvslam
