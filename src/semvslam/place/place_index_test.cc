#include "semvslam/place/place_index.h"

#include <gtest/gtest.h>

#include "semvslam/base/random.h"

namespace semvslam {
namespace {

class PlaceIndexTest : public testing::Test {
 protected:
  std::vector<Descriptor> place(std::size_t corners) {
    std::vector<Descriptor> out;
    for (std::size_t i = 0; i < corners; ++i) out.push_back({random_(), random_(), random_(), random_()});
    return out;
  }
  /// The same corners from elsewhere: about so many bits of each differ, and a share of the corners is new.
  std::vector<Descriptor> seen_again(std::vector<Descriptor> of, int bits, double fresh) {
    for (Descriptor& d : of) {
      for (int b = 0; b < bits; ++b) d[random_.index(4)] ^= std::uint64_t{1} << random_.index(64);
      if (random_.chance(fresh)) d = {random_(), random_(), random_(), random_()};
    }
    return of;
  }

  PlaceIndex index_;
  Random random_{7, "test"};
};

TEST_F(PlaceIndexTest, ThePlaceIsFoundAmongManyByFewOfItsCorners) {
  std::vector<std::vector<Descriptor>> places;
  for (std::uint32_t i = 0; i < 200; ++i) {
    places.push_back(place(500));
    index_.add(KeyFrameId(i), places.back());
  }
  EXPECT_EQ(index_.size(), 200u);
  for (const std::uint32_t i : {0u, 63u, 199u}) {
    const std::vector<PlaceScore> found = index_.query(seen_again(places[i], 26, 0.6));
    ASSERT_GT(found.size(), 1u);
    EXPECT_EQ(found[0].key_frame, KeyFrameId(i));
    EXPECT_GT(found[0].score, 1.3 * found[1].score);
  }
}

TEST_F(PlaceIndexTest, WhatAllHaveSaysLittle) {
  const std::vector<Descriptor> everywhere = place(150), here = place(40), there = place(40);
  for (std::uint32_t i = 0; i < 50; ++i) {
    std::vector<Descriptor> both = everywhere;
    const std::vector<Descriptor> own = i == 20 ? here : place(40);
    both.insert(both.end(), own.begin(), own.end());
    index_.add(KeyFrameId(i), both);
  }
  std::vector<Descriptor> asked = here;
  asked.insert(asked.end(), everywhere.begin(), everywhere.begin() + 100);
  EXPECT_EQ(index_.query(asked)[0].key_frame, KeyFrameId(20));
}

TEST_F(PlaceIndexTest, RemovedKeyFramesAreNotFound) {
  const std::vector<Descriptor> a = place(100), b = place(100);
  index_.add(KeyFrameId(1), a);
  index_.add(KeyFrameId(2), b);
  index_.remove(KeyFrameId(1));
  index_.remove(KeyFrameId(77));
  for (const PlaceScore& s : index_.query(a)) EXPECT_NE(s.key_frame, KeyFrameId(1));
  EXPECT_EQ(index_.size(), 1u);
  index_.add(KeyFrameId(2), a);  // in place of b
  ASSERT_EQ(index_.query(a).size(), 1u);
  EXPECT_TRUE(index_.query(b).empty() || index_.query(b)[0].score < 0.2 * index_.query(a)[0].score);
}

TEST_F(PlaceIndexTest, NothingLooksLikeNothing) {
  EXPECT_TRUE(index_.query(place(10)).empty());
  index_.add(KeyFrameId(3), {});
  EXPECT_TRUE(index_.query(place(10)).empty());
  EXPECT_TRUE(index_.query({}).empty());
  EXPECT_EQ(index_.size(), 1u);
}

}  // namespace
}  // namespace semvslam
