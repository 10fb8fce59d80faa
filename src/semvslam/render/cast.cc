#include "semvslam/render/cast.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "semvslam/render/furniture.h"
#include "semvslam/render/noise.h"
#include "semvslam/render/paint.h"
#include "semvslam/render/parallel.h"

namespace semvslam::render {
namespace {

constexpr double kMeanPace_m_s = 0.64, kPaceRipple = 0.94, kPacePeriod_s = 12.0;
constexpr double kFineDistance_m = 2.1;

/// Smooth, zero-mean, about [-1, 1].
double drift(double time_s, double frequency_hz, double phase) {
  const double w = 2 * M_PI * frequency_hz * time_s;
  return 0.65 * std::sin(w + phase) + 0.35 * std::sin(1.73 * w + 2.1 * phase);
}

/// 0 most of the time, smoothly 1 now and then.
double now_and_then(double time_s, double frequency_hz, double phase) {
  const double x = drift(time_s, frequency_hz, phase);
  const double t = std::clamp((x - 0.25) / 0.45, 0.0, 1.0);
  return t * t * (3 - 2 * t);
}

}  // namespace

PlanPath walkers_way() {
  return PlanPath({{kWalkWest_m, kWalkSouth_m},
                   {kWalkEast_m, kWalkSouth_m},
                   {kWalkEast_m, kWalkNorth_m},
                   {kWalkWest_m, kWalkNorth_m}},
                  0.62);
}

Cast::Cast(const std::string& people, std::uint64_t seed, const std::vector<Seat>& seats, SceneBuilder& builder,
           int threads)
    : way_(walkers_way()) {
  RandomStream random(mix64(seed, 99));
  pace_phase_ = random.uniform(0, 2 * M_PI);
  const double start = random.uniform(0, way_.length_m());
  const int walkers = people == "walking" || people == "carrying" ? 2 : 0;
  const int sitters = people == "none" ? 0 : people == "sitting" ? 3 : 1;
  const Item items[] = {Item::kCarton, Item::kSuitcase, Item::kChair};
  const int first_item = random.below(3);
  for (int i = 0; i < walkers + sitters; ++i) {
    Member member;
    member.walks = i < walkers;
    for (double& phase : member.phases) phase = random.uniform(0, 2 * M_PI);
    if (member.walks) member.start_m = start + way_.length_m() * i / walkers;
    // With walkers about, the seat at the far side of the desks; otherwise both seats at the desks, then the sofa.
    else
      member.seat = i - walkers < 2 ? seats[i - walkers] : seats.back();
    PersonLook look = random_look(mix64(seed, 500 + i));
    member.person = std::make_unique<Person>(look, builder, threads);
    roles_.push_back({fmt::format("person_{}", i + 1), true});
    member.role = static_cast<int>(roles_.size());
    if (people == "carrying" && member.walks) member.item = items[(first_item + i) % 3];
    members_.push_back(std::move(member));
  }
  int number = 0;
  for (Member& member : members_) {
    if (member.item == Item::kNone) continue;
    build_item(member, builder, mix64(seed, 700 + number));
    const char* const names[] = {"", "carton", "suitcase", "chair"};
    roles_.push_back({fmt::format("{}_{}", names[static_cast<int>(member.item)], ++number), false});
    member.item_role = static_cast<int>(roles_.size());
  }
}

void Cast::build_item(Member& member, SceneBuilder& builder, std::uint64_t seed) {
  RandomStream random(seed);
  builder.begin_mesh();
  member.item_mesh = builder.mesh_index();
  auto plain = [&](const cv::Vec3f& tone) {
    return Skin{builder.add_texture([tone, s = random.bits32()] {
                  return paint_material({256, 256}, tone, 0.3f, s);
                }),
                {0.4, 0.4},
                {0, 0},
                false};
  };
  if (member.item == Item::kCarton) {
    const Skin skin{builder.add_texture([s = random.bits()] {
                      return paint_cardboard({512, 512}, s);
                    }),
                    {0, 0},
                    {0, 0},
                    false};
    builder.box(on_plan(0, 0.44, 1.01), {0.36, 0.30, 0.26}, skin);
  } else if (member.item == Item::kSuitcase) {
    const double value = random.uniform(0.3, 0.7), hue = random.uniform();
    const Skin shell = plain(hue_colour(hue, 0.7, value)), dark = plain({45, 42, 40});
    const SE3 here = on_plan(0.31, -0.10, 0.05);
    builder.box(here, {0.23, 0.40, 0.56}, shell);
    for (int i = 0; i < 5; ++i) builder.box(here * on_plan(0, -0.16 + 0.08 * i, 0.02), {0.25, 0.02, 0.52}, shell);
    for (const double y : {-0.15, 0.15}) {
      builder.box(here * on_plan(0, y * 0.6, 0.56), {0.012, 0.012, 0.14}, dark);
      for (const double x : {-0.08, 0.08}) builder.box(here * on_plan(x, y, -0.05), {0.025, 0.05, 0.05}, dark);
    }
    builder.box(here * on_plan(0, 0, 0.69), {0.03, 0.22, 0.025}, dark);
  } else {
    const Skin wood{builder.add_texture([s = random.bits32()] {
                      return paint_wood({256, 256}, {60, 100, 150}, 1, s);
                    }),
                    {0.4, 0.4},
                    {0, 0},
                    true};
    const SE3 here = on_plan(0, 0.46, 0.56, 180);
    builder.box(here * on_plan(0, 0, 0.44), {0.38, 0.38, 0.03}, wood);
    for (const double x : {-0.165, 0.165}) {
      builder.box(here * on_plan(x, -0.165), {0.035, 0.035, 0.44}, wood);
      builder.box(here * on_plan(x, 0.17), {0.035, 0.03, 0.88}, wood);
      builder.box(here * on_plan(x, 0, 0.2), {0.02, 0.3, 0.025}, wood);
    }
    for (const double z : {0.6, 0.7, 0.8}) builder.box(here * on_plan(0, 0.17, z), {0.3, 0.018, 0.055}, wood);
  }
}

void Cast::take_items(StaticScene& scene) {
  for (Member& member : members_) {
    if (member.item == Item::kNone) continue;
    member.item_shape = std::move(scene.meshes[member.item_mesh]);
    scene.meshes[member.item_mesh] = Mesh();
    std::erase_if(scene.vertex_normals, [&](const VertexNormals& part) { return part.mesh == member.item_mesh; });
    for (Triangle& t : member.item_shape.triangles) t.lighting = Lighting::kVertex;
  }
}

double Cast::walked_m(double time_s) const {
  const double w = 2 * M_PI / kPacePeriod_s;  // they hesitate and go on, all at the same time: nobody runs into anybody
  return kMeanPace_m_s * (time_s - kPaceRipple / w * (std::sin(w * time_s + pace_phase_) - std::sin(pace_phase_)));
}

Cast::Placement Cast::walker(const Member& member, double time_s) const {
  const double along = member.start_m + walked_m(time_s);
  const Eigen::Vector2d here = way_.position(along), behind = way_.position(along - 0.22),
                        ahead = way_.position(along + 0.30);
  const double heading = std::atan2(ahead.y() - behind.y(), ahead.x() - behind.x());
  const double pace = kMeanPace_m_s * (1 - kPaceRipple * std::cos(2 * M_PI / kPacePeriod_s * time_s + pace_phase_));
  const double vigour = 0.92 * smooth_step(0.02f, 0.55f, static_cast<float>(pace));
  const ArmTask task = member.item == Item::kNone       ? ArmTask::kSwing
                       : member.item == Item::kSuitcase ? ArmTask::kPullRight
                                                        : ArmTask::kCarryBoth;
  const double look_around = 1 - vigour;
  const double yaw = (0.25 + 0.5 * look_around) * drift(time_s, 0.13, member.phases[0]),
               pitch = 0.12 + 0.12 * drift(time_s, 0.1, member.phases[1]);
  Placement out;
  out.pose = walking_pose(along / (kStride_m * member.person->scale()) + member.phases[2], vigour, task, yaw, pitch);
  out.world_from_person =
      SE3(Eigen::Quaterniond(Eigen::AngleAxisd(heading - M_PI / 2, Eigen::Vector3d::UnitZ())), {here.x(), here.y(), 0});
  return out;
}

Cast::Placement Cast::sitter(const Member& member, double time_s) const {
  const auto& p = member.phases;
  SittingState state;
  state.torso_yaw_rad = 0.16 * drift(time_s, 0.06, p[0]);
  state.torso_pitch_rad =
      0.06 * drift(time_s, 0.05, p[1]) + 0.008 * std::sin(2 * M_PI * 0.25 * time_s + p[2]);  // breathing
  state.torso_roll_rad = 0.04 * drift(time_s, 0.04, p[3]);
  state.head_yaw_rad = 0.45 * drift(time_s, 0.09, p[4]);
  state.head_pitch_rad = 0.18 + 0.12 * drift(time_s, 0.11, p[5]);
  state.arms = {now_and_then(time_s, 0.07, p[6]) * (1 + 0.15 * std::sin(2 * M_PI * 0.8 * time_s)),
                0.6 * now_and_then(time_s, 0.05, p[7])};
  Placement out;
  out.pose = sitting_pose(state, member.seat.height_m / member.person->scale());
  const double heading = member.seat.heading_rad + 0.08 * drift(time_s, 0.05, p[8]);
  out.world_from_person = SE3(Eigen::Quaterniond(Eigen::AngleAxisd(heading - M_PI / 2, Eigen::Vector3d::UnitZ())),
                              {member.seat.position.x(), member.seat.position.y(), 0});
  return out;
}

void Cast::add_occluders(const Placement& placement, const std::array<BoneMotion, kBones>& motions, double scale,
                         std::vector<Occluder>& out) {
  constexpr std::pair<Bone, double> kBalls[] = {{kPelvis, 0.17}, {kChest, 0.17},  {kHead, 0.11},
                                                {kThighR, 0.10}, {kThighL, 0.10}, {kShankR, 0.08},
                                                {kShankL, 0.08}, {kFootR, 0.085}, {kFootL, 0.085}};
  for (const auto& [bone, radius] : kBalls) {
    const RestBone& rest = rest_bones()[bone];
    const Eigen::Vector3d middle = motions[bone] * Eigen::Vector3d((rest.joint + rest.end) / 2);
    out.push_back({placement.world_from_person * Eigen::Vector3d(scale * middle), scale * radius});
  }
}

void Cast::arrange(double time_s, const Eigen::Vector3d& eye, const LightModel& light, std::vector<Mesh>& meshes,
                   std::vector<Occluder>& occluders, int threads) const {
  meshes.clear();
  occluders.clear();
  struct Part {
    std::vector<Mesh> meshes;
    std::vector<Occluder> occluders;
  };
  std::vector<Part> parts(members_.size());
  parallel_for(static_cast<int>(parts.size()), threads,
               [&](int i, int) { arrange(members_[i], time_s, eye, light, parts[i].meshes, parts[i].occluders); });
  for (Part& part : parts) {
    for (Mesh& mesh : part.meshes) meshes.push_back(std::move(mesh));
    occluders.insert(occluders.end(), part.occluders.begin(), part.occluders.end());
  }
}

void Cast::arrange(const Member& member, double time_s, const Eigen::Vector3d& eye, const LightModel& light,
                   std::vector<Mesh>& meshes, std::vector<Occluder>& occluders) const {
  const Placement placement = member.walks ? walker(member, time_s) : sitter(member, time_s);
  const auto motions = solve_pose(placement.pose);
  const double scale = member.person->scale();
  add_occluders(placement, motions, scale, occluders);
  const Eigen::Vector3d middle = placement.world_from_person * Eigen::Vector3d(0, 0, 1.1);
  const std::array<float, 6> cube = light.cube(middle);
  meshes.emplace_back();
  meshes.back().role = static_cast<std::uint8_t>(member.role);
  member.person->pose(motions, placement.world_from_person, cube, (middle - eye).norm() < kFineDistance_m,
                      meshes.back());
  if (member.item == Item::kNone) return;
  Mesh item = member.item_shape;
  item.role = static_cast<std::uint8_t>(member.item_role);
  const double lift = placement.pose.pelvis.z() - rest_bones()[kPelvis].joint.z();
  const Eigen::Vector3d bob(0, 0, member.item == Item::kSuitcase ? 0.0 : lift);
  const double item_scale = member.item == Item::kSuitcase ? 1.0 : scale;
  for (Eigen::Vector3d& v : item.vertices) v = placement.world_from_person * Eigen::Vector3d(item_scale * (v + bob));
  for (Triangle& t : item.triangles) {
    const Eigen::Vector3d &a = item.vertices[t.corners[0].vertex], &b = item.vertices[t.corners[1].vertex],
                          &c = item.vertices[t.corners[2].vertex];
    const Eigen::Vector3d n = (b - a).cross(c - a).normalized();
    float sum = 0;
    for (int axis = 0; axis < 3; ++axis) sum += static_cast<float>(n[axis] * n[axis]) * cube[2 * axis + (n[axis] < 0)];
    for (Corner& corner : t.corners) corner.light.x() = 0.92f * sum;
  }
  item.update_bounds();
  occluders.push_back({item.centre, 0.5 * item.radius_m});
  meshes.push_back(std::move(item));
}

}  // namespace semvslam::render
