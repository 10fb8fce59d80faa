#include "semvslam/data/file_io.h"

#include <gmock/gmock.h>
#include <sys/resource.h>

#include <csignal>

#include "semvslam/data/data_test_support.h"

namespace semvslam {
namespace {

using namespace testing_support;
using ::testing::HasSubstr;

/// No file of this process may grow beyond `bytes` while this lives: a disk that fills up in the middle of a write.
class FileSizeLimit {
 public:
  explicit FileSizeLimit(rlim_t bytes) {
    old_handler_ = std::signal(SIGXFSZ, SIG_IGN);
    getrlimit(RLIMIT_FSIZE, &old_limit_);
    const rlimit limit{bytes, old_limit_.rlim_max};
    setrlimit(RLIMIT_FSIZE, &limit);
  }
  FileSizeLimit(const FileSizeLimit&) = delete;
  FileSizeLimit& operator=(const FileSizeLimit&) = delete;
  ~FileSizeLimit() {
    setrlimit(RLIMIT_FSIZE, &old_limit_);
    std::signal(SIGXFSZ, old_handler_);
  }

 private:
  rlimit old_limit_{};
  void (*old_handler_)(int);
};

std::size_t files_in(const TemporaryFolder& folder) {
  return static_cast<std::size_t>(std::distance(std::filesystem::directory_iterator(folder.path()), {}));
}

TEST(OutputFile, NeverEndsInsideARecordAndGoesOnWhenThereIsRoom) {
  TemporaryFolder folder;
  Result<OutputFile> file = OutputFile::create(folder / "f");
  ASSERT_TRUE(file.ok());
  ASSERT_TRUE(file->write("first\n").ok());
  {
    FileSizeLimit limit(10);
    const Status status = file->write("second line\n");
    ASSERT_FALSE(status.ok());
    EXPECT_THAT(status.error().message, HasSubstr("cannot write: File too large"));
    EXPECT_EQ(read_text(folder / "f"), "first\n");
  }
  ASSERT_TRUE(file->write("third\n").ok());
  EXPECT_EQ(read_text(folder / "f"), "first\nthird\n");
}

TEST(WriteFileAtomically, ReplacesAndLeavesNothingBeside) {
  TemporaryFolder folder;
  ASSERT_TRUE(write_file_atomically(folder / "f", "old").ok());
  ASSERT_TRUE(write_file_atomically(folder / "f", "new").ok());
  EXPECT_EQ(read_text(folder / "f"), "new");
  EXPECT_EQ(files_in(folder), 1u);
}

TEST(WriteFileAtomically, KeepsTheOldFileWhenTheDiskIsFull) {
  TemporaryFolder folder;
  write_text(folder / "f", "old");
  {
    FileSizeLimit limit(10);
    EXPECT_FALSE(write_file_atomically(folder / "f", "a content of more than ten bytes").ok());
  }
  EXPECT_EQ(read_text(folder / "f"), "old");
  EXPECT_EQ(files_in(folder), 1u) << "the temporary file is removed";
}

TEST(WriteFileAtomically, SaysWhereItCannotWrite) {
  TemporaryFolder folder;
  EXPECT_THAT(write_file_atomically(folder / "no/f", "x").error().message, HasSubstr("no/f"));
  std::filesystem::create_directories(folder / "d/inside");
  EXPECT_THAT(write_file_atomically(folder / "d", "x").error().message, HasSubstr("d: cannot replace"));
  EXPECT_EQ(files_in(folder), 1u);
}

TEST(WriteFileAtomically, ADeviceStaysOne) {
  const std::filesystem::path null = "/dev/null", full = "/dev/full";
  EXPECT_TRUE(write_file_atomically(null, "x").ok());
  EXPECT_TRUE(std::filesystem::is_character_file(null));
  if (!std::filesystem::exists(full)) GTEST_SKIP() << "this system has no /dev/full";
  const Status status = write_file_atomically(full, "x");
  ASSERT_FALSE(status.ok());
  EXPECT_EQ(status.error().code, ErrorCode::kIo);
  EXPECT_THAT(status.error().message, HasSubstr("/dev/full: cannot write"));
  EXPECT_TRUE(std::filesystem::is_character_file(full));
}

TEST(ReadFile, ReadsWholeFilesAndRefusesOthers) {
  TemporaryFolder folder;
  write_text(folder / "f", std::string("a\0b", 3));
  EXPECT_EQ(*read_text_file(folder / "f"), std::string("a\0b", 3));
  EXPECT_THAT(read_text_file(folder / "f", 2).error().message, HasSubstr("3 bytes are too many"));
  std::vector<std::uint8_t> bytes(100);
  ASSERT_TRUE(read_binary_file(folder / "f", bytes).ok());
  EXPECT_EQ(bytes.size(), 3u);
  ASSERT_TRUE(read_binary_file(folder / "f", bytes, 2).ok());
  EXPECT_EQ(bytes, (std::vector<std::uint8_t>{'a', '\0'}));
  EXPECT_EQ(read_binary_file(folder / "g", bytes).error().code, ErrorCode::kNotFound);
  EXPECT_THAT(read_binary_file(folder.path(), bytes).error().message, HasSubstr("is not a file"));
  write_text(folder / "empty", "");
  EXPECT_THAT(read_binary_file(folder / "empty", bytes).error().message, HasSubstr("the file is empty"));
}

}  // namespace
}  // namespace semvslam
