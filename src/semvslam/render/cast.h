#pragma once

#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include "semvslam/render/contact_shadow.h"
#include "semvslam/render/gait.h"
#include "semvslam/render/light_bake.h"
#include "semvslam/render/person.h"
#include "semvslam/render/plan_path.h"
#include "semvslam/render/room.h"

namespace semvslam::render {

/// The closed way around the desks on which people walk.
PlanPath walkers_way();

/// The people of a scene and what they carry: who they are, where they are at a time, and their meshes.
class Cast {
 public:
  struct Role {
    std::string name;
    bool person = false;
  };

  /// @param people as SceneOptions::people, already checked. Adds textures and carried things to `builder`.
  Cast(const std::string& people, std::uint64_t seed, const std::vector<Seat>& seats, SceneBuilder& builder,
       int threads);

  /// Takes the carried things out of the finished scene: they move by themselves.
  void take_items(StaticScene& scene);
  const std::vector<Role>& roles() const { return roles_; }

  /// Meshes at a time, role numbers set (1 + index into roles()), and what darkens the floor. @param eye near it the
  /// finer surfaces are used.
  void arrange(double time_s, const Eigen::Vector3d& eye, const LightModel& light, std::vector<Mesh>& meshes,
               std::vector<Occluder>& occluders, int threads) const;

 private:
  enum class Item { kNone, kCarton, kSuitcase, kChair };
  struct Member {
    std::unique_ptr<Person> person;
    bool walks = false;
    Seat seat;
    double start_m = 0;  // on the way
    Item item = Item::kNone;
    std::size_t item_mesh = 0;
    Mesh item_shape;  // in the carrier's frame of the reference size
    std::array<double, 12> phases{};
    int role = 0, item_role = 0;
  };
  struct Placement {
    SE3 world_from_person;
    BodyPose pose;
  };
  Placement walker(const Member& member, double time_s) const;
  Placement sitter(const Member& member, double time_s) const;
  double walked_m(double time_s) const;
  void build_item(Member& member, SceneBuilder& builder, std::uint64_t seed);
  void arrange(const Member& member, double time_s, const Eigen::Vector3d& eye, const LightModel& light,
               std::vector<Mesh>& meshes, std::vector<Occluder>& occluders) const;
  static void add_occluders(const Placement& placement, const std::array<BoneMotion, kBones>& motions, double scale,
                            std::vector<Occluder>& out);

  std::vector<Member> members_;
  std::vector<Role> roles_;
  PlanPath way_;
  double pace_phase_ = 0;
};

}  // namespace semvslam::render
