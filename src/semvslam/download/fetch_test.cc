#include "semvslam/download/fetch.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <fstream>
#include <string>

#include "semvslam/base/temporary_folder_test_support.h"
#include "semvslam/download/content_test_support.h"

// Servers that break off, know no ranges or redirect are in tests/download_test.py.
namespace semvslam {
namespace fs = std::filesystem;

namespace {

using ::testing::HasSubstr;
using testing_support::content_of;

class FetchTest : public ::testing::Test {
 protected:
  FetchTest() { std::ofstream(folder / "there") << "0123456789"; }
  Status get(const std::string& name) {
    return fetch("file://" + (folder / name).string(), folder / "here", [this](std::uint64_t done, auto total) {
      last_done = done;
      if (total) last_total = *total;
      return go_on;
    });
  }

  testing_support::TemporaryFolder folder;
  std::uint64_t last_done = 0, last_total = 0;
  bool go_on = true;
};

TEST_F(FetchTest, AFileComesWhole) {
  const Status status = get("there");
  ASSERT_TRUE(status.ok()) << status.error().message;
  EXPECT_EQ(content_of(folder / "here"), "0123456789");
  EXPECT_FALSE(fs::exists(folder / "here.part"));
  EXPECT_EQ(last_done, 10u);
  EXPECT_EQ(last_total, 10u);
}

TEST_F(FetchTest, ItGoesOnBehindWhatIsThere) {
  std::ofstream(folder / "here.part") << "abcd";
  ASSERT_TRUE(get("there").ok());
  EXPECT_EQ(content_of(folder / "here"), "abcd456789");
  EXPECT_EQ(last_done, 10u);
}

TEST_F(FetchTest, WhatIsNotThereIsNotFound) {
  const Status status = get("nowhere");
  ASSERT_FALSE(status.ok());
  EXPECT_EQ(status.error().code, ErrorCode::kNotFound) << status.error().message;
  EXPECT_THAT(status.error().message, HasSubstr("nowhere"));
  EXPECT_FALSE(fs::exists(folder / "here"));
}

TEST_F(FetchTest, ADiskThatRefusesIsNamed) {
  const Status status = fetch("file://" + (folder / "there").string(), folder / "no" / "such" / "folder",
                              [](std::uint64_t, auto) { return true; });
  ASSERT_FALSE(status.ok());
  EXPECT_EQ(status.error().code, ErrorCode::kIo);
  EXPECT_THAT(status.error().message, HasSubstr("No such file or directory"));
}

TEST_F(FetchTest, ItStopsWhenToldTo) {
  go_on = false;
  EXPECT_FALSE(get("there").ok());
  EXPECT_FALSE(fs::exists(folder / "here"));
}

}  // namespace
}  // namespace semvslam
