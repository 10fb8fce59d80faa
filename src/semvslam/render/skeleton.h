#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <array>
#include <vector>

namespace semvslam::render {

/// Bones of a person. Person frame: metres, origin on the floor under the pelvis, x to the person's right, y forward, z
/// up.
enum Bone {
  kPelvis,
  kSpine,
  kChest,
  kNeck,
  kHead,
  kUpperArmR,
  kForearmR,
  kHandR,
  kUpperArmL,
  kForearmL,
  kHandL,
  kThighR,
  kShankR,
  kFootR,
  kThighL,
  kShankL,
  kFootL,
  kBones
};

/// The resting body: upright, legs a little apart, arms held out and down, 1.75 m tall. Other sizes are scaled copies.
struct RestBone {
  Bone parent;
  Eigen::Vector3d joint;  // where it turns
  Eigen::Vector3d end;    // for skinning: the bone is the line from joint to end
};
const std::array<RestBone, kBones>& rest_bones();

/// Unit direction of a resting arm, from shoulder to hand. @param side +1 right, -1 left.
Eigen::Vector3d rest_arm_direction(int side);
/// The angle by which a resting arm is to be brought in to hang down, radians.
constexpr double kArmRaise_rad = 0.6981317;  // 40 degrees

/// Turns of all bones relative to their parents (axes of the person frame at rest) and where the pelvis is.
struct BodyPose {
  std::array<Eigen::Quaterniond, kBones> turns;
  Eigen::Vector3d pelvis = Eigen::Vector3d::Zero();  // of the pelvis joint in the person frame of the reference size

  BodyPose() { turns.fill(Eigen::Quaterniond::Identity()); }
};

/// person_posed_from_person_rest of each bone.
struct BoneMotion {
  Eigen::Quaterniond turn;
  Eigen::Vector3d shift;
  Eigen::Vector3d operator*(const Eigen::Vector3d& p) const { return turn * p + shift; }
};
std::array<BoneMotion, kBones> solve_pose(const BodyPose& pose);

/// How strongly each of up to four bones moves a point of the resting body. Weights sum to 1.
struct SkinWeights {
  std::array<std::uint8_t, 4> bones{};
  std::array<float, 4> weights{};
};
SkinWeights skin_weights(const Eigen::Vector3d& rest_point);
/// For a hem that both legs push: weights of pelvis and thighs.
SkinWeights skirt_weights(const Eigen::Vector3d& rest_point);

/// Blends bones as dual quaternions (Kavan et al. 2007), so that bent joints keep their volume.
class Skinner {
 public:
  explicit Skinner(const std::array<BoneMotion, kBones>& motions);
  /// Moves a point and turns its normal.
  void apply(const SkinWeights& weights, const Eigen::Vector3d& rest_point, const Eigen::Vector3d& rest_normal,
             Eigen::Vector3d& point, Eigen::Vector3d& normal) const;

 private:
  struct Dual {
    Eigen::Vector4d real, dual;  // x y z w
  };
  std::array<Dual, kBones> duals_;
};

}  // namespace semvslam::render
