#pragma once

#include "semvslam/render/skeleton.h"

namespace semvslam::render {

/// What the arms do.
enum class ArmTask { kSwing, kCarryBoth, kPullRight };

/// Metres walked per gait cycle (two steps) of the reference body at a stroll.
constexpr double kStride_m = 1.22;

/// A moment of walking; joint angles of level walking after the normal curves in D. A. Winter, "Biomechanics and Motor
/// Control of Human Movement". @param cycle gait cycles so far, 0 = right heel strike. @param vigour 0 = standing, 1 =
/// full stride. The lowest point of the shoes is on the floor.
BodyPose walking_pose(double cycle, double vigour, ArmTask arms, double head_yaw_rad, double head_pitch_rad);

/// How somebody sits: slow movements in radians; arms[0] right, arms[1] left: 0 = on the table, 1 = raised in a
/// gesture.
struct SittingState {
  double torso_yaw_rad = 0, torso_pitch_rad = 0, torso_roll_rad = 0, head_yaw_rad = 0, head_pitch_rad = 0;
  std::array<double, 2> arms{0, 0};
};
/// @param seat_height_m in the reference body's metres.
BodyPose sitting_pose(const SittingState& state, double seat_height_m);

}  // namespace semvslam::render
