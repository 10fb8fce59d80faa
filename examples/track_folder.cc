// Tracks a recording and prints the trajectory in TUM format. usage: track_folder SEQUENCE_FOLDER
#include <cstdio>

#include "semvslam/data/sequence.h"
#include "semvslam/data/trajectory_io.h"
#include "semvslam/pipeline/slam.h"

int fail(const semvslam::Error& error) {
  std::fprintf(stderr, "%s\n", error.message.c_str());
  return 1;
}

int main(int argc, char** argv) {
  if (argc != 2) return std::fprintf(stderr, "usage: track_folder SEQUENCE_FOLDER\n"), 2;
  auto source = semvslam::open_sequence(argv[1], {});
  if (!source) return fail(source.error());
  auto slam = semvslam::Slam::create(semvslam::Config{}, (*source)->camera());
  if (!slam) return fail(slam.error());

  for (;;) {
    const auto frame = semvslam::next_readable(**source);
    if (!frame) return fail(frame.error());
    if (!*frame) break;  // the end
    const auto result = (*slam)->process(**frame);
    if (!result) return fail(result.error());
  }
  if (const auto status = (*slam)->finish(); !status) return fail(status.error());
  for (const auto& pose : (*slam)->trajectory()) std::fputs(semvslam::format_pose_line(pose).c_str(), stdout);
  return 0;
}
