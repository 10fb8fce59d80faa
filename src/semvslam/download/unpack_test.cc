#include "semvslam/download/unpack.h"

#include <archive.h>
#include <archive_entry.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <fstream>
#include <string>
#include <vector>

#include "semvslam/base/temporary_folder_test_support.h"
#include "semvslam/download/content_test_support.h"

namespace semvslam {
namespace fs = std::filesystem;

namespace {

using ::testing::HasSubstr;
using testing_support::content_of;

struct Entry {
  std::string name, content;
  int type = AE_IFREG;
};

enum class Kind { kTgz, kZip };

void write_archive(const fs::path& file, Kind kind, const std::vector<Entry>& entries) {
  archive* writer = archive_write_new();
  if (kind == Kind::kTgz) {
    archive_write_add_filter_gzip(writer);
    archive_write_set_format_pax_restricted(writer);
  } else {
    archive_write_set_format_zip(writer);
  }
  ASSERT_EQ(archive_write_open_filename(writer, file.c_str()), ARCHIVE_OK);
  for (const Entry& e : entries) {
    archive_entry* entry = archive_entry_new();
    archive_entry_set_pathname(entry, e.name.c_str());
    archive_entry_set_filetype(entry, static_cast<unsigned>(e.type));
    archive_entry_set_perm(entry, 0);  // as some archives have it
    if (e.type == AE_IFLNK)
      archive_entry_set_symlink(entry, e.content.c_str());
    else
      archive_entry_set_size(entry, static_cast<la_int64_t>(e.content.size()));
    ASSERT_EQ(archive_write_header(writer, entry), ARCHIVE_OK);
    if (e.type == AE_IFREG) archive_write_data(writer, e.content.data(), e.content.size());
    archive_entry_free(entry);
  }
  ASSERT_EQ(archive_write_free(writer), ARCHIVE_OK);
}

std::vector<Entry> recording() {
  std::string noise(300'000, ' ');  // more than one block
  for (std::size_t i = 0; i < noise.size(); ++i) noise[i] = static_cast<char>(i * i >> 3);
  return {{"room/", "", AE_IFDIR}, {"room/rgb.txt", "# nothing\n"}, {"room/rgb/1.png", noise}};
}

class UnpackTest : public ::testing::TestWithParam<Kind> {
 protected:
  Status unpack_it(const std::string& folder_name = "room") {
    return unpack(file, folder.path(), folder_name, [this](std::uint64_t) { return go_on; });
  }
  /// That nothing is left but the archive.
  void expect_nothing() const {
    std::vector<std::string> names;
    for (const fs::directory_entry& e : fs::directory_iterator(folder.path())) names.push_back(e.path().filename());
    EXPECT_THAT(names, ::testing::ElementsAre("archive"));
  }

  testing_support::TemporaryFolder folder;
  const fs::path file = folder / "archive";
  bool go_on = true;
};

TEST_P(UnpackTest, TheFolderIsThereWithAllItHolds) {
  write_archive(file, GetParam(), recording());
  const Status status = unpack_it();
  ASSERT_TRUE(status.ok()) << status.error().message;
  EXPECT_EQ(content_of(folder / "room/rgb.txt"), "# nothing\n");
  EXPECT_EQ(content_of(folder / "room/rgb/1.png"), recording()[2].content);
  EXPECT_EQ(std::distance(fs::directory_iterator(folder.path()), {}), 2);
  EXPECT_FALSE(unpack_it().ok()) << "it is there already";
}

TEST_P(UnpackTest, NothingIsWrittenOutsideAndNothingElseIsTaken) {
  const std::vector<std::vector<Entry>> bad = {
      {{"room/a", "a"}, {"../b", "b"}},        {{"room/a", "a"}, {"room/../../b", "b"}},          {{"/room/b", "b"}},
      {{"room/a", "a"}, {"elsewhere/b", "b"}}, {{"room/l", "/tmp", AE_IFLNK}, {"room/l/b", "b"}}, {},
  };
  for (std::size_t i = 0; i < bad.size(); ++i) {
    write_archive(file, GetParam(), bad[i]);
    const Status status = unpack_it();
    ASSERT_FALSE(status.ok()) << i;
    EXPECT_EQ(status.error().code, ErrorCode::kInvalidInput) << i << status.error().message;
    expect_nothing();
    EXPECT_FALSE(fs::exists(folder.path().parent_path() / "b"));
  }
}

TEST_P(UnpackTest, DamageIsFoundAndLeavesNothing) {
  write_archive(file, GetParam(), recording());
  const std::string whole = content_of(file);
  for (const std::size_t length : {std::size_t{0}, std::size_t{10}, whole.size() / 2}) {
    std::ofstream(file, std::ios::binary) << whole.substr(0, length);
    EXPECT_FALSE(unpack_it().ok()) << length;
    expect_nothing();
  }
  std::string flipped = whole;
  flipped[whole.size() / 2] = static_cast<char>(flipped[whole.size() / 2] ^ 0x55);
  std::ofstream(file, std::ios::binary) << flipped;
  EXPECT_FALSE(unpack_it().ok()) << "a checksum of the archive's own";
  expect_nothing();
  std::ofstream(file, std::ios::binary) << "<html>no such page</html>";
  EXPECT_THAT(unpack_it().error().message, HasSubstr("damaged archive, or none"));
}

TEST_P(UnpackTest, ItStopsWhenToldTo) {
  write_archive(file, GetParam(), recording());
  go_on = false;
  const Status status = unpack_it();
  ASSERT_FALSE(status.ok());
  EXPECT_EQ(status.error().code, ErrorCode::kIo);
  expect_nothing();
}

INSTANTIATE_TEST_SUITE_P(Kinds, UnpackTest, ::testing::Values(Kind::kTgz, Kind::kZip),
                         [](const auto& kind) { return kind.param == Kind::kTgz ? "tgz" : "zip"; });

TEST(Sha256, IsThatOfTheStandard) {
  const testing_support::TemporaryFolder folder;
  const fs::path file = folder / "abc";
  std::ofstream(file) << "abc";
  const auto always = [](std::uint64_t) { return true; };
  // FIPS 180-2, appendix B.1
  EXPECT_EQ(*sha256_of_file(file, always), "ba7816bf8f01cfea414140de5dae2223b00361a396177a9cb410ff61f20015ad");
  EXPECT_FALSE(sha256_of_file(folder / "nothing", always).ok());
  EXPECT_FALSE(sha256_of_file(file, [](std::uint64_t) { return false; }).ok());
}

}  // namespace
}  // namespace semvslam
