#include "semvslam/python/arrays.h"

PYBIND11_MODULE(semvslam, m) {
  m.doc() =
      "RGB-D SLAM for scenes with people.\n\n"
      "    sequence = semvslam.Sequence('rgbd_dataset_freiburg3_walking_xyz')\n"
      "    slam = semvslam.Slam(sequence.camera)\n"
      "    for frame in sequence:\n"
      "        print(slam.process(frame).world_from_camera)\n"
      "    slam.finish()\n"
      "    slam.trajectory().write('trajectory.txt')\n\n"
      "Poses are named a_from_b: x_a = a_from_b @ x_b. Stamps are integers, nanoseconds. Errors: ValueError for input "
      "that cannot be used, FileNotFoundError, OSError, RuntimeError.";
  m.attr("__version__") = SEMVSLAM_VERSION;
  semvslam::bind_data(m);
  semvslam::bind_segmenter(m);
  semvslam::bind_slam(m);
  semvslam::bind_dense(m);
  semvslam::bind_eval(m);
}
