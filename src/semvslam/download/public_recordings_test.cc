#include "semvslam/download/public_recordings.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <set>

namespace semvslam {
namespace {

using ::testing::HasSubstr;

TEST(PublicRecordings, ARecordingIsFoundByEveryNameThatPeopleGiveIt) {
  for (const char* name :
       {"fr3_walking_xyz", "fr3/walking_xyz", "freiburg3_walking_xyz", "rgbd_dataset_freiburg3_walking_xyz"}) {
    const Result<std::vector<PublicRecording>> found = find_public_recordings("tum", name);
    ASSERT_TRUE(found.ok()) << name;
    ASSERT_EQ(found->size(), 1u) << name;
    EXPECT_EQ(found->front().folder, "rgbd_dataset_freiburg3_walking_xyz");
    EXPECT_EQ(found->front().base_url + "/" + found->front().archive,
              "https://cvg.cit.tum.de/rgbd/dataset/freiburg3/rgbd_dataset_freiburg3_walking_xyz.tgz");
  }
  EXPECT_EQ(find_public_recordings("bonn", "balloon2")->front().archive, "rgbd_bonn_balloon2.zip");
}

TEST(PublicRecordings, ThePapersAreEight) {
  const Result<std::vector<PublicRecording>> found = find_public_recordings("tum", "paper");
  ASSERT_TRUE(found.ok());
  EXPECT_EQ(found->size(), 8u);
}

TEST(PublicRecordings, NoTwoAreTheSameAndChecksumsAreWhole) {
  std::set<std::string> names, folders;
  for (const PublicDataset& dataset : public_datasets())
    for (const PublicRecording& r : dataset.recordings) {
      EXPECT_TRUE(names.insert(std::string(dataset.name) + " " + r.short_name).second) << r.short_name;
      EXPECT_TRUE(folders.insert(r.folder).second) << r.folder;
      EXPECT_TRUE(r.sha256.empty() || r.sha256.size() == 64) << r.folder;
      EXPECT_TRUE(
          std::ranges::all_of(r.sha256, [](char c) { return (c >= '0' && c <= '9') || (c >= 'a' && c <= 'f'); }));
    }
  EXPECT_GT(folders.size(), 60u);
}

TEST(PublicRecordings, WhatIsNotThereHasANeighbour) {
  EXPECT_THAT(find_public_recordings("tim", "fr3_walking_xyz").error().message, HasSubstr("'tum'"));
  EXPECT_THAT(find_public_recordings("tum", "fr3_waking_xyz").error().message, HasSubstr("'fr3_walking_xyz'"));
  EXPECT_FALSE(find_public_recordings("bonn", "paper").ok());
  EXPECT_FALSE(find_public_recordings("tum", "").ok());
}

}  // namespace
}  // namespace semvslam
