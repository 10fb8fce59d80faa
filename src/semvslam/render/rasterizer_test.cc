#include "semvslam/render/rasterizer.h"

#include <gtest/gtest.h>

#include <cmath>

#include "semvslam/render/random.h"

namespace semvslam::render {
namespace {

Camera small_camera(int width = 97, int height = 71) {
  Camera camera;
  camera.width_px = width;
  camera.height_px = height;
  camera.fx_px = 83.0;
  camera.fy_px = 81.0;
  camera.cx_px = 47.3;
  camera.cy_px = 36.8;
  return camera;
}

LightAtlas no_light() {
  LightAtlas light;
  light.width = light.height = 2;
  light.texels.assign(4, Colour4{1, 1, 1, 1});
  return light;
}

/// Corners counter-clockwise; the texture spans the quad, its top at corners 2 and 3.
Mesh quad(const std::array<Eigen::Vector3d, 4>& corners, std::uint8_t role = 0, bool two_sided = false) {
  Mesh mesh;
  mesh.role = role;
  mesh.vertices.assign(corners.begin(), corners.end());
  const Eigen::Vector2f uv[4] = {{0, 1}, {1, 1}, {1, 0}, {0, 0}};
  for (const auto& order : {std::array<std::uint32_t, 3>{0, 1, 2}, std::array<std::uint32_t, 3>{0, 2, 3}}) {
    Triangle t;
    t.lighting = Lighting::kEmissive;
    t.two_sided = two_sided;
    for (int i = 0; i < 3; ++i) {
      t.corners[i].vertex = order[i];
      t.corners[i].uv = uv[order[i]];
    }
    t.continues = !mesh.triangles.empty();
    mesh.triangles.push_back(t);
  }
  mesh.update_bounds();
  return mesh;
}

Picture draw(const Camera& camera, const std::vector<Mesh>& meshes, const std::vector<Texture>& textures,
             const SE3& pose = {}) {
  Rasterizer rasterizer(camera);
  std::vector<const Mesh*> pointers;
  for (const Mesh& mesh : meshes) pointers.push_back(&mesh);
  Picture picture;
  rasterizer.draw(pointers, textures, no_light(), pose, 1, picture);
  return picture;
}

std::vector<Texture> white() {
  std::vector<Texture> textures;
  textures.emplace_back(cv::Mat(4, 4, CV_8UC3, cv::Scalar(200, 200, 200)), false);
  return textures;
}

TEST(Rasterizer, DepthAtPixelCentresIsWhereTheRayMeetsThePlane) {
  const Camera camera = small_camera();
  RandomStream random(3);
  for (int trial = 0; trial < 30; ++trial) {
    const SE3 world_from_camera = SE3::exp((SE3::Tangent() << random.normal(), random.normal(), random.normal(),
                                            random.normal(), random.normal(), random.normal())
                                               .finished());
    const Eigen::Vector3d centre(random.uniform(-0.5, 0.5), random.uniform(-0.4, 0.4), random.uniform(1.0, 6.0));
    Eigen::Vector3d u(random.normal(), random.normal(), 0.6 * random.normal()),
        v(random.normal(), random.normal(), 0.6 * random.normal());
    const Eigen::Vector3d n = u.cross(v);
    const std::array<Eigen::Vector3d, 4> local{centre - u - v, centre + u - v, centre + u + v, centre - u + v};
    std::array<Eigen::Vector3d, 4> world;
    for (int i = 0; i < 4; ++i) world[i] = world_from_camera * local[i];
    const Picture picture = draw(camera, {quad(world, 7, true)}, white(), world_from_camera);
    int seen = 0;
    for (int y = 0; y < camera.height_px; ++y) {
      for (int x = 0; x < camera.width_px; ++x) {
        const Eigen::Vector3d ray = camera.back_project({x, y}, 1.0);
        const double z = n.dot(centre) / n.dot(ray);
        const Eigen::Vector3d from_centre = z * ray - centre;
        const double a = std::abs(from_centre.cross(v).dot(n)) / n.squaredNorm(),
                     b = std::abs(u.cross(from_centre).dot(n)) / n.squaredNorm();
        const double rim = 1e-4;
        if (z > 0.06 && a < 1 - rim && b < 1 - rim) {
          ASSERT_NEAR(picture.depth_m.at<float>(y, x), z, 3e-6 * z) << "trial " << trial << " pixel " << x << "," << y;
          ASSERT_EQ(picture.instances.at<std::uint8_t>(y, x), 7);
          const double cosine = std::abs(n.dot(ray)) / (n.norm() * ray.norm());
          ASSERT_NEAR(picture.cosine.at<float>(y, x), cosine, 1e-4);
          ++seen;
        } else if (z < 0 || a > 1 + rim || b > 1 + rim) {
          ASSERT_EQ(picture.depth_m.at<float>(y, x), 0.f) << "trial " << trial << " pixel " << x << "," << y;
        }
      }
    }
    if (trial == 0) {
      EXPECT_GT(seen, 0);
    }
  }
}

TEST(Rasterizer, EdgesLieWhereTheirProjectionSays) {
  // The sum of colour over a row tells where an edge is; the mean error over many places must vanish.
  const Camera camera = small_camera();
  double error_sum = 0, error_square = 0;
  constexpr int kTrials = 400;
  for (int i = 0; i < kTrials; ++i) {
    const double edge_px = 40 + 3.0 * i / kTrials, z = 2.0;
    const double x = (edge_px - camera.cx_px) / camera.fx_px * z;
    const Picture picture =
        draw(camera, {quad({Eigen::Vector3d(-9, 9, z), {x, 9, z}, {x, -9, z}, {-9, -9, z}})}, white());
    double sum = 0;
    for (int c = 0; c < camera.width_px; ++c) sum += picture.colour.at<cv::Vec3b>(30, c)[0];
    const double measured_px = sum / 200.0 - 0.5;
    error_sum += measured_px - edge_px;
    error_square += (measured_px - edge_px) * (measured_px - edge_px);
  }
  EXPECT_LT(std::abs(error_sum / kTrials), 0.004);
  EXPECT_LT(std::sqrt(error_square / kTrials), 0.12);  // four points per pixel: steps of a quarter
}

TEST(Rasterizer, TexelsComeOutWhereTheyProject) {
  // One texel per pixel, centres on centres: the picture is the texture.
  Camera camera = small_camera(64, 64);
  camera.fx_px = camera.fy_px = 64;
  camera.cx_px = camera.cy_px = 31.5;
  cv::Mat image(64, 64, CV_8UC3);
  RandomStream random(8);
  for (int y = 0; y < 64; ++y) {
    for (int x = 0; x < 64; ++x)
      image.at<cv::Vec3b>(y, x) = {static_cast<std::uint8_t>(random.below(256)),
                                   static_cast<std::uint8_t>(random.below(256)), 90};
  }
  std::vector<Texture> textures;
  textures.emplace_back(image, false);
  const Picture picture =
      draw(camera, {quad({Eigen::Vector3d(-1, 1, 2), {1, 1, 2}, {1, -1, 2}, {-1, -1, 2}})}, textures);
  EXPECT_LE(cv::norm(picture.colour, image, cv::NORM_INF), 1.0);
}

TEST(Rasterizer, AHalfTurnedCameraSeesTheHalfTurnedPicture) {
  // Any shift between colour and geometry would show twice.
  Camera camera = small_camera(160, 120);
  camera.fx_px = camera.fy_px = 130;
  camera.cx_px = 79.5;
  camera.cy_px = 59.5;
  RandomStream random(5);
  cv::Mat image(256, 256, CV_8UC3);
  for (int y = 0; y < 256; ++y) {
    for (int x = 0; x < 256; ++x)
      image.at<cv::Vec3b>(y, x) = cv::Vec3b::all(static_cast<std::uint8_t>(random.below(256)));
  }
  std::vector<Texture> textures;
  textures.emplace_back(image, false);
  const std::array<Eigen::Vector3d, 4> corners{
      Eigen::Vector3d(-2, 1.3, 1.5), {1.5, 1.1, 2.5}, {1.4, -1.2, 4}, {-1.8, -1.5, 2}};
  std::array<Eigen::Vector3d, 4> flat = corners;  // the fourth into the plane of the others
  flat[3] = corners[0] + corners[2] - corners[1];
  const SE3 half_turn(Eigen::Quaterniond(Eigen::AngleAxisd(M_PI, Eigen::Vector3d::UnitZ())), Eigen::Vector3d::Zero());
  const Picture upright = draw(camera, {quad(flat)}, textures),
                turned = draw(camera, {quad(flat)}, textures, half_turn);
  cv::Mat back, difference;
  cv::flip(turned.colour, back, -1);
  cv::absdiff(upright.colour, back, difference);
  EXPECT_GT(cv::countNonZero(upright.depth_m), 5000);
  EXPECT_LE(cv::countNonZero(difference.reshape(1) > 1), 30) << "rounding at most";
  EXPECT_LT(cv::mean(difference)[0], 0.02);
}

TEST(Rasterizer, NeighbouringTrianglesLeaveNoGapAndNoOverlap) {
  // A fan around an odd point: every pixel inside belongs to exactly one triangle, and a second fan behind never shows.
  const Camera camera = small_camera();
  RandomStream random(21);
  for (int trial = 0; trial < 20; ++trial) {
    Mesh front;
    front.role = 1;
    front.vertices.push_back({random.uniform(-0.2, 0.2), random.uniform(-0.2, 0.2), 1.5});
    constexpr int kSides = 17;
    for (int i = 0; i < kSides; ++i) {
      const double a = -2 * M_PI * i / kSides + random.uniform(0, 0.2);
      front.vertices.push_back({2 * std::cos(a), 2 * std::sin(a), 1.5});
    }
    for (std::uint32_t i = 0; i < kSides; ++i) {
      Triangle t;
      t.lighting = Lighting::kEmissive;
      t.corners[0].vertex = 0;
      t.corners[1].vertex = 1 + i;
      t.corners[2].vertex = 1 + (i + 1) % kSides;
      front.triangles.push_back(t);
    }
    front.update_bounds();
    const Picture picture =
        draw(camera, {front, quad({Eigen::Vector3d(-9, 9, 3), {9, 9, 3}, {9, -9, 3}, {-9, -9, 3}}, 2)}, white());
    EXPECT_EQ(cv::countNonZero(picture.instances == 1), camera.width_px * camera.height_px);
    double low, high;
    cv::minMaxLoc(picture.colour.reshape(1), &low, &high);
    EXPECT_EQ(low, 200);
    EXPECT_EQ(high, 200);
  }
}

TEST(Rasterizer, CutsAtTheNearPlaneAndHidesBacks) {
  const Camera camera = small_camera();
  // A floor that runs under and behind the camera.
  const Mesh floor = quad({Eigen::Vector3d(-5, 1, -5), {-5, 1, 9}, {5, 1, 9}, {5, 1, -5}}, 1);
  const Mesh ceiling_from_behind = quad({Eigen::Vector3d(-5, -1, -5), {-5, -1, 9}, {5, -1, 9}, {5, -1, -5}}, 2);
  Picture picture = draw(camera, {floor, ceiling_from_behind}, white());
  const int from_above = cv::countNonZero(picture.instances == 1), back = cv::countNonZero(picture.instances == 2);
  EXPECT_TRUE((from_above > 0) != (back > 0)) << "one side of the two parallel planes faces the camera";
  picture = draw(camera, {quad({Eigen::Vector3d(-5, 1, -5), {5, 1, -5}, {5, 1, 9}, {-5, 1, 9}}, 1, true)}, white());
  const int row = camera.height_px - 1;
  const double z = camera.fy_px / (row - camera.cy_px);
  EXPECT_NEAR(picture.depth_m.at<float>(row, 50), z, 1e-5);
}

}  // namespace
}  // namespace semvslam::render
