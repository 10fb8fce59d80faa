#include "semvslam/render/gait.h"

#include <algorithm>
#include <cmath>

#include "semvslam/render/degree.h"

namespace semvslam::render {
namespace {

using Eigen::AngleAxisd;
using Eigen::Quaterniond;
using Eigen::Vector3d;

constexpr int kSamples = 20;  // of one gait cycle, from heel strike

// Degrees, flexion (dorsiflexion) positive.
constexpr double kHip_deg[kSamples] = {30, 29, 26, 22, 18, 13, 8, 3, -1, -5, -8, -10, -8, -2, 6, 15, 23, 29, 32, 32};
constexpr double kKnee_deg[kSamples] = {5, 10, 16, 18, 16, 12, 8, 6, 6, 9, 14, 24, 37, 50, 59, 60, 52, 37, 20, 8};
constexpr double kAnkle_deg[kSamples] = {0, -5, -4, 0, 3, 5, 7, 8, 9, 10, 9, 3, -10, -18, -15, -8, -2, 0, 1, 1};

/// Periodic cubic (Catmull-Rom) through the samples.
double curve(const double (&samples)[kSamples], double cycle) {
  const double x = (cycle - std::floor(cycle)) * kSamples;
  const int i = static_cast<int>(x) % kSamples;
  const double t = x - std::floor(x);
  auto at = [&](int k) { return samples[((i + k) % kSamples + kSamples) % kSamples]; };
  const double a = at(-1), b = at(0), c = at(1), d = at(2);
  return b + 0.5 * t * (c - a + t * (2 * a - 5 * b + 4 * c - d + t * (3 * (b - c) + d - a)));
}

Quaterniond about_x(double angle) { return Quaterniond(AngleAxisd(angle, Vector3d::UnitX())); }
Quaterniond about_y(double angle) { return Quaterniond(AngleAxisd(angle, Vector3d::UnitY())); }
Quaterniond about_z(double angle) { return Quaterniond(AngleAxisd(angle, Vector3d::UnitZ())); }

/// Upper arm: `swing` forward, `abduction` away from the body; forearm: `flexion`; all radians. `inward` turns the
/// forearm towards the middle.
void set_arm(BodyPose& pose, int side, double swing, double abduction, double flexion, double inward = 0) {
  const bool right = side > 0;
  pose.turns[right ? kUpperArmR : kUpperArmL] =
      about_x(swing) * about_z(side * inward) * about_y(side * (kArmRaise_rad - abduction));
  const Vector3d elbow_axis(std::cos(kArmRaise_rad), 0, side * std::sin(kArmRaise_rad));
  pose.turns[right ? kForearmR : kForearmL] = Quaterniond(AngleAxisd(flexion, elbow_axis));
}

/// Moves the body so that the lowest point of the soles touches the floor.
void stand_on_floor(BodyPose& pose) {
  const auto motions = solve_pose(pose);
  double lowest = 1e9;
  for (const int side : {1, -1}) {
    const BoneMotion& foot = motions[side > 0 ? kFootR : kFootL];
    for (const Vector3d& p : {Vector3d(side * 0.115, -0.088, 0.004), Vector3d(side * 0.125, 0.10, 0),
                              Vector3d(side * 0.128, 0.188, 0.004)}) {
      lowest = std::min(lowest, (foot * p).z());
    }
  }
  pose.pelvis.z() -= lowest;
}

}  // namespace

BodyPose walking_pose(double cycle, double vigour, ArmTask arms, double head_yaw_rad, double head_pitch_rad) {
  BodyPose pose;
  const double wave = 2 * M_PI * cycle;
  const double pelvis_yaw = 4.5 * kDegree * vigour * std::cos(wave), list = 3.5 * kDegree * vigour * std::sin(wave);
  pose.pelvis = rest_bones()[kPelvis].joint + Vector3d(-0.018 * vigour * std::sin(wave), 0, 0);
  pose.turns[kPelvis] = about_z(pelvis_yaw) * about_y(-list);
  pose.turns[kSpine] = about_z(-0.9 * pelvis_yaw) * about_y(0.7 * list) * about_x(-2.0 * kDegree);
  pose.turns[kChest] = about_z(-1.0 * pelvis_yaw) * about_y(0.3 * list) * about_x(-1.0 * kDegree);
  pose.turns[kNeck] = about_z(0.6 * pelvis_yaw + 0.4 * head_yaw_rad) * about_x(1.0 * kDegree - 0.4 * head_pitch_rad);
  pose.turns[kHead] = about_z(0.3 * pelvis_yaw + 0.6 * head_yaw_rad) * about_x(2.0 * kDegree - 0.6 * head_pitch_rad);
  for (const int side : {1, -1}) {
    const bool right = side > 0;
    const double own = right ? cycle : cycle + 0.5;
    const double hip = vigour * curve(kHip_deg, own) + (1 - vigour) * 2.0,
                 knee = vigour * curve(kKnee_deg, own) + (1 - vigour) * 4.0;
    const double ankle = vigour * curve(kAnkle_deg, own) + (1 - vigour) * 2.0;
    pose.turns[right ? kThighR : kThighL] = about_x(hip * kDegree) * about_y(side * (2.5 * kDegree) + list);
    pose.turns[right ? kShankR : kShankL] = about_x(-knee * kDegree);
    pose.turns[right ? kFootR : kFootL] = about_x(ankle * kDegree) * about_z(-side * 6 * kDegree);
    if (arms == ArmTask::kCarryBoth) {
      set_arm(pose, side, 20 * kDegree, 5 * kDegree, (72 + 2 * vigour * std::sin(2 * wave)) * kDegree);
    } else if (arms == ArmTask::kPullRight && right) {
      set_arm(pose, side, -10 * kDegree, 14 * kDegree, 8 * kDegree);
    } else {
      const double swing = -std::cos(2 * M_PI * own);  // against the leg of the same side
      set_arm(pose, side, (-4 + 21 * vigour * swing + 4 * (1 - vigour)) * kDegree, 6 * kDegree,
              (14 + vigour * (10 + 12 * swing)) * kDegree, 0.1);
    }
  }
  stand_on_floor(pose);
  return pose;
}

BodyPose sitting_pose(const SittingState& state, double seat_height_m) {
  BodyPose pose;
  constexpr double kThigh_m = 0.42, kShankAndFoot_m = 0.505, kHipBelowPelvis_m = 0.03, kFleshUnderPelvis_m = 0.115;
  const double recline = 4 * kDegree + state.torso_pitch_rad * 0.3;
  pose.pelvis = Vector3d(0, -0.03, seat_height_m + kFleshUnderPelvis_m);
  pose.turns[kPelvis] = about_x(recline);
  pose.turns[kSpine] = about_z(0.4 * state.torso_yaw_rad) * about_x(0.4 * state.torso_pitch_rad - 3 * kDegree) *
                       about_y(0.5 * state.torso_roll_rad);
  pose.turns[kChest] = about_z(0.6 * state.torso_yaw_rad) * about_x(0.6 * state.torso_pitch_rad - 4 * kDegree) *
                       about_y(0.5 * state.torso_roll_rad);
  pose.turns[kNeck] = about_z(0.4 * state.head_yaw_rad) * about_x(-0.4 * state.head_pitch_rad);
  pose.turns[kHead] = about_z(0.6 * state.head_yaw_rad) * about_x(3 * kDegree - 0.6 * state.head_pitch_rad);
  // The thigh's slope that puts the soles on the floor with the shank upright.
  const double drop = pose.pelvis.z() - kHipBelowPelvis_m - kShankAndFoot_m;
  const double hip = std::acos(std::clamp(drop / kThigh_m, -0.3, 0.9));
  for (const int side : {1, -1}) {
    const bool right = side > 0;
    pose.turns[right ? kThighR : kThighL] = about_x(hip - recline) * about_y(-side * 5 * kDegree);
    pose.turns[right ? kShankR : kShankL] = about_x(-(hip - (right ? 3 : -8) * kDegree));
    pose.turns[right ? kFootR : kFootL] = about_x((right ? -3 : 8) * kDegree);
    const double raised = state.arms[right ? 0 : 1];
    set_arm(pose, side, (30 + 22 * raised) * kDegree, (12 + 8 * raised) * kDegree, (62 + 46 * raised) * kDegree,
            (0.35 - 0.2 * raised));
  }
  return pose;
}

}  // namespace semvslam::render
