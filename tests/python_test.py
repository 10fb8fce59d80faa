#!/usr/bin/env python3
"""The Python module from outside: it does what the program does, and takes and gives arrays.
usage: python_test.py PROGRAM PICTURE_WITH_PEOPLE [unittest options]     with the module's folder in PYTHONPATH"""
import concurrent.futures
import json
import pathlib
import subprocess
import sys
import unittest

try:
    import numpy as np
    import semvslam
except ImportError as missing:
    print(f"skipped: {missing}")
    sys.exit(77)

from program_testing import HEIGHT, WIDTH, ProgramCase, call, png

PEOPLE = pathlib.Path(sys.argv.pop(1)).resolve()


class PythonTest(ProgramCase):
    def sequence(self, **options):
        return semvslam.Sequence(self.whole, **options)

    def track(self, mode="orb", **options):
        sequence = self.sequence()
        slam = semvslam.Slam(sequence.camera, mode, deterministic=True, **options)
        results = [slam.process(frame) for frame in sequence]
        slam.finish()
        return slam, results

    def test_same_poses_as_the_program(self):
        for mode in ("orb", "motion"):
            done = call("run", self.whole, "--out", self.out, "--mode", mode, "--deterministic")
            self.assertEqual(0, done.returncode, done.stderr)
            slam, results = self.track(mode)
            slam.trajectory().write(self.out / "python.txt")
            self.assertEqual((self.out / "trajectory.txt").read_bytes(), (self.out / "python.txt").read_bytes(), mode)
            self.assertEqual(["tracking"] * (self.FRAMES - 1), [r.state for r in results[1:]])
            stats, ours = json.loads((self.out / "stats.json").read_text()), slam.statistics()
            self.assertEqual([stats["key_frames"], stats["landmarks"]], [ours["key_frames"], ours["landmarks"]])
            self.assertEqual((ours["landmarks"], 3), slam.landmarks().shape)
            self.assertEqual(len(slam.key_frames()), sum(r.is_key_frame for r in results))

    def test_evaluation_is_that_of_the_program(self):
        slam, _ = self.track()
        estimate = self.folder / "estimate.txt"
        slam.trajectory().write(estimate)
        done = call("eval", self.whole / "groundtruth.txt", estimate, "--delta", "5f", "--json", "-")
        self.assertEqual(0, done.returncode, done.stderr)
        score = semvslam.evaluate(self.sequence().ground_truth(), semvslam.Trajectory.read(estimate), delta="5f")
        theirs = json.loads(done.stdout)["estimate"]
        for key in ("tracked_share", "ate_m", "rpe_translation_m", "rpe_rotation_deg"):
            self.assertEqual(theirs[key], score[key])
        self.assertLess(score["ate_m"]["rmse"], 0.01)

    def test_frames_from_arrays_are_tracked_like_those_from_files(self):
        sequence = self.sequence()
        slam = semvslam.Slam(sequence.camera, "orb", deterministic=True)
        units = sequence.camera.depth_units_per_m
        for frame in sequence:
            slam.process(semvslam.Frame(frame.stamp_ns, frame.gray, (frame.depth / units).astype(np.float32)))
        slam.finish()
        files, arrays = self.track()[0].trajectory(), slam.trajectory()
        np.testing.assert_array_equal(files.stamps_ns, arrays.stamps_ns)
        np.testing.assert_allclose(files.world_from_camera, arrays.world_from_camera, atol=2e-3)

    def test_arrays_keep_their_pixels(self):
        rgb = np.random.default_rng(1).integers(0, 256, (HEIGHT, WIDTH, 3), np.uint8)
        depth = np.arange(HEIGHT * WIDTH, dtype=np.uint16).reshape(HEIGHT, WIDTH)
        frame = semvslam.Frame(7, rgb[::-1, ::-1], np.asfortranarray(depth))  # whatever the strides
        np.testing.assert_array_equal(rgb[::-1, ::-1], frame.rgb)
        np.testing.assert_array_equal(depth, frame.depth)
        self.assertEqual((HEIGHT, WIDTH), frame.gray.shape)
        weights = rgb[::-1, ::-1] @ [0.299, 0.587, 0.114]  # ITU-R BT.601
        self.assertLess(np.abs(weights - frame.gray).max(), 1.01)
        view = frame.rgb
        del frame
        np.testing.assert_array_equal(rgb[::-1, ::-1], view)  # it keeps what it shows
        with self.assertRaises(ValueError):
            view[0, 0, 0] = 1
        self.assertIsNone(semvslam.Frame(7, rgb, None).depth)

    def test_trajectories_from_arrays(self):
        poses = np.stack([np.eye(4)] * 3)
        poses[:, 0, 3] = [1, 2, 3]
        trajectory = semvslam.Trajectory([10, 20, 30], poses)
        np.testing.assert_array_equal(poses, trajectory.world_from_camera)
        self.assertEqual([10, 20, 30], trajectory.stamps_ns.tolist())
        for stamps, wrong in (([10, 10, 30], poses), ([10, 20], poses), ([10, 20, 30], poses * 2), ([10, 20, 30], poses * np.nan)):
            with self.assertRaises(ValueError):
                semvslam.Trajectory(stamps, wrong)

    def test_a_saved_map_is_localised_in(self):
        slam, _ = self.track()
        slam.save_map(self.folder / "room.map")
        self.assertEqual(slam.statistics()["key_frames"],
                         json.loads(call("map", "info", self.folder / "room.map", "--json", "-").stdout)["key_frames"])
        later, results = self.track(map=self.folder / "room.map", localise=True)
        self.assertEqual(0, later.statistics()["key_frames"] - later.statistics()["loaded_key_frames"])
        self.assertGreater(sum(r.state == "tracking" for r in results), self.FRAMES - 5)
        with self.assertRaisesRegex(ValueError, "no saved map"):
            semvslam.Slam(self.sequence().camera, localise=True)

    def test_the_example(self):
        done = subprocess.run([sys.executable, pathlib.Path(__file__).parents[1] / "examples" / "track_folder.py", self.whole, self.out],
                              capture_output=True, text=True, check=False)
        self.assertEqual(0, done.returncode, done.stderr)
        self.assertRegex(done.stdout, r"ATE RMSE \d.\d\d mm, tracked 100.0 %")
        self.assertEqual(self.FRAMES, len(semvslam.Trajectory.read(self.out / "trajectory.txt")))
        self.assertTrue((self.out / "map.ply").exists())

    def test_dense_map(self):
        slam, _ = self.track()
        key_frames, frames = slam.key_frames(), {frame.stamp_ns: frame for frame in self.sequence()}
        masks = slam.key_frame_masks()
        dense = semvslam.DenseMap(self.sequence().camera, values={"dense.voxel_m": 0.02})
        for stamp, pose, (stamp_of_mask, moving) in zip(key_frames.stamps_ns.tolist(), key_frames.world_from_camera, masks):
            self.assertEqual(stamp, stamp_of_mask)
            dense.add(frames[stamp], pose, moving)
        xyz, rgb = dense.points()
        self.assertGreater(len(xyz), 1000)
        self.assertEqual(xyz.shape, rgb.shape)
        dense.write(self.folder / "room.ply")
        self.assertIn(b"element vertex %d\n" % len(xyz), (self.folder / "room.ply").read_bytes())
        with self.assertRaisesRegex(ValueError, "room.obj"):
            dense.write(self.folder / "room.obj")

    def test_people_are_segmented_ahead_of_tracking_on_other_threads(self):
        photos = self.folder / "photos"
        (photos / "rgb").mkdir(parents=True)
        (photos / "depth").mkdir()
        for k in range(3):
            (photos / "rgb" / f"{k}.jpg").symlink_to(PEOPLE)
            (photos / "depth" / f"{k}.png").write_bytes(png(640, 480, 16))
        camera = semvslam.Camera(width_px=640, height_px=480, fx_px=500, fy_px=500, cx_px=320, cy_px=240)
        (self.folder / "photos.yaml").write_text("width: 640\nheight: 480\nfx: 500\nfy: 500\ncx: 320\ncy: 240\n")
        frames = list(semvslam.Sequence(photos, camera_file=self.folder / "photos.yaml"))
        slam = semvslam.Slam(camera, "masks", values={"segment.precision": "f32"})
        with concurrent.futures.ThreadPoolExecutor(2) as pool:
            ahead = list(pool.map(slam.segment, frames))
        for frame, segmentation in zip(frames, ahead):
            self.assertEqual(segmentation.mask_of("person").sum(), ahead[0].mask_of("person").sum())
            self.assertEqual("segmented", slam.process(frame, segmentation).mask_source)
        found = semvslam.Segmenter(precision="f32").segment(frames[0].rgb)
        best = found.instances[0]
        self.assertEqual(("person", "dynamic"), (best["class"], best["role"]))
        self.assertGreater(best["score"], 0.55)
        x0, y0, x1, y1 = best["box"]
        rows, columns = np.nonzero(best["mask"])
        self.assertEqual((480, 640), best["mask"].shape)
        self.assertTrue(x0 - 8 <= columns.min() and columns.max() <= x1 + 8 and y0 - 8 <= rows.min() and rows.max() <= y1 + 8)

    def test_a_recording_is_read_and_segmented_ahead(self):
        for mode in ("orb", "masks"):
            sequence = self.sequence()
            slam = semvslam.Slam(sequence.camera, mode)
            ahead = slam.ahead(sequence)
            for count, (frame, segmentation) in enumerate(ahead, 1):
                self.assertEqual(mode == "masks", segmentation is not None)
                self.assertEqual("tracking", slam.process(frame, segmentation).state)
            self.assertEqual(self.FRAMES, count)
            slam.finish()
            self.assertEqual(self.FRAMES, len(slam.trajectory()))
            for misuse in (lambda: next(sequence), lambda: slam.ahead(sequence)):
                with self.assertRaisesRegex(ValueError, "read ahead"):
                    misuse()
        sequence = self.sequence()
        next(iter(semvslam.Slam(sequence.camera, "masks").ahead(sequence)))  # left in the middle: its threads end

    def test_process_and_finish_from_many_threads_take_turns(self):
        sequence = self.sequence()
        frames = list(sequence)
        slam = semvslam.Slam(sequence.camera, "orb")
        with concurrent.futures.ThreadPoolExecutor(4) as pool:
            done = [pool.submit(slam.process, frame) for frame in frames]
            asked = [pool.submit(slam.trajectory) for _ in frames]
        refused = [f for f in done if f.exception()]  # came after a later frame
        for f in refused:
            self.assertIsInstance(f.exception(), ValueError)
            self.assertIn("not later", str(f.exception()))
        self.assertEqual(len(frames) - len(refused), slam.statistics()["frames"])
        self.assertTrue(all(len(f.result()) <= len(frames) for f in asked))
        slam.finish()
        slam.finish()

    def test_what_cannot_be_used_raises(self):
        sequence = self.sequence()
        camera, frame = sequence.camera, next(sequence)
        slam = semvslam.Slam(camera, "orb")
        slam.process(frame)
        grey = np.zeros((HEIGHT, WIDTH), np.uint8)
        for error, words, act in (
            (ValueError, "not later than that of the frame before", lambda: slam.process(frame)),
            (ValueError, "320x240, it is 10x10", lambda: slam.process(semvslam.Frame(1 << 60, grey[:10, :10], None))),
            (ValueError, r"it is float64 \[3, 4\]", lambda: semvslam.Frame(1, np.zeros((3, 4)), None)),
            (ValueError, r"rgb .* it is uint8 \[3, 4, 4\]", lambda: semvslam.Frame(1, np.zeros((3, 4, 4), np.uint8), None)),
            (ValueError, r"depth .* it is int64 \[240, 320\]", lambda: semvslam.Frame(1, grey, grey.astype(np.int64))),
            (ValueError, r"rgb .* it is uint8 \[0, 5\]", lambda: semvslam.Frame(1, np.zeros((0, 5), np.uint8), None)),
            (ValueError, "nearest known one is 'orb.features'", lambda: semvslam.Slam(camera, values={"orb.feature": 1})),
            (ValueError, "maks", lambda: semvslam.Slam(camera, "maks")),
            (ValueError, "tum_fr3", lambda: semvslam.Camera.preset("tum_fr9")),
            (ValueError, "", lambda: semvslam.Camera(width_px=1, height_px=1, fx_px=1, fy_px=1, cx_px=0, cy_px=0)),
            (ValueError, "parsecs", lambda: semvslam.evaluate(sequence.ground_truth(), sequence.ground_truth(), delta="3 parsecs")),
            (FileNotFoundError, "nowhere", lambda: semvslam.Sequence(self.folder / "nowhere")),
            (FileNotFoundError, "nowhere", lambda: semvslam.Slam(camera, map=self.folder / "nowhere")),
            (FileNotFoundError, "nowhere", lambda: semvslam.Segmenter(model=self.folder / "nowhere")),
            (TypeError, "", lambda: semvslam.Sequence(3)),
            (TypeError, "", lambda: slam.ahead([])),
        ):
            with self.assertRaisesRegex(error, words):
                act()
        self.assertEqual(1, slam.statistics()["frames"])
        slam.finish()
        with self.assertRaisesRegex(ValueError, "finished"):
            slam.process(semvslam.Frame(1 << 60, grey, None))


if __name__ == "__main__":
    unittest.main()
