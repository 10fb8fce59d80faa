#!/usr/bin/env python3
"""Saved maps from outside: saving, going on in one, localising, `semvslam map`, files with faults.
usage: saved_map_test.py PROGRAM [unittest options]"""
import json
import math
import os
import struct
import subprocess
import unittest

from program_testing import HEIGHT, PROGRAM, WIDTH, ProgramCase, call, poses

HEADER = 24  # bytes of a map file: mark, version, checksum, length


class SavedMapTest(ProgramCase):
    FRAMES = 60

    @classmethod
    def setUpClass(cls):
        super().setUpClass()
        cls.map = cls.folder / "room.map"
        cls.first = cls.folder / "first"
        done = call("run", cls.whole, "--out", cls.first, "--mode", "orb", "--save-map", cls.map, "--quiet")
        assert done.returncode == 0, done.stderr
        cls.info = json.loads(call("map", "info", cls.map, "--json", "-").stdout)

    def backwards(self):
        """The recording from its end to its beginning: another start."""
        copy = self.copy_of_whole()
        for name in ("rgb.txt", "depth.txt"):
            lines = [line.split() for line in (copy / name).read_text().splitlines() if not line.startswith("#")]
            files = [file for _, file in lines]
            (copy / name).write_text("".join(f"{stamp} {file}\n" for (stamp, _), file in zip(lines, files[::-1])))
        (copy / "groundtruth.txt").unlink()
        return copy

    def run_in_map(self, *options, sequence=None, file=None):
        return call("run", sequence or self.whole, "--out", self.out, "--mode", "orb", "--map", file or self.map, *options)

    def stats(self):
        return json.loads((self.out / "stats.json").read_text())

    def expect_in_world_of_first_run(self, backwards):
        """Frame i of the one recording is frame FRAMES - 1 - i of the other."""
        before, now = poses(self.first / "trajectory.txt"), poses(self.out / "trajectory.txt")
        self.assertEqual(self.FRAMES - 1, len(now), "all but the first frame, which is looked for")
        stamps = list(before)
        for i, stamp in enumerate(stamps):
            if stamp in now:
                other = before[stamps[self.FRAMES - 1 - i] if backwards else stamp]
                self.assertLess(math.dist(now[stamp][:3], other[:3]), 0.01, f"frame {i}")

    def test_localising_leaves_the_map_as_it_is(self):
        again = self.folder / "new" / "again.map"
        done = self.run_in_map("--localise", "--save-map", again, "--deterministic", sequence=self.backwards())
        self.assertEqual(0, done.returncode, done.stderr)
        self.assertIn(f"{self.map}: began with {self.info['key_frames']} key frames", done.stdout)
        self.expect_in_world_of_first_run(backwards=True)
        self.assertEqual({}, poses(self.out / "keyframes.txt"))
        stats = self.stats()
        self.assertEqual((self.FRAMES - 1, 1, 1), (stats["tracked"], stats["lost"], stats["relocalised"]))
        self.assertEqual(self.info["key_frames"], stats["saved_map"]["key_frames"])
        self.assertEqual(self.info["landmarks"], stats["saved_map"]["landmarks"])
        self.assertEqual(self.info["key_frames"], stats["key_frames"])
        self.assertEqual(self.map.read_bytes(), again.read_bytes())

    def test_mapping_goes_on(self):
        grown = self.folder / "grown.map"
        done = self.run_in_map("--save-map", grown, "--quiet", sequence=self.backwards())
        self.assertEqual(0, done.returncode, done.stderr)
        self.expect_in_world_of_first_run(backwards=True)
        new = poses(self.out / "keyframes.txt")
        self.assertLess(0, len(new))
        self.assertLess(len(new), self.stats()["key_frames"], "those of the file are no results of this run")
        info = json.loads(call("map", "info", grown, "--json", "-").stdout)
        self.assertEqual(self.stats()["key_frames"], info["key_frames"])
        # A map may replace the one that it grew from.
        done = self.run_in_map("--save-map", grown, "--quiet", file=grown)
        self.assertEqual(0, done.returncode, done.stderr)
        self.expect_in_world_of_first_run(backwards=False)

    def test_a_foreign_place(self):
        other = self.folder / "other"
        renderer = os.environ.get("SEMVSLAM_RENDERER", PROGRAM)
        subprocess.run([renderer, "render", "--out", other, "--people", "none", "--size", f"{WIDTH}x{HEIGHT}", "--frames", "12",
                        "--seed", "77", "--motion", "tour", "--quiet"], check=True)
        for localise in (["--localise"], []):
            done = self.run_in_map(*localise, "--save-map", self.folder / "never.map", sequence=other)
            self.expect_error(done, 3, "room.map: none of the 12 frames was found in this map")
            self.assertEqual({}, poses(self.out / "trajectory.txt"))
            self.assertEqual(12, self.stats()["lost"])
            self.assertFalse((self.folder / "never.map").exists())

    def test_info_and_export(self):
        text = call("map", "info", self.map).stdout
        for words in (f"key frames    {self.info['key_frames']}\n", f"camera        {WIDTH}x{HEIGHT}, fx 262.5", "version 1"):
            self.assertIn(words, text)
        self.assertEqual(self.map.stat().st_size, self.info["bytes"])
        stamps = [float(stamp) for stamp in poses(self.first / "keyframes.txt")]
        self.assertAlmostEqual(min(stamps), self.info["recorded_from_s"], places=6)
        self.assertAlmostEqual(max(stamps), self.info["recorded_to_s"], places=6)
        low, high = self.info["extent_m"]["min"], self.info["extent_m"]["max"]
        self.assertTrue(all(0.1 < b - a < 20 for a, b in zip(low, high)))

        cloud, trajectory = self.folder / "x.ply", self.folder / "x.txt"
        done = call("map", "export", self.map, "--out", cloud, "--trajectory", trajectory)
        self.assertEqual(0, done.returncode, done.stderr)
        self.assertEqual((self.first / "map.ply").read_bytes(), cloud.read_bytes())
        self.assertEqual(poses(self.first / "keyframes.txt"), poses(trajectory))

    def test_wrong_command_lines(self):
        self.expect_error(call("map"), 2, "info or export is required")
        self.expect_error(call("map", "inform", self.map), 2, "not expected", "inform")
        self.expect_error(call("map", "info"), 2, "FILE")
        self.expect_error(call("map", "export", self.map), 2, "--out or --trajectory is required")
        self.assertIn("--trajectory", call("map", "export", "--help").stdout)
        self.assertIn("export", call("map", "--help").stdout)
        run = ("run", self.whole, "--out", self.out, "--mode", "orb")
        self.expect_error(call(*run, "--localise"), 2, "--localise requires --map")
        self.expect_error(call(*run, "--set", "mapping.frozen=true"), 3, "no saved map to localise in")
        self.expect_error(self.run_in_map("--localise", "--dense-map", self.folder / "x.ply"), 3, "--dense-map", "--localise")

    def refuse_file(self, name, content, *words, code=3):
        """Every command that reads a map tells the same in one line; earlier results stay where they are."""
        file = self.folder / name
        if content is not None:
            file.write_bytes(content)
        self.out.mkdir(exist_ok=True)
        (self.out / "trajectory.txt").write_text("earlier")
        for done in (self.run_in_map(file=file), call("map", "info", file), call("map", "export", file, "--out", self.folder / "no.ply")):
            self.expect_error(done, code, name, *words)
        self.assertEqual("earlier", (self.out / "trajectory.txt").read_text())
        self.assertFalse((self.folder / "no.ply").exists())

    def test_files_that_are_no_maps(self):
        self.refuse_file("nowhere.map", None, "cannot open")
        self.refuse_file("whole", None, "is not a file")
        self.refuse_file("empty.map", b"", "the file is empty")
        self.refuse_file("cloud.ply", (self.first / "map.ply").read_bytes(), "is no map file")
        self.refuse_file("poses.txt", (self.first / "trajectory.txt").read_bytes(), "is no map file")
        self.refuse_file("text.map", self.map.read_bytes().replace(b"\n", b"\r\n"), "is no map file")

    def test_maps_that_break_off(self):
        whole = self.map.read_bytes()
        for length in (1, 7, 8, 12, HEADER - 1):
            self.refuse_file("short.map", whole[:length], "breaks off in its first bytes")
        for length in (HEADER, HEADER + 1, len(whole) // 2, len(whole) - 1):
            self.refuse_file("short.map", whole[:length], "is truncated")
        self.refuse_file("long.map", whole + b"\0", "1 bytes follow its end")

    def test_flipped_bytes(self):
        whole = self.map.read_bytes()
        for at in (HEADER, HEADER + 5, len(whole) // 3, len(whole) // 2, len(whole) - 1, 12):
            self.refuse_file("flipped.map", whole[:at] + bytes([whole[at] ^ 0x40]) + whole[at + 1:], "damaged (checksum)")

    def test_other_versions(self):
        whole = self.map.read_bytes()
        self.refuse_file("newer.map", whole[:8] + struct.pack("<I", 2) + whole[12:], "version 2", "a newer program wrote it")

    def test_another_camera(self):
        copy = self.copy_of_whole()
        camera = (copy / "camera.yaml").read_text()
        line = next(line for line in camera.splitlines() if line.startswith("fx:"))
        for value, code in (("262.7", 0), ("280", 3)):
            (copy / "camera.yaml").write_text(camera.replace(line, f"fx: {value}"))
            done = self.run_in_map("--localise", "--max-frames", 5, sequence=copy)
            if code == 0:
                self.assertEqual(0, done.returncode, done.stderr)
            else:
                self.expect_error(done, code, "saved map: its camera", "fx 280.00", "apart")
        self.expect_error(self.run_in_map("--set", "orb.levels=6"), 3, "saved map", "orb.levels")

    def test_a_full_disk(self):
        if not os.path.exists("/dev/full"):
            self.skipTest("this system has no /dev/full")
        done = call("run", self.whole, "--out", self.out, "--mode", "orb", "--save-map", "/dev/full", "--quiet")
        self.expect_error(done, 4, "/dev/full: cannot write")
        self.assertEqual(self.FRAMES, len(poses(self.out / "trajectory.txt")))
        self.assertEqual(self.FRAMES, self.stats()["tracked"])
        self.assertTrue((self.out / "map.ply").exists())
        self.expect_error(call("map", "export", self.map, "--out", "/dev/full"), 4, "/dev/full: cannot write")

    def test_a_place_that_cannot_be_written(self):
        run = ("run", self.whole, "--out", self.out, "--mode", "orb", "--quiet")
        self.expect_error(call(*run, "--save-map", "/dev/null/x.map"), 4, "/dev/null")
        self.expect_error(call(*run, "--save-map", self.folder, "--max-frames", 5), 4, "cannot replace")


if __name__ == "__main__":
    unittest.main()
