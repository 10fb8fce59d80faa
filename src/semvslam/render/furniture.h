#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <vector>

#include "semvslam/render/random.h"
#include "semvslam/render/scene_builder.h"

namespace semvslam::render {

/// Builds single pieces of furniture. Poses are world_from_piece: origin on the floor (or on what it stands on) under
/// the piece's middle, front towards -y.
class Furnisher {
 public:
  Furnisher(SceneBuilder& builder, std::uint64_t seed);

  void bookshelf(const SE3& pose, double width_m, double height_m, double depth_m, int boards);
  void cabinet(const SE3& pose, const Eigen::Vector3d& size_m, int doors);
  void desk(const SE3& pose, double width_m, double depth_m, double height_m);
  void office_chair(const SE3& pose);
  void sofa(const SE3& pose, double width_m);
  void monitor(const SE3& pose, double width_m);
  void keyboard(const SE3& pose);
  void plant(const SE3& pose, double height_m);
  void floor_lamp(const SE3& pose);
  void carton(const SE3& pose, const Eigen::Vector3d& size_m);
  void mug(const SE3& pose);
  void bin(const SE3& pose);
  /// Folded cloth; the pose's origin is the lower middle, in front of the wall.
  void curtain(const SE3& pose, double width_m, double height_m);
  /// A light switch or socket on a wall.
  void wall_plate(const SE3& pose);
  void bottle(const SE3& pose);
  void book_stack(const SE3& pose, int books);
  void pages(const SE3& pose, int sheets);
  /// Random small things on a free rectangle of a table, centred on pose.
  void clutter(const SE3& pose, double width_m, double depth_m, int things);
  /// A picture 1 cm in front of a wall; the pose's origin is the middle of the picture's lower edge, on the wall.
  void poster(const SE3& pose, double width_m, double height_m);
  void whiteboard(const SE3& pose, double width_m, double height_m);

  /// Textures that other builders share.
  std::uint16_t dark_wood() const { return dark_wood_; }
  std::uint16_t white() const { return white_; }
  std::uint16_t black() const { return black_; }
  std::uint16_t metal() const { return metal_; }

 private:
  Skin wood(bool dark, bool turned = false);
  Skin plain(std::uint16_t texture) const { return {texture, {0.5, 0.5}, {0, 0}, false}; }
  void row_of_books(const SE3& pose, double width_m, double height_m, double depth_m);
  void books_on_board(const SE3& pose, double width_m, double height_m, double depth_m);

  SceneBuilder& builder_;
  RandomStream random_;
  std::uint16_t dark_wood_, light_wood_, white_, black_, grey_, metal_, fabric_[3], leaf_[2], spines_[3], carton_[3],
      label_[4], keyboard_, page_[3], terracotta_, paper_edge_;
};

/// A pose on the floor plan: position, height and heading (turn about z).
SE3 on_plan(double x_m, double y_m, double z_m = 0, double turn_deg = 0);

}  // namespace semvslam::render
