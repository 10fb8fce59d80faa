// Says where the camera of a recording is in a saved map, frame by frame, in TUM format. The map is one that
// `semvslam run --save-map FILE` or Slam::save_map() wrote. usage: localise_in_map MAP_FILE SEQUENCE_FOLDER
#include <cstdio>

#include "semvslam/data/sequence.h"
#include "semvslam/data/trajectory_io.h"
#include "semvslam/map/map_file.h"
#include "semvslam/pipeline/slam.h"

int fail(const semvslam::Error& error) {
  std::fprintf(stderr, "%s\n", error.message.c_str());
  return 1;
}

int main(int argc, char** argv) {
  if (argc != 3) return std::fprintf(stderr, "usage: localise_in_map MAP_FILE SEQUENCE_FOLDER\n"), 2;
  auto map = semvslam::read_map(argv[1]);
  if (!map) return fail(map.error());
  auto source = semvslam::open_sequence(argv[2], {});
  if (!source) return fail(source.error());
  semvslam::Config config;
  config.mapping.frozen = true;  // false: the map grows, and save_map() keeps it
  auto slam = semvslam::Slam::create(config, (*source)->camera(), std::move(*map));
  if (!slam) return fail(slam.error());

  for (;;) {
    const auto frame = semvslam::next_readable(**source);
    if (!frame) return fail(frame.error());
    if (!*frame) break;  // the end
    const auto result = (*slam)->process(**frame);
    if (!result) return fail(result.error());
    if (result->state != semvslam::TrackingState::kTracking) continue;  // not found in the map, yet
    std::fputs(semvslam::format_pose_line({result->stamp, result->world_from_camera}).c_str(), stdout);
  }
  const auto status = (*slam)->finish();
  return status ? 0 : fail(status.error());
}
