#include "semvslam/dynamic/instance_rest.h"

#include <gtest/gtest.h>

namespace semvslam {
namespace {

Instance person_at(int x_px, TrackId track = {}) {
  Instance person;
  person.class_name = "person";
  person.role = Role::kDynamic;
  person.window = cv::Rect(x_px, 50, 60, 150);
  person.track = track;
  return person;
}

InstanceMotion points(int moving, int at_rest) {
  InstanceMotion motion;
  motion.moving = moving;
  motion.at_rest = at_rest;
  return motion;
}

class InstanceRestTest : public ::testing::Test {
 protected:
  void see(const Instance& instance, const InstanceMotion& motion, double until_s) {
    for (; time_s < until_s; time_s += 1.0 / 30) rest.update({&instance, 1}, {&motion, 1}, time_s);
  }
  InstanceRest rest{2.0};
  double time_s = 100;
};

TEST_F(InstanceRestTest, WhoKeepsStillLongEnoughRestsUntilSheMoves) {
  const Instance person = person_at(100);
  see(person, points(0, 20), 101.9);
  EXPECT_FALSE(rest.rests(person)) << "not for long enough";
  see(person, points(1, 20), 102.2);  // one point alone may be an error
  EXPECT_TRUE(rest.rests(person));
  EXPECT_FALSE(rest.rests(person_at(400))) << "another place is another person";
  see(person, points(3, 20), time_s + 0.01);
  EXPECT_FALSE(rest.rests(person)) << "one frame is enough";
  EXPECT_FALSE(rest.is_worth_watching(person, time_s)) << "what she is doing is known";
  EXPECT_TRUE(rest.is_worth_watching(person, time_s + 0.6));
  see(person, points(0, 20), time_s + 1.9);
  EXPECT_FALSE(rest.rests(person)) << "the time starts anew";
  see(person, points(0, 20), time_s + 0.2);
  EXPECT_TRUE(rest.rests(person));
}

TEST_F(InstanceRestTest, WithoutEvidenceNobodyRests) {
  const Instance person = person_at(100);
  see(person, points(0, 7), 105);
  EXPECT_FALSE(rest.rests(person));
}

TEST_F(InstanceRestTest, ATrackedPersonIsKnownByHerTrackAndOthersAreNot) {
  see(person_at(100, TrackId(3)), points(0, 20), 103);
  EXPECT_TRUE(rest.rests(person_at(200, TrackId(3)))) << "the camera turned";
  EXPECT_FALSE(rest.rests(person_at(100, TrackId(4)))) << "somebody else stands there";
}

TEST_F(InstanceRestTest, WhoWasAwayForLongIsNew) {
  const Instance person = person_at(100);
  see(person, points(0, 20), 103);
  time_s += 1.5;
  see(person, points(0, 20), time_s + 0.01);
  EXPECT_TRUE(rest.rests(person)) << "seen again before she was forgotten";
  const Instance other = person_at(400);
  see(other, points(0, 20), time_s + 1.5);
  EXPECT_FALSE(rest.rests(person)) << "forgotten while another was seen";
}

TEST(InstanceRest, SwitchedOffNobodyRestsOrIsWatched) {
  InstanceRest rest(0);
  const Instance person = person_at(100);
  const InstanceMotion still = points(0, 50);
  for (int i = 0; i < 100; ++i) rest.update({&person, 1}, {&still, 1}, i);
  EXPECT_FALSE(rest.rests(person));
  EXPECT_FALSE(rest.is_worth_watching(person, 100));
}

}  // namespace
}  // namespace semvslam
