#!/usr/bin/env python3
"""`semvslam bench` from outside: a tiny rendered suite, its files, going on after an interrupt, failed runs, broken limits.
usage: bench_test.py PROGRAM [unittest options]"""
import csv
import html.parser
import json
import os
import pathlib
import shutil
import signal
import subprocess
import tempfile
import time
import unittest

from program_testing import PROGRAM, ErrorLineCase, call

SUITE = """about: the least that tracks
modes: [orb, motion]
runs: 2
rpe_delta: 10f
sequences:
  - {people: none, motion: xyz, frames: 30, size: 320x240}
  - {people: sitting, motion: static, frames: 30, size: 320x240, seed: 2}
"""
RESULTS = ("results.json", "results.csv", "tables.md", "report.html")


class Page(html.parser.HTMLParser):
    """What a page is made of, and whether its tags are closed in turn."""
    VOID = {"meta", "rect", "line", "path", "br"}

    def __init__(self, text):
        super().__init__()
        self.tags, self.open = {}, []
        self.feed(text)
        self.close()

    def handle_starttag(self, tag, attributes):
        self.tags[tag] = self.tags.get(tag, 0) + 1
        if tag not in self.VOID:
            self.open.append(tag)

    def handle_startendtag(self, tag, attributes):
        self.tags[tag] = self.tags.get(tag, 0) + 1

    def handle_endtag(self, tag):
        assert self.open and self.open.pop() == tag, tag


