#include "semvslam/data/camera_file.h"

#include <gmock/gmock.h>

namespace semvslam {
namespace {

using ::testing::HasSubstr;

constexpr const char* kMinimal = "width: 640\nheight: 480\nfx: 500\nfy: 501\ncx: 320\ncy: 240\n";

std::string camera_error(const std::string& text) {
  const Result<Camera> camera = parse_camera(text, "cam.yaml");
  return camera ? "" : camera.error().message;
}

/// The minimal file with one line's value replaced.
std::string with(const std::string& key, const std::string& value) {
  std::string text = kMinimal;
  const std::size_t begin = text.find(key + ":");
  return text.replace(begin, text.find('\n', begin) - begin, key + ": " + value);
}

TEST(ParseCamera, ReadsAllKeysAndDefaultsTheRest) {
  const Result<Camera> minimal = parse_camera(kMinimal, "x");
  ASSERT_TRUE(minimal.ok()) << minimal.error().message;
  EXPECT_EQ(minimal->width_px, 640);
  EXPECT_EQ(minimal->fy_px, 501);
  EXPECT_EQ(minimal->depth_units_per_m, 5000);
  EXPECT_TRUE(minimal->distortion.is_zero());
  const Result<Camera> full = parse_camera(
      std::string(kMinimal) +
          "# [comment] & more\nk1: 0.1\nk2: 0.2\np1: 0.3\np2: 0.4\nk3: 0.5\nbaseline: 0.05\nfps: 15 # Hz\n",
      "x");
  ASSERT_TRUE(full.ok()) << full.error().message;
  EXPECT_EQ(full->distortion.k1, 0.1);
  EXPECT_EQ(full->distortion.k2, 0.2);
  EXPECT_EQ(full->distortion.p1, 0.3);
  EXPECT_EQ(full->distortion.p2, 0.4);
  EXPECT_EQ(full->distortion.k3, 0.5);
  EXPECT_EQ(full->baseline_m, 0.05);
  EXPECT_EQ(full->frame_rate_hz, 15);
}

TEST(ParseCamera, KnowsThreeSpellingsOfTheDepthFactor) {
  for (const char* key : {"depth_units_per_m", "depth_factor", "depth_scale"})
    EXPECT_EQ(parse_camera(std::string(kMinimal) + key + ": 1000\n", "x")->depth_units_per_m, 1000) << key;
  EXPECT_THAT(camera_error(std::string(kMinimal) + "depth_scale: 1000\ndepth_factor: 5000\n"),
              HasSubstr("cam.yaml:8: 'depth_factor' is set a second time (first as 'depth_scale')"));
}

TEST(ParseCamera, ErrorsNameTheLineAndWhatToDo) {
  EXPECT_THAT(camera_error(std::string(kMinimal) + "basline: 0.1\n"),
              HasSubstr("cam.yaml:7: unknown key 'basline'; did you mean 'baseline'?"));
  EXPECT_THAT(camera_error("width: 640\nheight: 480\n"), HasSubstr("key 'fx' is missing"));
  EXPECT_THAT(camera_error(with("fx", "abc")), HasSubstr("cam.yaml:3: 'fx' must be a finite number"));
  EXPECT_THAT(camera_error(with("fx", ".nan")), HasSubstr("'fx' must be a finite number"));
  EXPECT_THAT(camera_error(with("fx", "nan")), HasSubstr("'fx' must be a finite number"));
  EXPECT_THAT(camera_error(with("fx", "0")), HasSubstr("focal lengths must be positive"));
  EXPECT_THAT(camera_error(with("fx", "-5")), HasSubstr("focal lengths must be positive"));
  EXPECT_THAT(camera_error(with("fy", "-480")), HasSubstr("fy is negative (-480): write 480"));
  EXPECT_THAT(camera_error(with("width", "640.5")), HasSubstr("'width' must be a whole number"));
  EXPECT_THAT(camera_error(with("width", "1")), HasSubstr("outside 16..16384"));
  EXPECT_THAT(camera_error(with("cx", "700")), HasSubstr("principal point"));
  EXPECT_THAT(camera_error("fx: [1, 2]\n"), HasSubstr("flat list"));
  EXPECT_THAT(camera_error("just words"), HasSubstr("not a list of"));
  EXPECT_THAT(camera_error("fx: b: c\n"), HasSubstr("not valid YAML"));
  EXPECT_THAT(camera_error(""), HasSubstr("not a list of"));
}

TEST(FormatCamera, IsReadBackBitForBit) {
  Camera camera = *camera_preset("bonn");
  camera.fx_px = 500.0 / 3;
  camera.baseline_m = 0.1 + 0.2;
  const Result<Camera> read = parse_camera(format_camera(camera), "x");
  ASSERT_TRUE(read.ok()) << read.error().message;
  EXPECT_EQ(read->fx_px, camera.fx_px);
  EXPECT_EQ(read->baseline_m, camera.baseline_m);
  EXPECT_EQ(read->cy_px, camera.cy_px);
  EXPECT_EQ(read->distortion.k2, camera.distortion.k2);
  EXPECT_EQ(format_camera(*read), format_camera(camera));
}

TEST(CameraPreset, AllNamesExistAndAreValid) {
  for (const std::string& name : camera_preset_names()) {
    ASSERT_TRUE(camera_preset(name)) << name;
    EXPECT_TRUE(camera_preset(name)->check().ok()) << name;
  }
  EXPECT_EQ(camera_preset("tum_fr4").error().message,
            "no built-in camera 'tum_fr4'; there are: tum_fr1, tum_fr2, tum_fr3, bonn, icl");
  EXPECT_EQ(camera_preset("tum_fr1")->distortion.k3, 1.1633);
  EXPECT_EQ(camera_preset("tum_fr2")->cx_px, 325.1);
  EXPECT_EQ(camera_preset("icl")->fy_px, 480);
}

TEST(CameraPreset, IsKnownByTheFoldersName) {
  EXPECT_EQ(camera_preset_of_folder("rgbd_dataset_freiburg1_desk"), "tum_fr1");
  EXPECT_EQ(camera_preset_of_folder("rgbd_dataset_freiburg2_xyz"), "tum_fr2");
  EXPECT_EQ(camera_preset_of_folder("rgbd_dataset_freiburg3_walking_xyz"), "tum_fr3");
  EXPECT_EQ(camera_preset_of_folder("rgbd_bonn_balloon"), "bonn");
  EXPECT_EQ(camera_preset_of_folder("fr3_sitting_rpy"), "tum_fr3");
  EXPECT_EQ(camera_preset_of_folder("living_room_traj0_frei_png"), "icl");
  EXPECT_EQ(camera_preset_of_folder("kitchen"), "");
  EXPECT_EQ(camera_preset_of_folder("fr4_kitchen"), "");
  EXPECT_EQ(camera_preset_of_folder("afr3_kitchen"), "");
}

}  // namespace
}  // namespace semvslam
