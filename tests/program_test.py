#!/usr/bin/env python3
"""Tests of the program from outside: commands, exit codes, results, interrupts, bad input, a full disk.
usage: program_test.py PROGRAM [unittest options]"""
import filecmp
import json
import os
import resource
import shutil
import signal
import subprocess
import time
import unittest

from program_testing import PROGRAM, ProgramCase, call, poses

RESULTS = {"trajectory.txt", "keyframes.txt", "map.ply", "stats.json", "config.yaml", "run.log"}


def wait_for(condition, seconds=60):
    """Tests may wait by looking again and again; the program may not."""
    end = time.monotonic() + seconds
    while not condition():
        if time.monotonic() > end:
            raise TimeoutError("nothing happened")
        time.sleep(0.02)


class ProgramTest(ProgramCase):
    FRAMES = 90

    def test_version_and_help(self):
        self.assertRegex(call("version").stdout, r"^semvslam \d+\.\d+\.\d+\n$")
        done = call("help")
        self.assertEqual(0, done.returncode)
        for command in ("run", "eval", "demo", "render", "config"):
            self.assertIn(command, done.stdout)
        self.assertEqual(2, call().returncode)

    def test_wrong_command_lines(self):
        self.expect_error(call("runn"), 2, "unknown command 'runn'", "'run'")
        self.expect_error(call("run", self.whole), 2, "--out")
        self.expect_error(call("run", self.whole, "--out", self.out, "--max-frames", "-3"), 2, "--max-frames", "not in range 1 to")

    def test_config_is_read_back(self):
        text = call("config").stdout
        file = self.folder / "all.yaml"
        file.write_text(text)
        done = call("run", self.whole, "--out", self.out, "--config", file, "--max-frames", 3, "--quiet")
        self.assertEqual(0, done.returncode, done.stderr)
        self.assertEqual(text, (self.out / "config.yaml").read_text())

    def test_run_writes_everything_and_is_accurate(self):
        done = call("run", self.whole, "--out", self.out)
        self.assertEqual(0, done.returncode, done.stderr)
        self.assertLessEqual(RESULTS | {"evaluation.json", "evaluation.svg"}, set(os.listdir(self.out)))
        stats = json.loads((self.out / "stats.json").read_text())
        self.assertEqual("complete", stats["end"])
        self.assertEqual(90, stats["frames"])
        self.assertEqual(90, stats["tracked"])
        self.assertLess(0, stats["stages_ms"]["tracking"]["p95"])
        evaluation = json.loads((self.out / "evaluation.json").read_text())
        # The camera moves by decimetres: 1 cm is above the noise of this small picture and far below a fault.
        self.assertLess(evaluation["estimate"]["ate_m"]["rmse"], 0.01)
        ply = (self.out / "map.ply").read_bytes()
        header, body = ply.split(b"end_header\n", 1)
        count = int(header.split(b"element vertex ")[1].split()[0])
        self.assertEqual(stats["landmarks"], count)
        self.assertEqual(12 * count, len(body))

    def test_a_dense_map_is_made_on_request(self):
        cloud, octree = self.folder / "new" / "cloud.pcd", self.folder / "other" / "room.bt"
        done = call("run", "--dense-map", cloud, "--dense-map", octree, self.whole, "--out", self.out, "--max-frames", 20,
                    "--quiet")
        self.assertEqual(0, done.returncode, done.stderr)
        header, body = cloud.read_bytes().split(b"DATA binary\n", 1)
        count = int(header.split(b"POINTS ")[1].split()[0])
        self.assertLess(5000, count)
        self.assertIn(b"FIELDS x y z rgb label\n", header)
        self.assertEqual(20 * count, len(body))
        self.assertIn(f"dense map {count} points", done.stdout)
        self.assertTrue(octree.read_bytes().startswith(b"# Octomap OcTree binary file\n"))
        self.assertRegex(done.stdout, r"its octree \d+ cubes occupied, \d+ free\n")
        self.assertFalse((self.out / "dense.ply").exists())

    def test_deterministic_runs_are_equal(self):
        runs = [self.out / name for name in ("a", "b")]
        maps = ("dense.ply", "dense.ot")
        dense = lambda run: [word for name in maps for word in ("--dense-map", run / name)]
        self.assertEqual(0, call("run", self.whole, "--out", runs[0], "--deterministic", "--quiet",
                                 *dense(runs[0])).returncode)
        # The second one on a single processor: the order of threads must not matter either.
        one = {min(os.sched_getaffinity(0))}
        self.assertEqual(0, call("run", self.whole, "--out", runs[1], "--deterministic", "--quiet",
                                 *dense(runs[1]),
                                 preexec_fn=lambda: os.sched_setaffinity(0, one)).returncode)
        for name in ("trajectory.txt", "keyframes.txt", "map.ply", *maps):
            self.assertTrue(filecmp.cmp(runs[0] / name, runs[1] / name, shallow=False), name)

    def test_max_frames(self):
        self.assertEqual(0, call("run", self.whole, "--out", self.out, "--max-frames", 7, "--quiet").returncode)
        self.assertEqual(7, json.loads((self.out / "stats.json").read_text())["frames"])

    def test_configuration_errors(self):
        run = ("run", self.whole, "--out", self.out)
        self.expect_error(call(*run, "--set", "orb.featurs=5"), 3, "unknown key 'orb.featurs'", "orb.features")
        self.expect_error(call(*run, "--set", "orb.features=many"), 3, "integer")
        file = self.folder / "bad.yaml"
        file.write_text("orb:\n  features: -1\n")
        self.expect_error(call(*run, "--config", file), 3, "bad.yaml:2", "orb.features")
        self.expect_error(call(*run, "--config", self.folder / "none.yaml"), 3, "none.yaml")
        self.expect_error(call(*run, "--mode", "magic"), 3, "--mode: mode must be one of orb,", "'magic'")
        self.expect_error(call(*run, "--masks", "nowhere"), 3, "nowhere: no such folder")
        self.expect_error(call(*run, "--truth-masks", "nowhere"), 3, "nowhere: no such folder")
        self.expect_error(call(*run, "--dense-map", "cloud.xyz"), 3, "cloud.xyz", ".ply or .pcd", ".bt or .ot")
        self.expect_error(call(*run, "--set", "dense.max_depth_m=0.2"), 3, "dense.min_depth_m = 0.3")

    def test_missing_and_empty_sequences(self):
        self.expect_error(call("run", self.folder / "nothing", "--out", self.out), 3, "nothing")
        empty = self.folder / "empty"
        empty.mkdir()
        self.expect_error(call("run", empty, "--out", self.out), 3, "empty")

    def test_unusable_frames_are_skipped_and_counted(self):
        copy = self.copy_of_whole()
        images = sorted((copy / "rgb").iterdir())
        images[20].write_bytes(images[20].read_bytes()[:1000])  # truncated
        images[30].unlink()
        depths = sorted((copy / "depth").iterdir())
        shutil.copy(images[40], depths[40])  # wrong bit depth
        done = call("run", copy, "--out", self.out)
        self.assertEqual(0, done.returncode, done.stderr)
        stats = json.loads((self.out / "stats.json").read_text())
        self.assertEqual(3, stats["skipped"])
        self.assertEqual(87, stats["tracked"])
        self.assertEqual(3, (self.out / "run.log").read_text().count("skipped:"))

    def test_input_that_breaks_off(self):
        copy = self.copy_of_whole()
        text = (copy / "rgb.txt").read_text()
        (copy / "rgb.txt").write_text(text[:len(text) // 2])
        done = call("run", copy, "--out", self.out)
        self.assertEqual(0, done.returncode, done.stderr)
        self.assertLess(20, json.loads((self.out / "stats.json").read_text())["tracked"])

    def test_output_that_is_no_folder(self):
        self.out.write_text("a file")
        self.expect_error(call("run", self.whole, "--out", self.out), 4, self.out.name)

    def there_and_back(self, times):
        """The sequence forth, back, forth...: as long as one likes, with no more pictures."""
        copy = self.copy_of_whole()
        for name in ("rgb.txt", "depth.txt"):
            lines = [line.split() for line in (copy / name).read_text().splitlines() if not line.startswith("#")]
            files = [file for _, file in lines]
            walk = [file for i in range(times) for file in (files if i % 2 == 0 else files[::-1])]
            first = float(lines[0][0])
            (copy / name).write_text("".join(f"{first + i / 30:.6f} {file}\n" for i, file in enumerate(walk)))
        return copy

    def test_full_disk(self):
        size = len(call("config").stdout) + 500  # enough to start, but not for the poses of 270 frames
        self.assertLess(size, 270 * 70)
        sequence = self.there_and_back(3)

        def limit():  # files may not grow beyond this, as on a full disk
            signal.signal(signal.SIGXFSZ, signal.SIG_IGN)
            resource.setrlimit(resource.RLIMIT_FSIZE, (size, size))

        done = call("run", sequence, "--out", self.out, "--mode", "orb", preexec_fn=limit, restore_signals=False)
        self.expect_error(done, 4)
        lines = (self.out / "trajectory.txt").read_text().splitlines()
        self.assertLess(20, len(lines))
        for line in lines[1:]:
            self.assertEqual(8, len(line.split()), "a line that breaks off")

    def test_standard_output_that_is_full(self):
        if not os.path.exists("/dev/full"):
            self.skipTest("this system has no /dev/full")
        truth = self.whole / "groundtruth.txt"
        with open("/dev/full", "w", encoding="ascii") as full:
            self.expect_error(call("eval", truth, truth, stdout=full), 4, "standard output")
            self.expect_error(call("config", stdout=full), 4, "standard output")

    def test_a_dense_map_on_a_full_disk(self):
        if not os.path.exists("/dev/full"):
            self.skipTest("this system has no /dev/full")
        full, other = self.folder / "full.bt", self.folder / "other.ply"
        full.symlink_to("/dev/full")
        self.expect_error(call("run", self.whole, "--out", self.out, "--mode", "orb", "--max-frames", 5, "--quiet",
                               "--dense-map", full, "--dense-map", other), 4, "full.bt")
        self.assertTrue(other.exists(), "what can be written is")

    def test_demo_says_at_once_that_it_cannot_write(self):
        caches = {**os.environ, "XDG_CACHE_HOME": str(self.folder / "cache")}
        self.expect_error(call("demo", "--out", "/dev/null/results", env=caches), 4, "/dev/null/results")
        self.assertFalse((self.folder / "cache").exists())

    def start_slow_run(self):
        """A run at the camera's pace, three seconds long, with its trajectory growing."""
        process = subprocess.Popen([PROGRAM, "run", self.whole, "--out", self.out, "--realtime"],
                                   stdout=subprocess.PIPE, stderr=subprocess.PIPE)
        self.addCleanup(process.stdout.close)
        self.addCleanup(process.stderr.close)
        trajectory = self.out / "trajectory.txt"
        wait_for(lambda: trajectory.exists() and trajectory.read_text().count("\n") > 5)
        return process

    def test_interrupts_end_cleanly(self):
        for number in (signal.SIGINT, signal.SIGTERM):
            process = self.start_slow_run()
            process.send_signal(number)
            process.communicate(timeout=60)
            self.assertEqual(128 + number, process.returncode)
            self.assertLessEqual(RESULTS, set(os.listdir(self.out)))
            stats = json.loads((self.out / "stats.json").read_text())
            self.assertIn("interrupted", stats["end"])
            self.assertGreater(stats["tracked"], 3)
            shutil.rmtree(self.out)

    def test_interrupted_rendering_leaves_nothing_half_done(self):
        process = subprocess.Popen([PROGRAM, "render", "--out", self.out, "--frames", "10000", "--size", "64x48"],
                                   stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)
        unfinished = self.out.with_name(self.out.name + ".part") / "rgb"
        wait_for(lambda: unfinished.exists() and any(unfinished.iterdir()))
        process.send_signal(signal.SIGINT)
        _, errors = process.communicate(timeout=60)
        self.assertEqual(128 + signal.SIGINT, process.returncode)
        self.assertIn("semvslam: error: interrupted after ", errors)
        self.assertFalse(self.out.exists() or unfinished.parent.exists())

    def test_kill_leaves_what_was_tracked(self):
        process = self.start_slow_run()
        wait_for(lambda: (self.out / "map.ply").exists())
        process.kill()
        process.communicate(timeout=60)
        self.assertLess(0, len(poses(self.out / "keyframes.txt")))
        lines = (self.out / "trajectory.txt").read_text().splitlines()
        self.assertLess(5, len(lines))
        self.assertEqual({8}, {len(line.split()) for line in lines[1:]})
        self.assertEqual("running", json.loads((self.out / "stats.json").read_text())["end"])

    def test_eval_bad_input(self):
        truth = self.whole / "groundtruth.txt"
        lines = truth.read_text().splitlines()

        def file(name, content):
            path = self.folder / name
            path.write_text(content)
            return path

        self.expect_error(call("eval", truth, self.folder / "none.txt"), 3, "none.txt")
        self.expect_error(call("eval", file("one.txt", "1 0 0 0 0 0 0 1\n"), truth), 3, "one.txt", "1 pose;")
        self.expect_error(call("eval", file("nan.txt", "\n".join(lines[:5]) + "\n9 nan 0 0 0 0 0 1\n"), truth), 3, "nan.txt:6")
        self.expect_error(call("eval", file("zero.txt", "1 0 0 0 0 0 0 0\n"), truth), 3, "zero.txt:1")
        far = "".join(f"{1000 + i} {i} {i * i} 0 0 0 0 1\n" for i in range(5))
        self.expect_error(call("eval", truth, file("far.txt", far)), 3, "no pose of the estimate")
        self.expect_error(call("eval", truth, truth, "--delta", "1h"), 3, "delta")
        self.expect_error(call("eval", truth, truth, "--aligned-as", truth), 2, "--aligned-as")
        self.expect_error(call("eval", truth, truth, "--aligned-as", truth, self.folder / "none.txt"), 3, "none.txt")
        self.expect_error(call("eval", truth, truth, "--plot", self.folder / "no" / "x.svg"), 3, "x.svg")
        unsorted = file("unsorted.txt", "\n".join([lines[0]] + lines[:0:-1]) + "\n")
        done = call("eval", truth, unsorted, "--json", "-")
        self.assertLess(json.loads(done.stdout)["estimate"]["ate_m"]["max"], 1e-6)


if __name__ == "__main__":
    unittest.main()