class BenchTest(ErrorLineCase):
    @classmethod
    def setUpClass(cls):
        cls.folder = pathlib.Path(tempfile.mkdtemp(prefix="semvslam_test_"))
        cls.environment = {**os.environ, "XDG_CACHE_HOME": str(cls.folder / "cache")}
        cls.suite = cls.folder / "tiny.yaml"
        cls.suite.write_text(SUITE)

    @classmethod
    def tearDownClass(cls):
        shutil.rmtree(cls.folder)

    def setUp(self):
        self.out = self.folder / (self.id().rsplit(".", 1)[-1] + "_out")

    def bench(self, *arguments):
        return call("bench", *arguments, "--out", self.out, env=self.environment)

    def rows(self):
        with open(self.out / "results.csv", encoding="utf-8", newline="") as file:
            return list(csv.DictReader(file))

    def scene_folder(self, people):
        return next((self.folder / "cache" / "semvslam").glob(f"scene_*_{people}_*"))

    def test_tables_report_and_no_run_twice(self):
        done = self.bench(self.suite)
        self.assertEqual(0, done.returncode, done.stderr)
        self.assertIn("[8/8] sitting_static, motion, run 2: ATE", done.stderr)
        self.assertIn("## Summary", done.stdout)
        rows = self.rows()
        self.assertEqual(8, len(rows))
        self.assertEqual([("none_xyz", "orb", "1"), ("none_xyz", "motion", "1"), ("none_xyz", "orb", "2")],
                         [(r["sequence"], r["mode"], r["run"]) for r in rows[:3]])
        for row in rows:
            self.assertEqual("", row["failure"])
            self.assertEqual("30", row["frames"])
            self.assertLess(0, float(row["ate_rmse_m"]))
            self.assertLess(0, float(row["tracking_mean_ms"]))
        results = json.loads((self.out / "results.json").read_text())
        self.assertEqual(8, len(results["runs"]))
        self.assertEqual(4, len(results["summary"]))
        self.assertEqual("orb", results["baseline"])
        self.assertIn("processor", results["facts"])
        self.assertEqual(rows[0]["ate_rmse_m"], repr(results["runs"][0]["numbers"]["ate_rmse_m"]))
        page = Page((self.out / "report.html").read_text())
        self.assertEqual([], page.open)
        self.assertEqual(6 + 2 * 2, page.tags["svg"])  # bars; trajectories and errors over time of two sequences
        self.assertNotIn("script", page.tags)
        self.assertEqual({"trajectory.txt", "stats.json", "evaluation.json", "config.yaml", "run.log", "output.log", "bench_run.json"},
                         set(os.listdir(self.out / "runs/none_xyz/orb/1")))

        before = {file: file.stat().st_mtime_ns for file in self.out.glob("runs/*/*/*/trajectory.txt")}
        again = self.bench(self.suite)
        self.assertEqual(0, again.returncode, again.stderr)
        self.assertEqual(8, again.stderr.count("(kept)"))
        self.assertEqual(rows, self.rows())
        self.assertEqual(before, {file: file.stat().st_mtime_ns for file in self.out.glob("runs/*/*/*/trajectory.txt")})
        other = self.bench(self.suite, "--set", "orb.features=600", "--modes", "orb", "--runs", "1")
        self.assertEqual(0, other.returncode, other.stderr)
        self.assertEqual(0, other.stderr.count("(kept)"))
        self.assertEqual(2, len(self.rows()))

    def test_an_interrupt_keeps_what_is_done_and_the_next_call_goes_on(self):
        command = [PROGRAM, "bench", self.suite, "--runs", "9", "--out", self.out]
        process = subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True, env=self.environment)
        end = time.monotonic() + 120
        while not any(self.out.glob("runs/*/*/2/bench_run.json")):
            self.assertLess(time.monotonic(), end)
            self.assertIsNone(process.poll())
            time.sleep(0.01)
        process.send_signal(signal.SIGINT)
        _, errors = process.communicate(timeout=60)
        self.assertEqual(128 + signal.SIGINT, process.returncode, errors)
        done = len(self.rows())
        self.assertTrue(3 <= done < 36, done)
        self.assertTrue(all(row["failure"] == "" for row in self.rows()), "an interrupted run is no failure")
        for name in RESULTS:
            self.assertTrue((self.out / name).exists(), name)
        self.assertIn(f"Interrupted after {done} of 36 runs", (self.out / "report.html").read_text())
        finished = self.bench(self.suite, "--runs", "9")
        self.assertEqual(0, finished.returncode, finished.stderr)
        self.assertEqual(done, finished.stderr.count("(kept)"))
        self.assertEqual(36, len(self.rows()))

    def test_a_run_that_fails_is_a_line_in_the_tables(self):
        self.assertEqual(0, self.bench(self.suite, "--modes", "orb", "--runs", "1").returncode)
        good, bad = self.folder / "walk", self.folder / "<b>ad"
        shutil.copytree(self.scene_folder("none"), good)
        shutil.copytree(good, bad)
        for image in (bad / "rgb").iterdir():
            image.write_bytes(b"no picture")
        done = self.bench(bad, good, "--modes", "orb", "--no-truth-masks")
        self.assertEqual(1, done.returncode, done.stderr)
        rows = self.rows()
        self.assertEqual([True, False], [row["failure"] != "" for row in rows])
        self.assertIn("exit code 3: ", rows[0]["failure"])
        self.assertIn("Failed runs: 1 of 2", (self.out / "report.html").read_text())
        self.assertNotIn("<b>", (self.out / "report.html").read_text())

    def test_a_broken_limit_is_named(self):
        suite = self.folder / "limits.yaml"
        suite.write_text(SUITE + "limits: {mode: orb, ate_rmse_m: 0.000001}\n")
        done = self.bench(suite, "--runs", "1")
        self.assertEqual(1, done.returncode, done.stderr)
        self.assertIn("## Broken limits", done.stdout)
        broken = json.loads((self.out / "results.json").read_text())["broken_limits"]
        self.assertEqual(2, len(broken))
        self.assertIn("none_xyz in mode orb, run 1: ate_rmse_m is ", broken[0])

    def test_what_cannot_be_run_is_said_in_one_line(self):
        self.expect_error(self.bench(), 2, "SUITE")
        self.expect_error(self.bench("rendred"), 3, "'rendred'", "rendered, modes, accuracy, tum")
        self.expect_error(self.bench("tum", "--data", self.folder), 3, "none of its sequences is there", "freiburg3_walking_xyz")
        self.expect_error(self.bench(self.folder, self.folder / "none"), 3, "none' is no folder")
        self.expect_error(self.bench(self.suite, "--modes", "orb,fast"), 3, "unknown mode 'fast'")
        self.expect_error(self.bench(self.suite, "--set", "orb.featurs=1"), 3, "orb.features")
        bad = self.folder / "bad.yaml"
        bad.write_text("sequences:\n  - {people: none, moton: xyz}\n")
        self.expect_error(self.bench(bad), 3, "bad.yaml:2", "'moton'", "'motion'")
        self.out.write_text("a file")
        self.expect_error(self.bench(self.suite), 4, self.out.name)

    def test_sequences_that_are_missing_are_skipped_and_named(self):
        self.assertEqual(0, self.bench(self.suite, "--modes", "orb", "--runs", "1").returncode)
        data = self.folder / "data"
        shutil.copytree(self.scene_folder("none"), data / "rgbd_dataset_freiburg3_walking_static")
        done = self.bench("tum", "--data", data, "--modes", "orb", "--runs", "1")
        self.assertEqual(0, done.returncode, done.stderr)
        self.assertEqual(7, done.stderr.count("skipped, no such folder"))
        self.assertIn("rgbd_dataset_freiburg3_sitting_rpy", (self.out / "report.html").read_text())
        self.assertIn("| DynaSLAM | published, other machine", done.stdout)

    def test_suites_are_listed(self):
        done = call("bench", "--list")
        self.assertEqual(0, done.returncode, done.stderr)
        self.assertEqual(["rendered", "modes", "accuracy", "tum"], [line.split()[0] for line in done.stdout.splitlines()])


if __name__ == "__main__":
    unittest.main()
