#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <cstdint>
#include <functional>
#include <opencv2/core.hpp>
#include <vector>

#include "semvslam/geometry/se3.h"
#include "semvslam/render/light_atlas.h"
#include "semvslam/render/mesh.h"
#include "semvslam/render/texture.h"

namespace semvslam::render {

/// How a surface is painted: which image, and how many metres one image covers in each direction. A size of 0 stretches
/// the image once over the surface.
struct Skin {
  std::uint16_t texture = 0;
  Eigen::Vector2d image_size_m = Eigen::Vector2d::Zero();
  Eigen::Vector2d offset_m = Eigen::Vector2d::Zero();
  bool turned = false;  // the image's x axis runs along the surface's second side
};

/// A rectangle of the light atlas and where its texels lie in the room.
struct LightPatch {
  int column = 0, row = 0, columns = 0, rows = 0;
  Eigen::Vector3d origin, column_step, row_step, normal;

  Eigen::Vector3d position(int c, int r) const { return origin + c * column_step + r * row_step; }
};

/// Vertices of one mesh that are lit one by one.
struct VertexNormals {
  std::size_t mesh = 0, first_vertex = 0;
  std::vector<Eigen::Vector3d> normals;
};

/// Everything that stands still.
struct StaticScene {
  std::vector<Mesh> meshes;
  std::vector<Texture> textures;
  LightAtlas light;
  std::vector<LightPatch> patches;
  std::vector<VertexNormals> vertex_normals;
};

/// Puts surfaces together. All sizes in metres; `pose` arguments are world_from_part.
class SceneBuilder {
 public:
  /// @param paint makes the image, CV_8UC3; called by finish(), perhaps by another thread.
  std::uint16_t add_texture(std::function<cv::Mat()> paint, bool repeat = true);

  /// Surfaces added from here on belong to a new mesh (which is culled as a whole).
  void begin_mesh();
  /// Index of the mesh that is being built.
  std::size_t mesh_index() const { return scene_.meshes.size() - 1; }
  /// What has been built so far.
  const std::vector<Mesh>& meshes() const { return scene_.meshes; }

  /// A parallelogram; visible from where `along_u` to `along_v` turns counter-clockwise. The image's top is at the far
  /// end of `along_v`. @param light_step_m distance of baked light values.
  void quad(const Eigen::Vector3d& corner, const Eigen::Vector3d& along_u, const Eigen::Vector3d& along_v,
            const Skin& skin, double light_step_m = 0.1, bool emissive = false);
  /// A box centred on pose's origin in x and y, standing on it in z. `front` is the face towards -y, `top` towards +z.
  /// @param closed false leaves out the faces towards +y and -z, for things whose back nobody can see.
  void box(const SE3& pose, const Eigen::Vector3d& size_m, const Skin& sides, const Skin& front, const Skin& top,
           bool closed = true);
  void box(const SE3& pose, const Eigen::Vector3d& size_m, const Skin& skin) { box(pose, size_m, skin, skin, skin); }
  /// A solid of revolution around pose's z axis. @param profile (radius, height) from bottom to top.
  void lathe(const SE3& pose, const std::vector<Eigen::Vector2d>& profile, int segments, const Skin& skin);
  /// A tube along points of the world. @param radii_m one per point.
  void tube(const std::vector<Eigen::Vector3d>& points, const std::vector<double>& radii_m, int segments,
            const Skin& skin);
  /// A pointed leaf, seen from both sides, that bends down along its length.
  void leaf(const Eigen::Vector3d& root, const Eigen::Vector3d& direction, double length_m, double width_m,
            double droop, const Skin& skin);

  /// Paints the textures, packs the light atlas (all texels 1) and hands everything over. The result does not depend on
  /// `threads`.
  StaticScene finish(int threads);

 private:
  Mesh& mesh() { return scene_.meshes.back(); }
  std::vector<Eigen::Vector3d>& normals_for_new_vertices();

  StaticScene scene_;
  struct PendingPatch {
    std::size_t mesh, first_triangle, patch;
  };
  std::vector<PendingPatch> pending_;
  struct Painting {
    std::function<cv::Mat()> paint;
    bool repeat;
  };
  std::vector<Painting> paintings_;
};

}  // namespace semvslam::render
