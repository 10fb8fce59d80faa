#pragma once

#include <Eigen/Core>
#include <array>
#include <cstdint>
#include <opencv2/core.hpp>
#include <vector>

#include "semvslam/geometry/camera.h"
#include "semvslam/geometry/se3.h"
#include "semvslam/render/light_atlas.h"
#include "semvslam/render/mesh.h"
#include "semvslam/render/texture.h"

namespace semvslam::render {

/// What the rasteriser draws into; all of the camera's size.
struct Picture {
  cv::Mat colour;     // CV_8UC3 BGR
  cv::Mat depth_m;    // CV_32FC1, z at the pixel centre, 0 where nothing is
  cv::Mat cosine;     // CV_32FC1, |cos| between ray and surface normal at the pixel centre
  cv::Mat instances;  // CV_8UC1, Mesh::role at the pixel centre
};

/// Software z-buffer renderer: visibility at five points of each pixel (the centre, which alone gives depth, and four
/// points symmetric to it, which give colour), then each visible triangle is shaded once per pixel at the mean of its
/// points. Inverse depth and texture coordinates over depth are linear in the picture (Blinn 1992; homogeneous set-up
/// as in Olano and Greer 1997), so perspective is exact.
class Rasterizer {
 public:
  explicit Rasterizer(const Camera& camera);

  /// Draws meshes seen from a pose. Later meshes lose ties in depth. The result does not depend on `threads`.
  void draw(const std::vector<const Mesh*>& meshes, const std::vector<Texture>& textures, const LightAtlas& light,
            const SE3& world_from_camera, int threads, Picture& picture);

 private:
  static constexpr int kSamples = 5;
  static constexpr int kBandRows = 16;

  /// value(x, y) = at_origin + dx (x - origin_x) + dy (y - origin_y), divided by inverse depth gives the attribute.
  struct Plane {
    float at_origin, dx, dy;
  };
  struct Edge {
    double top, bottom, x_at_top, slope;
  };
  struct ScreenTriangle {
    std::array<Edge, 4> edges;
    int edge_count = 0;
    float origin_x = 0, origin_y = 0;
    double inverse_depth[3];  // dx, dy, value at pixel (0, 0)
    Plane inverse_depth_local, u, v, light_column, light_row;
    int first_row = 0, last_row = 0;
    float plane_offset_m = 0, normal_norm = 0;  // for the angle between ray and surface
    std::uint16_t texture = 0;
    Lighting lighting = Lighting::kVertex;
    std::uint8_t role = 0;
    bool continues = false;  // looks the same as the triangle before: pixels of both are shaded once
  };
  struct BandBuffers {
    std::array<std::vector<float>, kSamples> inverse_depth;
    std::array<std::vector<std::uint32_t>, kSamples> triangle;
  };

  bool outside(const Mesh& mesh, const SE3& camera_from_world) const;
  void set_up(const Mesh& mesh, const SE3& camera_from_world, std::vector<ScreenTriangle>& out) const;
  bool set_up_triangle(const std::array<Eigen::Vector3d, 3>& points, const Triangle& source, ScreenTriangle& out) const;
  void set_up_planes(const std::array<Eigen::Vector3d, 3>& points, double determinant, const Triangle& source,
                     ScreenTriangle& out) const;
  void fill_band(int band, BandBuffers& buffers) const;
  void fill_row(const ScreenTriangle& triangle, std::uint32_t id, int row, int band_top, BandBuffers& buffers) const;
  void resolve_band(int band, const BandBuffers& buffers, const std::vector<Texture>& textures, const LightAtlas& light,
                    Picture& picture) const;
  Colour4 shade(const ScreenTriangle& triangle, float x, float y, const std::vector<Texture>& textures,
                const LightAtlas& light) const;

  Camera camera_;
  int bands_ = 0;
  std::vector<std::vector<ScreenTriangle>> parts_;  // per mesh
  std::vector<const ScreenTriangle*> triangles_;    // all of them, in drawing order
  std::vector<std::vector<std::uint32_t>> bins_;    // per band: indices into triangles_
  std::vector<BandBuffers> buffers_;                // per worker
};

}  // namespace semvslam::render
