#include "semvslam/render/scene_source.h"

#include <gtest/gtest.h>

#include <cmath>
#include <opencv2/imgproc.hpp>

#include "semvslam/render/camera_path.h"
#include "semvslam/render/room.h"

namespace semvslam {
namespace {

SceneOptions small(const std::string& people, const std::string& motion, bool noise) {
  SceneOptions options;
  options.people = people;
  options.motion = motion;
  options.noise = noise;
  options.width_px = 320;
  options.height_px = 240;
  return options;
}

RenderedScene make(const SceneOptions& options) {
  auto scene = RenderedScene::create(options);
  if (!scene) throw std::runtime_error(scene.error().message);
  return std::move(scene).value();
}

/// The empty room, exact; built once.
RenderedScene& exact_room() {
  static RenderedScene scene = make(small("none", "halfsphere", false));
  return scene;
}
RenderedScene& walking_exact() {
  static RenderedScene scene = make(small("walking", "halfsphere", false));
  return scene;
}

bool same(const cv::Mat& a, const cv::Mat& b) {
  return a.size() == b.size() && a.type() == b.type() && cv::norm(a.reshape(1), b.reshape(1), cv::NORM_INF) == 0;
}

TEST(SceneOptions, EveryBrokenRuleNamesItsOption) {
  const auto message = [](auto&& change) {
    SceneOptions options;
    change(options);
    const auto scene = RenderedScene::create(options);
    return scene.ok() ? std::string() : scene.error().message;
  };
  EXPECT_NE(message([](SceneOptions& o) { o.people = "dancing"; }).find("people: 'dancing'"), std::string::npos);
  EXPECT_NE(message([](SceneOptions& o) { o.motion = ""; }).find("motion"), std::string::npos);
  EXPECT_NE(message([](SceneOptions& o) { o.width_px = 8; }).find("size"), std::string::npos);
  EXPECT_NE(message([](SceneOptions& o) { o.height_px = 100000; }).find("size"), std::string::npos);
  EXPECT_NE(message([](SceneOptions& o) { o.frames = 0; }).find("frames"), std::string::npos);
  EXPECT_NE(message([](SceneOptions& o) { o.frame_rate_hz = std::nan(""); }).find("frame_rate_hz"), std::string::npos);
  EXPECT_NE(message([](SceneOptions& o) { o.threads = 0; }).find("threads"), std::string::npos);
  SceneOptions bad;
  bad.frames = -3;
  EXPECT_FALSE(open_scene(bad).ok());
}

TEST(RenderedScene, DepthIsInsideTheRoomsAndOnTheirPlanes) {
  using namespace render;
  RenderedScene& scene = exact_room();
  const RenderedFrame f = scene.render(40);
  ASSERT_EQ(f.frame.depth.type(), CV_32FC1);
  int floor = 0, north = 0;
  for (int y = 0; y < f.frame.depth.rows; ++y) {
    for (int x = 0; x < f.frame.depth.cols; ++x) {
      const float z = f.frame.depth.at<float>(y, x);
      ASSERT_GT(z, 0.2f);
      const Eigen::Vector3d p = f.world_from_camera * scene.camera().back_project({x, y}, z);
      ASSERT_GT(p.z(), -1e-5);
      ASSERT_LT(p.z(), kRoomHeight_m + 1e-5);
      ASSERT_GT(p.x(), kRoomAWest_m - 1e-5);
      ASSERT_LT(p.x(), kRoomBEast_m + 1e-5);
      ASSERT_LT(p.y(), kRoomsNorth_m + 1e-5);
      floor += std::abs(p.z()) < 3e-6;
      north += std::abs(p.y() - kRoomsNorth_m) < 3e-6;
    }
  }
  EXPECT_GT(floor, 1000);
  EXPECT_GT(north, 3000);
}

/// Brightness and gradient of `to` where the points seen in `from` should be; the shift that explains the difference
/// best.
struct Shift {
  Eigen::Vector2d px = Eigen::Vector2d::Zero();
  int pixels = 0;
};
Shift residual_shift(const Camera& camera, const RenderedFrame& from, const RenderedFrame& to, const cv::Rect& area) {
  cv::Mat image, gradient_x, gradient_y, farthest, nearest;
  to.frame.gray.convertTo(image, CV_32F);
  // At the outlines of near things colours mix, and move with the outline.
  cv::dilate(from.frame.depth, farthest, cv::Mat::ones(5, 5, CV_8U));
  cv::erode(from.frame.depth, nearest, cv::Mat::ones(5, 5, CV_8U));
  cv::Sobel(image, gradient_x, CV_32F, 1, 0, 3, 1.0 / 8);
  cv::Sobel(image, gradient_y, CV_32F, 0, 1, 3, 1.0 / 8);
  const SE3 to_from = to.world_from_camera.inverse() * from.world_from_camera;
  Eigen::Matrix2d h = Eigen::Matrix2d::Zero();
  Eigen::Vector2d g = Eigen::Vector2d::Zero();
  Shift shift;
  auto bilinear = [](const cv::Mat& m, double x, double y) {
    const int x0 = static_cast<int>(x), y0 = static_cast<int>(y);
    const double a = x - x0, b = y - y0;
    return (m.at<float>(y0, x0) * (1 - a) + m.at<float>(y0, x0 + 1) * a) * (1 - b) +
           (m.at<float>(y0 + 1, x0) * (1 - a) + m.at<float>(y0 + 1, x0 + 1) * a) * b;
  };
  for (int y = area.y; y < area.y + area.height; ++y) {
    for (int x = area.x; x < area.x + area.width; ++x) {
      const double z = from.frame.depth.at<float>(y, x);
      if (farthest.at<float>(y, x) - nearest.at<float>(y, x) > 0.06 * z) continue;
      const Eigen::Vector3d p = to_from * camera.back_project({x, y}, z);
      if (p.z() < 0.1) continue;
      const Eigen::Vector2d q = camera.project(p);
      if (q.x() < 3 || q.y() < 3 || q.x() > camera.width_px - 5 || q.y() > camera.height_px - 5) continue;
      const double there = bilinear(to.frame.depth, q.x(), q.y());
      if (std::abs(there - p.z()) > 0.002 * p.z()) continue;  // hidden, or at an edge of depth
      const double difference = bilinear(image, q.x(), q.y()) - from.frame.gray.at<std::uint8_t>(y, x);
      if (std::abs(difference) > 40) continue;
      const Eigen::Vector2d slope(bilinear(gradient_x, q.x(), q.y()), bilinear(gradient_y, q.x(), q.y()));
      h += slope * slope.transpose();
      g -= slope * difference;
      ++shift.pixels;
    }
  }
  shift.px = h.ldlt().solve(g);
  return shift;
}

TEST(RenderedScene, ColourDepthAndPosesAgreeToAFiftiethOfAPixel) {
  RenderedScene& scene = exact_room();
  const Camera& camera = scene.camera();
  const int pairs[][2] = {{0, 12}, {30, 15}, {60, 75}, {90, 110}, {130, 120}, {200, 215}, {250, 240}, {280, 292}};
  constexpr double kPairs = std::size(pairs);
  Eigen::Vector2d mean = Eigen::Vector2d::Zero(), quarters[4];
  for (auto& quarter : quarters) quarter.setZero();
  double square = 0;
  for (const auto& pair : pairs) {
    const RenderedFrame a = scene.render(pair[0]), b = scene.render(pair[1]);
    const Eigen::Vector3d moved = a.world_from_camera.translation() - b.world_from_camera.translation();
    ASSERT_GT(moved.norm(), 0.005);
    const Shift all = residual_shift(camera, a, b, {0, 0, camera.width_px, camera.height_px});
    EXPECT_GT(all.pixels, camera.width_px * camera.height_px / 3);
    mean += all.px / kPairs;
    square += all.px.squaredNorm() / kPairs;
    for (int i = 0; i < 4; ++i) {
      const cv::Rect area(i % 2 * camera.width_px / 2, i / 2 * camera.height_px / 2, camera.width_px / 2,
                          camera.height_px / 2);
      quarters[i] += residual_shift(camera, a, b, area).px / kPairs;
    }
  }
  EXPECT_LT(mean.norm(), 0.01);
  EXPECT_LT(std::sqrt(square), 0.02);
  for (const auto& quarter : quarters) EXPECT_LT(quarter.norm(), 0.02);  // a wrong focal length would show here
}

TEST(RenderedScene, SameBytesForAnyThreadsOrderAndObject) {
  SceneOptions options = small("carrying", "xyz", true);
  options.width_px = 161;
  options.height_px = 119;
  options.threads = 1;
  RenderedScene one = make(options);
  options.threads = 3;
  RenderedScene three = make(options);
  const RenderedFrame first = one.render(7), second = one.render(95);
  const RenderedFrame second_first = three.render(95), first_last = three.render(7);
  for (const auto& [a, b] : {std::pair{&first, &first_last}, std::pair{&second, &second_first}}) {
    EXPECT_TRUE(same(a->frame.colour, b->frame.colour));
    EXPECT_TRUE(same(a->frame.depth, b->frame.depth));
    EXPECT_TRUE(same(a->frame.gray, b->frame.gray));
    EXPECT_TRUE(same(a->instances, b->instances));
    EXPECT_EQ(a->frame.stamp, b->frame.stamp);
    EXPECT_EQ(a->world_from_camera.translation(), b->world_from_camera.translation());
  }
  EXPECT_FALSE(same(first.frame.colour, second.frame.colour));
  EXPECT_TRUE(same(one.render(7).frame.colour, first.frame.colour)) << "rendering again changes nothing";
}

TEST(RenderedScene, MasksAreWhereThePictureDiffersFromTheEmptyRoom) {
  RenderedScene &empty = exact_room(), &full = walking_exact();
  double most = 0;
  for (const int index : {0, 70, 140, 210, 280}) {
    const RenderedFrame a = empty.render(index), b = full.render(index);
    EXPECT_EQ(cv::countNonZero(a.instances), 0);
    for (int y = 0; y < b.instances.rows; ++y) {
      for (int x = 0; x < b.instances.cols; ++x) {
        const float behind = a.frame.depth.at<float>(y, x), here = b.frame.depth.at<float>(y, x);
        const int role = b.instances.at<std::uint8_t>(y, x);
        ASSERT_LE(role, static_cast<int>(full.roles().size()));
        if (role == 0) {
          ASSERT_EQ(here, behind) << index << ": " << x << "," << y;
        } else {
          ASSERT_LE(here, behind);
          ASSERT_GT(here, 0.35f) << "a person walks into the camera";
        }
      }
    }
    most = std::max(most, cv::countNonZero(b.instances) / static_cast<double>(b.instances.total()));
  }
  EXPECT_GT(most, 0.08);
  for (const SceneRole& role : full.roles()) EXPECT_EQ(role.kind, "person");
  EXPECT_TRUE(empty.roles().empty());
}

TEST(RenderedScene, DepthNoiseIsThatOfStructuredLight) {
  RenderedScene noisy = make(small("none", "halfsphere", true));
  const RenderedFrame a = noisy.render(25), b = exact_room().render(25);
  ASSERT_EQ(a.frame.depth.type(), CV_16UC1);
  const Camera& camera = noisy.camera();
  std::vector<double> errors[2];
  int holes = 0, off_step = 0;
  for (int y = 1; y < camera.height_px - 1; ++y) {
    for (int x = 1; x < camera.width_px - 1; ++x) {
      const double z = b.frame.depth.at<float>(y, x),
                   measured = a.frame.depth.at<std::uint16_t>(y, x) / camera.depth_units_per_m;
      holes += measured == 0;
      if (measured == 0) continue;
      // Disparities come in eighths of a pixel, but for the rounding to depth units.
      const double eighths = 8 * camera.fx_px * camera.baseline_m / measured;
      off_step += std::abs(eighths - std::round(eighths)) > 0.51 * eighths / (measured * camera.depth_units_per_m);
      if (std::abs(z - measured) > 0.03 * z) continue;  // another surface, seen from the side
      if (z > 1.1 && z < 1.9) errors[0].push_back(measured - z);
      if (z > 4.4 && z < 5.6) errors[1].push_back(measured - z);
    }
  }
  EXPECT_EQ(off_step, 0);
  const double share = holes / static_cast<double>(camera.width_px * camera.height_px);
  EXPECT_GT(share, 0.01);
  EXPECT_LT(share, 0.35);
  double sigma[2];
  for (int i = 0; i < 2; ++i) {
    ASSERT_GT(errors[i].size(), 1000u);
    double mean = 0, square = 0;
    for (const double e : errors[i]) mean += e / errors[i].size();
    for (const double e : errors[i]) square += (e - mean) * (e - mean) / errors[i].size();
    sigma[i] = std::sqrt(square);
    EXPECT_LT(std::abs(mean), 0.35 * sigma[i]);
  }
  EXPECT_GT(sigma[1] / sigma[0], 5.0);  // (5 / 1.5)^2 = 11
  EXPECT_LT(sigma[1] / sigma[0], 18.0);
  cv::Mat difference;
  cv::absdiff(a.frame.gray(cv::Rect(110, 80, 100, 80)), b.frame.gray(cv::Rect(110, 80, 100, 80)), difference);
  EXPECT_GT(cv::mean(difference)[0], 0.6);
  EXPECT_LT(cv::mean(difference)[0], 4.0);
}

TEST(CameraPath, MovesLikeAHand) {
  constexpr double kStep_s = 1.0 / 30;
  for (const char* motion : {"xyz", "rpy", "halfsphere", "static", "tour"}) {
    for (const std::uint64_t seed : {1, 2, 3}) {
      const render::CameraPath way(motion, seed);
      double fastest = 0, path = 0, turn = 0;
      constexpr int kFrames = 2000;
      for (int i = 1; i < kFrames; ++i) {
        const SE3 step = way.pose((i - 1) * kStep_s).inverse() * way.pose(i * kStep_s);
        path += step.translation().norm();
        fastest = std::max(fastest, step.translation().norm() / kStep_s);
        turn = std::max(turn, step.rotation_angle_rad() / kStep_s * 180 / M_PI);
      }
      const double mean = path / (kFrames * kStep_s);
      EXPECT_LT(fastest, 0.75) << motion;
      EXPECT_LT(turn, 75.0) << motion;
      if (motion == std::string("static")) {
        EXPECT_LT(mean, 0.05);
      } else if (motion != std::string("rpy")) {
        EXPECT_GT(mean, 0.08) << motion;
      }
    }
  }
}

TEST(RenderedScene, TourKeepsClearComesBackAndTellsTheTruth) {
  SceneOptions options = small("walking", "tour", false);
  options.width_px = 40;
  options.height_px = 30;
  options.frames = 10000;
  RenderedScene scene = make(options);
  const Trajectory truth = scene.ground_truth();
  ASSERT_EQ(truth.size(), 10000u);
  double nearest = 1e9;
  for (int i = 0; i < 4600; i += 40) {
    const RenderedFrame f = scene.render(i);
    double low;
    cv::minMaxLoc(f.frame.depth, &low, nullptr);
    nearest = std::min(nearest, low);
    EXPECT_EQ(f.world_from_camera.translation(), truth[i].world_from_camera.translation());
    EXPECT_EQ(f.world_from_camera.rotation().coeffs(), truth[i].world_from_camera.rotation().coeffs());
    EXPECT_EQ(f.frame.stamp, truth[i].stamp);
  }
  EXPECT_GT(nearest, 0.25);
  const auto place = [&](int i) -> Eigen::Vector3d { return truth[i].world_from_camera.translation(); };
  double east = -9, again = 9;
  for (int i = 0; i < 10000; ++i) {
    east = std::max(east, place(i).x());
    if (i > 5000) again = std::min(again, (place(i) - place(600)).norm());
  }
  EXPECT_GT(east, render::kRoomBWest_m + 0.8) << "the other room is visited";
  EXPECT_LT(again, 0.3) << "a loop is closed";
}

TEST(SceneFrameSource, DeliversEveryFrameOnceWithTruthMasks) {
  SceneOptions options = small("sitting", "rpy", true);
  options.width_px = 96;
  options.height_px = 72;
  options.frames = 4;
  auto opened = open_scene(options, true);
  ASSERT_TRUE(opened.ok());
  FrameSource& source = **opened;
  EXPECT_EQ(source.size(), 4u);
  EXPECT_TRUE(source.camera().check().ok());
  EXPECT_NE(source.description().find("sitting"), std::string::npos);
  int marked = 0;
  for (std::uint32_t i = 0; i < 4; ++i) {
    auto next = source.next();
    ASSERT_TRUE(next.ok());
    ASSERT_TRUE(next->has_value());
    const RgbdFrame& f = **next;
    EXPECT_EQ(f.id, FrameId(i));
    EXPECT_EQ(f.gray.type(), CV_8UC1);
    EXPECT_EQ(f.colour.type(), CV_8UC3);
    EXPECT_EQ(f.depth.type(), CV_16UC1);
    ASSERT_EQ(f.mask.type(), CV_8UC1);
    marked += cv::countNonZero(f.mask);
    EXPECT_EQ(cv::countNonZero(f.mask), cv::countNonZero(f.mask == 255));
  }
  EXPECT_GT(marked, 100);
  auto end = source.next();
  ASSERT_TRUE(end.ok());
  EXPECT_FALSE(end->has_value());
}

TEST(RenderedScene, BlurIsCentredOnTheStamp) {
  SceneOptions options = small("none", "halfsphere", false);
  options.motion_blur = true;
  options.frame_rate_hz = 15;  // twice the exposure
  RenderedScene blurred = make(options);
  const RenderedFrame a = exact_room().render(34), b = blurred.render(17);
  EXPECT_TRUE(same(a.frame.depth, b.frame.depth));
  const Shift shift = residual_shift(blurred.camera(), a, b, {0, 0, 320, 240});
  EXPECT_LT(shift.px.norm(), 0.05);
  cv::Mat edges_a, edges_b;
  cv::Laplacian(a.frame.gray, edges_a, CV_32F);
  cv::Laplacian(b.frame.gray, edges_b, CV_32F);
  EXPECT_LT(cv::norm(edges_b), 0.95 * cv::norm(edges_a));
}

}  // namespace
}  // namespace semvslam
