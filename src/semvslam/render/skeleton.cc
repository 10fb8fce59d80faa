#include "semvslam/render/skeleton.h"

#include <algorithm>
#include <cmath>

namespace semvslam::render {
namespace {

double distance_to_bone(const RestBone& bone, const Eigen::Vector3d& p) {
  const Eigen::Vector3d along = bone.end - bone.joint;
  const double h = std::clamp((p - bone.joint).dot(along) / std::max(along.squaredNorm(), 1e-12), 0.0, 1.0);
  return (p - bone.joint - h * along).norm();
}

bool related(int a, int b) { return rest_bones()[a].parent == b || rest_bones()[b].parent == a; }

SkinWeights strongest(const std::array<double, kBones>& weights) {
  std::array<int, kBones> order;
  for (int i = 0; i < kBones; ++i) order[i] = i;
  std::stable_sort(order.begin(), order.end(), [&](int a, int b) { return weights[a] > weights[b]; });
  SkinWeights out;
  double sum = 0;
  for (int i = 0; i < 4; ++i) sum += weights[order[i]];
  for (int i = 0; i < 4; ++i) {
    out.bones[i] = static_cast<std::uint8_t>(order[i]);
    out.weights[i] = static_cast<float>(weights[order[i]] / sum);
  }
  return out;
}

}  // namespace

Eigen::Vector3d rest_arm_direction(int side) { return {side * std::sin(kArmRaise_rad), 0, -std::cos(kArmRaise_rad)}; }

const std::array<RestBone, kBones>& rest_bones() {
  static const std::array<RestBone, kBones> bones = [] {
    std::array<RestBone, kBones> b;
    b[kPelvis] = {kBones, {0, 0, 0.95}, {0, 0, 1.02}};
    b[kSpine] = {kPelvis, {0, -0.01, 1.05}, {0, -0.01, 1.18}};
    b[kChest] = {kSpine, {0, -0.01, 1.20}, {0, -0.01, 1.42}};
    b[kNeck] = {kChest, {0, -0.015, 1.46}, {0, 0, 1.53}};
    b[kHead] = {kNeck, {0, 0.005, 1.56}, {0, 0.01, 1.70}};
    for (const int side : {1, -1}) {
      const bool right = side > 0;
      const Eigen::Vector3d arm = rest_arm_direction(side), shoulder(side * 0.185, -0.012, 1.405);
      b[right ? kUpperArmR : kUpperArmL] = {kChest, shoulder, shoulder + 0.29 * arm};
      b[right ? kForearmR : kForearmL] = {right ? kUpperArmR : kUpperArmL, shoulder + 0.29 * arm,
                                          shoulder + 0.545 * arm};
      b[right ? kHandR : kHandL] = {right ? kForearmR : kForearmL, shoulder + 0.545 * arm, shoulder + 0.72 * arm};
      const Eigen::Vector3d hip(side * 0.09, 0, 0.92), knee(side * 0.105, 0.005, 0.50),
          ankle(side * 0.115, -0.02, 0.085);
      b[right ? kThighR : kThighL] = {kPelvis, hip, knee};
      b[right ? kShankR : kShankL] = {right ? kThighR : kThighL, knee, ankle};
      b[right ? kFootR : kFootL] = {right ? kShankR : kShankL, ankle,
                                    ankle + Eigen::Vector3d(side * 0.012, 0.17, -0.045)};
    }
    return b;
  }();
  return bones;
}

std::array<BoneMotion, kBones> solve_pose(const BodyPose& pose) {
  std::array<BoneMotion, kBones> out;
  const auto& rest = rest_bones();
  for (int i = 0; i < kBones; ++i) {  // parents come first
    const RestBone& bone = rest[i];
    Eigen::Vector3d joint = pose.pelvis;
    Eigen::Quaterniond turn = pose.turns[i];
    if (bone.parent != kBones) {
      turn = out[bone.parent].turn * turn;
      joint = out[bone.parent] * bone.joint;
    }
    out[i] = {turn.normalized(), joint - turn.normalized() * bone.joint};
  }
  return out;
}

SkinWeights skin_weights(const Eigen::Vector3d& rest_point) {
  const auto& rest = rest_bones();
  // The flesh around a bone, so that the thick torso does not lose points to the thin arm.
  static constexpr double kFlesh_m[kBones] = {0.12,  0.12, 0.14,  0.055, 0.09,  0.045, 0.036, 0.03, 0.045,
                                              0.036, 0.03, 0.075, 0.05,  0.035, 0.075, 0.05,  0.035};
  std::array<double, kBones> distance, weights{};
  int nearest = 0;
  for (int i = 0; i < kBones; ++i) {
    distance[i] = distance_to_bone(rest[i], rest_point) - kFlesh_m[i];
    if (distance[i] < distance[nearest]) nearest = i;
  }
  for (int i = 0; i < kBones; ++i) {
    if (i != nearest && !related(i, nearest)) continue;
    const double blend = i == kPelvis || nearest == kPelvis || i == kChest || nearest == kChest ? 0.085 : 0.055;
    const double w = std::max(0.0, 1.0 - (distance[i] - distance[nearest]) / blend);
    weights[i] = w * w * (3 - 2 * w);
  }
  return strongest(weights);
}

SkinWeights skirt_weights(const Eigen::Vector3d& rest_point) {
  std::array<double, kBones> weights{};
  const double down = std::clamp((0.98 - rest_point.z()) / 0.30, 0.0, 1.0);
  const double right = std::clamp(0.5 + rest_point.x() / 0.22, 0.0, 1.0);
  weights[kPelvis] = 1 - 0.9 * down;
  weights[kThighR] = 0.9 * down * right;
  weights[kThighL] = 0.9 * down * (1 - right);
  return strongest(weights);
}

Skinner::Skinner(const std::array<BoneMotion, kBones>& motions) {
  for (int i = 0; i < kBones; ++i) {
    const Eigen::Quaterniond& q = motions[i].turn;
    const Eigen::Vector3d& t = motions[i].shift;
    const Eigen::Quaterniond d = Eigen::Quaterniond(0, t.x(), t.y(), t.z()) * q;
    duals_[i] = {q.coeffs(), 0.5 * d.coeffs()};
  }
}

void Skinner::apply(const SkinWeights& weights, const Eigen::Vector3d& rest_point, const Eigen::Vector3d& rest_normal,
                    Eigen::Vector3d& point, Eigen::Vector3d& normal) const {
  const Dual& first = duals_[weights.bones[0]];
  Eigen::Vector4d real = Eigen::Vector4d::Zero(), dual = Eigen::Vector4d::Zero();
  for (int i = 0; i < 4 && weights.weights[i] > 1e-4f; ++i) {
    const Dual& d = duals_[weights.bones[i]];
    const double w =
        d.real.dot(first.real) < 0 ? -weights.weights[i] : weights.weights[i];  // the same half of the sphere
    real += w * d.real;
    dual += w * d.dual;
  }
  const double norm = real.norm();
  real /= norm;
  dual /= norm;
  const Eigen::Vector3d r = real.head<3>(), e = dual.head<3>();
  auto turned = [&](const Eigen::Vector3d& p) -> Eigen::Vector3d { return p + 2 * r.cross(r.cross(p) + real.w() * p); };
  point = turned(rest_point) + 2 * (real.w() * e - dual.w() * r + r.cross(e));
  normal = turned(rest_normal);
}

}  // namespace semvslam::render
