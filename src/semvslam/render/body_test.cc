#include <gtest/gtest.h>

#include <cmath>
#include <map>

#include "semvslam/render/gait.h"
#include "semvslam/render/implicit.h"
#include "semvslam/render/plan_path.h"
#include "semvslam/render/random.h"

namespace semvslam::render {
namespace {

TEST(ImplicitShape, SphereBecomesAClosedSurfaceAtItsRadius) {
  ImplicitShape shape;
  shape.ellipsoid({0.1f, -0.2f, 0.3f}, {0.1f, 0.1f, 0.1f}, 0.01f);
  const ShapeMesh mesh = polygonise(shape, 0.015f);
  ASSERT_GT(mesh.triangles.size(), 100u);
  std::map<std::pair<std::uint32_t, std::uint32_t>, int> edges;
  double volume = 0;
  for (std::size_t i = 0; i < mesh.vertices.size(); ++i) {
    const Eigen::Vector3f from = mesh.vertices[i] - Eigen::Vector3f(0.1f, -0.2f, 0.3f);
    EXPECT_NEAR(from.norm(), 0.1f, 5e-4f);
    EXPECT_GT(from.normalized().dot(mesh.normals[i]), 0.999f);
  }
  for (const auto& t : mesh.triangles) {
    for (int i = 0; i < 3; ++i) ++edges[{t[i], t[(i + 1) % 3]}];
    volume += mesh.vertices[t[0]].cross(mesh.vertices[t[1]]).dot(mesh.vertices[t[2]]) / 6.0;
  }
  for (const auto& [edge, count] : edges) {
    EXPECT_EQ(count, 1);
    EXPECT_EQ(edges.count({edge.second, edge.first}), 1u);  // each edge once in each direction: closed and oriented
  }
  EXPECT_NEAR(volume, 4.0 / 3 * M_PI * 1e-3, 1e-4);  // positive: outside is outside
}

TEST(Skeleton, RestPoseMovesNothing) {
  BodyPose pose;
  pose.pelvis = rest_bones()[kPelvis].joint;
  const Skinner skinner(solve_pose(pose));
  RandomStream random(4);
  for (int i = 0; i < 200; ++i) {
    const Eigen::Vector3d p(random.uniform(-0.6, 0.6), random.uniform(-0.2, 0.2), random.uniform(0, 1.8));
    Eigen::Vector3d moved, normal;
    skinner.apply(skin_weights(p), p, Eigen::Vector3d::UnitX(), moved, normal);
    EXPECT_LT((moved - p).norm(), 1e-9);
    EXPECT_LT((normal - Eigen::Vector3d::UnitX()).norm(), 1e-9);
  }
}

TEST(Skeleton, WeightsSumToOneAndVarySmoothly) {
  for (const auto& line : {std::pair<Eigen::Vector3d, Eigen::Vector3d>{{0.1, 0.03, 0.9}, {0.11, 0.0, 0.05}},
                           std::pair<Eigen::Vector3d, Eigen::Vector3d>{{0.19, 0, 1.4}, {0.6, 0, 0.92}}}) {
    std::array<float, kBones> last{};
    constexpr int kSteps = 400;
    for (int i = 0; i <= kSteps; ++i) {
      const SkinWeights w = skin_weights(line.first + (line.second - line.first) * i / kSteps);
      std::array<float, kBones> now{};
      float sum = 0;
      for (int k = 0; k < 4; ++k) {
        now[w.bones[k]] += w.weights[k];
        sum += w.weights[k];
      }
      EXPECT_NEAR(sum, 1.f, 1e-5f);
      for (int b = 0; i > 0 && b < kBones; ++b)
        EXPECT_LT(std::abs(now[b] - last[b]), 0.12f) << "bone " << b << " step " << i;
      last = now;
    }
  }
}

TEST(Skeleton, DualQuaternionSkinningTurnsRigidPartsRigidly) {
  BodyPose pose;
  pose.pelvis = rest_bones()[kPelvis].joint;
  pose.turns[kForearmR] = Eigen::AngleAxisd(1.2, Eigen::Vector3d(std::cos(kArmRaise_rad), 0, std::sin(kArmRaise_rad)));
  const auto motions = solve_pose(pose);
  const Skinner skinner(motions);
  const Eigen::Vector3d elbow = rest_bones()[kForearmR].joint, wrist = rest_bones()[kForearmR].end;
  EXPECT_LT((motions[kForearmR] * elbow - elbow).norm(), 1e-12);
  Eigen::Vector3d moved, normal;
  const Eigen::Vector3d half = (elbow + wrist) / 2;
  skinner.apply(skin_weights(half), half, Eigen::Vector3d::UnitY(), moved, normal);
  EXPECT_LT((moved - motions[kForearmR] * half).norm(), 1e-6);
  EXPECT_GT(moved.y(), half.y() + 0.05) << "bending the elbow brings the forearm forward";
}

double lowest_sole(const BodyPose& pose, Bone foot, int side) {
  const auto motions = solve_pose(pose);
  double z = 1e9;
  for (const Eigen::Vector3d& p : {Eigen::Vector3d(side * 0.115, -0.088, 0.004), Eigen::Vector3d(side * 0.125, 0.1, 0),
                                   Eigen::Vector3d(side * 0.128, 0.188, 0.004)}) {
    z = std::min(z, (motions[foot] * p).z());
  }
  return z;
}

TEST(Gait, OneFootIsAlwaysOnTheFloorAndTheOtherSwings) {
  double highest = 0;
  for (int i = 0; i < 100; ++i) {
    const BodyPose pose = walking_pose(i / 100.0, 1.0, ArmTask::kSwing, 0, 0);
    const double right = lowest_sole(pose, kFootR, 1), left = lowest_sole(pose, kFootL, -1);
    EXPECT_NEAR(std::min(right, left), 0.0, 1e-9);
    highest = std::max(highest, std::max(right, left));
  }
  EXPECT_GT(highest, 0.04);
  EXPECT_LT(highest, 0.25);
}

TEST(Gait, LegsAreHalfACycleApartAndStepsFitTheStride) {
  const auto early = solve_pose(walking_pose(0.1, 1.0, ArmTask::kSwing, 0, 0)),
             late = solve_pose(walking_pose(0.6, 1.0, ArmTask::kSwing, 0, 0));
  const Eigen::Vector3d right = early[kFootR] * rest_bones()[kFootR].joint,
                        left = late[kFootL] * rest_bones()[kFootL].joint;
  EXPECT_NEAR(right.y(), left.y(), 1e-6);
  EXPECT_NEAR(right.x(), -left.x(), 1e-6);
  // During stance the foot goes back under the body as fast as the body goes forward: else shoes would slide.
  const auto start = solve_pose(walking_pose(0.08, 0.92, ArmTask::kSwing, 0, 0)),
             end = solve_pose(walking_pose(0.42, 0.92, ArmTask::kSwing, 0, 0));
  const double back = (start[kFootR] * rest_bones()[kFootR].joint).y() - (end[kFootR] * rest_bones()[kFootR].joint).y();
  EXPECT_NEAR(back, 0.34 * kStride_m, 0.12);
}

TEST(Gait, ArmsSwingAgainstTheLegs) {
  const auto motions = solve_pose(walking_pose(0.0, 1.0, ArmTask::kSwing, 0, 0));  // right heel strikes
  EXPECT_GT((motions[kFootR] * rest_bones()[kFootR].joint).y(),
            (motions[kFootL] * rest_bones()[kFootL].joint).y() + 0.3);
  EXPECT_LT((motions[kHandR] * rest_bones()[kHandR].joint).y(),
            (motions[kHandL] * rest_bones()[kHandL].joint).y() - 0.2);
}

TEST(Gait, SeatedFeetRestOnTheFloor) {
  for (const double seat_m : {0.42, 0.46, 0.5}) {
    const BodyPose pose = sitting_pose({}, seat_m);
    EXPECT_NEAR(lowest_sole(pose, kFootR, 1), 0.0, 0.05) << seat_m;
    EXPECT_NEAR(lowest_sole(pose, kFootL, -1), 0.0, 0.05) << seat_m;
    const auto motions = solve_pose(pose);
    EXPECT_NEAR((motions[kHead] * rest_bones()[kHead].end).z(), seat_m + 0.86, 0.06);
  }
}

TEST(PlanPath, ClosedSmoothAndParameterisedByLength) {
  const PlanPath path({{0, 0}, {4, 0}, {4, 3}, {0, 3}}, 0.5);
  EXPECT_NEAR(path.length_m(), 14 - 8 * 0.5 + M_PI, 1e-9);
  const double step = 0.01;
  for (double s = -1; s < path.length_m() + 1; s += step) {
    const Eigen::Vector2d move = path.position(s + step) - path.position(s);
    EXPECT_NEAR(move.norm(), step, 1e-5);
    EXPECT_GT(move.normalized().dot(Eigen::Vector2d(std::cos(path.heading_rad(s)), std::sin(path.heading_rad(s)))),
              0.9998);
  }
}

}  // namespace
}  // namespace semvslam::render
