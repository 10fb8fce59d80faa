#pragma once

#include <gtest/gtest.h>

#include <cmath>
#include <filesystem>
#include <string>

#include "semvslam/base/temporary_folder_test_support.h"
#include "semvslam/data/file_io.h"
#include "semvslam/data/trajectory_io.h"
#include "semvslam/web/ply_test_support.h"

namespace semvslam::testing_support {

/// A way round a quarter of a circle of 1 m, ten poses a second.
inline Trajectory quarter_circle(int poses, std::int64_t start_ns = 1'000'000'000) {
  Trajectory out;
  for (int i = 0; i < poses; ++i) {
    const double angle = 0.5 * M_PI * i / std::max(1, poses - 1);
    out.push_back({{start_ns + std::int64_t{100'000'000} * i},
                   SE3(Eigen::Quaterniond(Eigen::AngleAxisd(angle, Eigen::Vector3d::UnitY())),
                       {std::cos(angle), 0, std::sin(angle)})});
  }
  return out;
}

inline void write(const std::filesystem::path& file, const std::string& content) {
  ASSERT_TRUE(write_file_atomically(file, content));
}

/// A folder as `semvslam run` leaves it; tests damage it.
class RunFolder {
 public:
  static constexpr int kPoses = 20;

  explicit RunFolder(const std::string& name = "run") : path_(folder_ / name) {
    EXPECT_TRUE(make_folder(path_));
    EXPECT_TRUE(write_trajectory(path_ / "trajectory.txt", quarter_circle(kPoses)));
    EXPECT_TRUE(write_trajectory(path_ / "keyframes.txt", {quarter_circle(kPoses)[0], quarter_circle(kPoses)[9]}));
    write(path_ / "map.ply", landmark_ply({{0, 0, 1}, {1, 2, 3}}));
    write(path_ / "stats.json", R"({"mode": "orb", "end": "complete", "frames": 20, "tracked": 20})");
  }

  /// A ground truth that lies a metre along x beside the run, and a score against it.
  std::filesystem::path add_truth() const {
    Trajectory truth = quarter_circle(kPoses);
    for (StampedPose& p : truth)
      p.world_from_camera = SE3(Eigen::Quaterniond::Identity(), {1, 0, 0}) * p.world_from_camera;
    const std::filesystem::path file = folder_ / "truth.txt";
    EXPECT_TRUE(write_trajectory(file, truth));
    write(path_ / "evaluation.json", R"({"ground_truth": {"file": ")" + file.string() + R"("}})");
    return file;
  }

  const std::filesystem::path& path() const { return path_; }
  std::filesystem::path operator/(const std::string& name) const { return path_ / name; }

 private:
  TemporaryFolder folder_;
  std::filesystem::path path_;
};

}  // namespace semvslam::testing_support
