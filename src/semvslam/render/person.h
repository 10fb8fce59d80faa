#pragma once

#include <Eigen/Core>
#include <array>
#include <cstdint>
#include <vector>

#include "semvslam/render/implicit.h"
#include "semvslam/render/mesh.h"
#include "semvslam/render/scene_builder.h"
#include "semvslam/render/skeleton.h"

namespace semvslam::render {

/// What somebody looks like.
struct PersonLook {
  double height_m = 1.75, girth = 1.0;  // girth scales thickness
  bool woman = false;
  cv::Vec3f skin{150, 175, 215}, hair{30, 40, 55}, eyes{70, 70, 50};  // BGR
  enum class Hair { kShort, kCropped, kLong, kBob, kBun, kBald } hair_style = Hair::kShort;
  bool beard = false, glasses = false, long_sleeves = true, collar = true, skirt = false;
  enum class Cloth { kPlain, kStripes, kChecks, kPrint, kJeans } top = Cloth::kPlain, bottom = Cloth::kJeans;
  cv::Vec3f top_tone{120, 80, 60}, top_second{220, 220, 220}, bottom_tone{90, 60, 45}, shoes{40, 40, 45};
  std::uint64_t seed = 0;
};
PersonLook random_look(std::uint64_t seed);

/// One separately polygonised part of a body with its texture chart.
struct BodyPart {
  enum class Chart { kHead, kFrontBack, kBox } chart = Chart::kBox;
  ImplicitShape shape;
  float cell_m = 0.014f;
  std::uint16_t texture = 0;
  double image_m = 0.5;  // kBox, kFrontBack: metres that one image covers
  bool skirt = false;
};

/// The resting body's parts (body_shape.cc). Textures are made in `builder`.
std::vector<BodyPart> make_body_parts(const PersonLook& look, SceneBuilder& builder);

/// A person's skinned surface in two levels of detail.
class Person {
 public:
  Person(const PersonLook& look, SceneBuilder& builder, int threads);

  /// The surface in a pose. @param world_from_person floor pose; the body is scaled to its height here.
  /// @param light brightness from +x -x +y -y +z -z of the world. @param fine near the camera.
  void pose(const std::array<BoneMotion, kBones>& motions, const SE3& world_from_person,
            const std::array<float, 6>& light, bool fine, Mesh& out) const;
  double scale() const { return look_.height_m / 1.75; }

 private:
  struct Vertex {
    Eigen::Vector3d point, normal;
    SkinWeights weights;
    float open;  // share of the surroundings that the own body does not hide
  };
  struct Surface {
    std::vector<Vertex> vertices;
    std::vector<Triangle> triangles;
    void append(const Surface& piece);
  };
  static Surface make_piece(const std::vector<BodyPart>& parts, const BodyPart& part, float coarseness);

  PersonLook look_;
  Surface fine_, coarse_;
};

// --- textures (paint_people.cc), CV_8UC3 ---
/// Left half: the face in front view, x in [-0.11, 0.11] m, z in [1.50, 1.78] m; right half: plain skin.
cv::Mat paint_head(cv::Size size, const PersonLook& look);
cv::Mat paint_skin(cv::Size size, const PersonLook& look);
cv::Mat paint_hair(cv::Size size, const PersonLook& look);
/// Left half: front, right half: back, x in [-0.35, 0.35] m, z in [0.85, 1.55] m.
cv::Mat paint_top(cv::Size size, const PersonLook& look);
/// The same for legs, z in [0, 1.05] m, x in [-0.35, 0.35] m.
cv::Mat paint_bottom(cv::Size size, const PersonLook& look);

}  // namespace semvslam::render
