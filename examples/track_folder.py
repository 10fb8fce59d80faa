"""Tracks a recording, scores it where it has a ground truth, and writes trajectory and map.
usage: ./semvslam python examples/track_folder.py SEQUENCE_FOLDER OUT_FOLDER"""
import pathlib
import sys

import semvslam

sequence = semvslam.Sequence(sys.argv[1])
out = pathlib.Path(sys.argv[2])
out.mkdir(parents=True, exist_ok=True)

# A live camera has no Sequence: semvslam.Camera(...) or .preset(...), realtime=True, and for each picture
# semvslam.Frame(stamp_ns, rgb, depth).
slam = semvslam.Slam(sequence.camera)
for frame, segmentation in slam.ahead(sequence):
    result = slam.process(frame, segmentation)
    x, y, z = result.world_from_camera[:3, 3]
    print(f"{frame.stamp_ns / 1e9:.3f} s {result.state}: ({x:.3f}, {y:.3f}, {z:.3f}) m, {result.inliers} inliers")
slam.finish()

trajectory, key_frames = slam.trajectory(), slam.key_frames()
trajectory.write(out / "trajectory.txt")
try:
    score = semvslam.evaluate(sequence.ground_truth(), trajectory)
    print(f"ATE RMSE {1000 * score['ate_m']['rmse']:.2f} mm, tracked {100 * score['tracked_share']:.1f} %")
except FileNotFoundError:
    print("no ground truth, no score")

poses = dict(zip(key_frames.stamps_ns.tolist(), key_frames.world_from_camera))
moving = dict(slam.key_frame_masks())
dense = semvslam.DenseMap(sequence.camera)
for frame in semvslam.Sequence(sys.argv[1]):
    if frame.stamp_ns in poses:
        dense.add(frame, poses[frame.stamp_ns], moving[frame.stamp_ns])
dense.write(out / "map.ply")
