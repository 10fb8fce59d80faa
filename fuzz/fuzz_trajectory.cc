// Trajectory files: what is understood can be written and is understood the same again.
#include <string_view>

#include "check.h"
#include "semvslam/data/trajectory_io.h"

using namespace semvslam;

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  const Result<ParsedTrajectory> parsed = parse_trajectory({reinterpret_cast<const char*>(data), size}, "f");
  if (!parsed) {
    FUZZ_CHECK_MESSAGE(parsed.error());
    return 0;
  }
  std::string text;
  for (const StampedPose& pose : parsed->poses) {
    FUZZ_CHECK(pose.world_from_camera.is_finite());
    text += format_pose_line(pose);
  }
  const Result<ParsedTrajectory> again = parse_trajectory(text, "g");
  FUZZ_CHECK(again.ok());
  FUZZ_CHECK(again->poses.size() == parsed->poses.size());
  for (std::size_t i = 0; i < again->poses.size(); ++i) FUZZ_CHECK(again->poses[i].stamp == parsed->poses[i].stamp);
  return 0;
}
