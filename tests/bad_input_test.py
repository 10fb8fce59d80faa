#!/usr/bin/env python3
"""Recordings with faults, given to the program from outside: what can be used is used, every fault is told in one line, nothing
computed is lost.
usage: bad_input_test.py PROGRAM [unittest options]"""
import json
import struct
import unittest
import zlib

from program_testing import HEIGHT, WIDTH, ProgramCase, call, png

FRAMES = ProgramCase.FRAMES


def float_tiff(width, height, values):
    """An uncompressed TIFF with one 32-bit float per pixel."""
    pixels = struct.pack(f"<{width * height}f", *values)
    entries = [(256, 4, width), (257, 4, height), (258, 3, 32), (259, 3, 1), (262, 3, 1), (273, 4, 8), (277, 3, 1),
               (278, 4, height), (279, 4, len(pixels)), (339, 3, 3)]
    directory = struct.pack("<H", len(entries)) + b"".join(struct.pack("<HHII", *e[:2], 1, e[2]) for e in entries) + bytes(4)
    return b"II*\0" + struct.pack("<I", 8 + len(pixels)) + pixels + directory


def read_png_16(path):
    """Rows of a 16-bit grey PNG of the sequence (not interlaced)."""
    data, at, packed = path.read_bytes(), 8, b""
    while at < len(data):
        size, name = struct.unpack(">I4s", data[at:at + 8])
        if name == b"IDAT":
            packed += data[at + 8:at + 8 + size]
        at += 12 + size
    raw, stride, above, out = zlib.decompress(packed), 2 * WIDTH, bytes(2 * WIDTH), []
    for y in range(HEIGHT):
        kind, row = raw[y * (stride + 1)], bytearray(raw[y * (stride + 1) + 1:(y + 1) * (stride + 1)])
        for i in range(stride):
            left, up, corner = row[i - 2] if i > 1 else 0, above[i], above[i - 2] if i > 1 else 0
            guess = left + up - corner
            paeth = min((left, up, corner), key=lambda v: abs(guess - v))
            row[i] = (row[i] + (0, left, up, (left + up) // 2, paeth)[kind]) & 255
        out.append(struct.unpack(f">{WIDTH}H", row))
        above = bytes(row)
    return out


class BadInputTest(ProgramCase):
    def setUp(self):
        super().setUp()
        self.sequence = self.copy_of_whole()

    def lines(self, name):
        return [line for line in (self.sequence / name).read_text().splitlines() if not line.startswith("#")]

    def write(self, name, lines):
        (self.sequence / name).write_text("\n".join(lines) + "\n")

    def image(self, kind, index):
        return self.sequence / self.lines(kind + ".txt")[index].split()[1]

    def run_it(self, tracked, skipped=0, warning=None):
        """A run that must do what can be done."""
        done = call("run", self.sequence, "--out", self.out)
        self.assertEqual(0, done.returncode, done.stderr)
        stats = json.loads((self.out / "stats.json").read_text())
        self.assertEqual((tracked, skipped), (stats["tracked"], stats["skipped"]))
        self.assertEqual(skipped, (self.out / "run.log").read_text().count("skipped:"))
        if warning:
            self.assertIn(warning, done.stderr)
        stamps = [float(line.split()[0]) for line in (self.out / "trajectory.txt").read_text().splitlines() if line[0] != "#"]
        self.assertEqual(tracked, len(stamps))
        self.assertTrue(all(a < b for a, b in zip(stamps, stamps[1:])), "stamps grow")
        return done

    def refuse(self, code, *words):
        """A run that cannot be done: one line that holds these words."""
        self.expect_error(call("run", self.sequence, "--out", self.out), code, *words)

    def test_depth_that_is_missing_for_some_frames(self):
        self.image("depth", 7).unlink()  # listed, but gone
        self.write("depth.txt", [line for i, line in enumerate(self.lines("depth.txt")) if i not in (3, 4)])  # not listed
        self.run_it(FRAMES - 3, 1, "2 colour images have no depth image")

    def test_images_of_other_sizes_in_the_middle(self):
        self.image("rgb", 5).write_bytes(png(1, 1))
        self.image("depth", 9).write_bytes(png(1, 1, 16))
        self.image("rgb", 12).write_bytes(png(7680, 4320))
        self.image("depth", 14).write_bytes(png(7680, 4320, 16))
        self.run_it(FRAMES - 4, 4, "the image is 1x1, the camera 320x240")

    def test_size_that_changes_for_good(self):
        for index in range(20, FRAMES):
            self.image("rgb", index).write_bytes(png(640, 480))
        self.run_it(20, FRAMES - 20, "the image is 640x480, the camera 320x240")

    def test_images_that_are_none(self):
        self.image("rgb", 5).write_bytes(b"")
        self.image("depth", 6).write_bytes(b"no image at all")
        self.image("rgb", 8).write_bytes(self.image("rgb", 8).read_bytes()[:2000])
        self.image("depth", 10).write_bytes(png(WIDTH, HEIGHT, 8))
        self.run_it(FRAMES - 4, 4)

    def test_images_that_all_break_off(self):
        for index in range(FRAMES):
            self.image("depth", index).write_bytes(self.image("depth", index).read_bytes()[:500])
        self.refuse(3, "depth", "the PNG is truncated")

    def test_every_image_of_another_size(self):
        for index in range(FRAMES):
            self.image("rgb", index).write_bytes(png(1, 1))
        self.refuse(3, "the image is 1x1, the camera 320x240")

    def test_camera_of_a_useless_size(self):
        text = (self.sequence / "camera.yaml").read_text()
        (self.sequence / "camera.yaml").write_text(text.replace(f"width: {WIDTH}", "width: 1"))
        self.refuse(3, "camera.yaml", "1x240")

    def test_focal_lengths(self):
        text = (self.sequence / "camera.yaml").read_text()
        line = next(line for line in text.splitlines() if line.startswith("fx:"))
        for value, word in (("-262.5", "-262.5"), ("0", "fx = 0"), (".nan", "fx"), ("abc", "fx")):
            (self.sequence / "camera.yaml").write_text(text.replace(line, f"fx: {value}"))
            self.refuse(3, "camera.yaml", word)
        (self.sequence / "camera.yaml").write_text(text + "focal: 3\n")
        self.refuse(3, "unknown key 'focal'")

    def test_unsorted_stamps(self):
        self.write("rgb.txt", self.lines("rgb.txt")[::-1])
        depth = self.lines("depth.txt")
        self.write("depth.txt", depth[10:] + depth[:10])
        self.run_it(FRAMES)

    def test_duplicate_stamps(self):
        lines = self.lines("rgb.txt")
        self.write("rgb.txt", lines[:12] + lines[10:])
        self.run_it(FRAMES, warning="rgb.txt")

    def test_stamps_that_are_not_finite(self):
        lines = self.lines("rgb.txt")
        lines[4], lines[9] = "nan " + lines[4].split()[1], "inf " + lines[9].split()[1]
        self.write("rgb.txt", lines)
        self.run_it(FRAMES - 2, warning="rgb.txt")
        self.write("rgb.txt", ["nan " + line.split()[1] for line in lines])
        self.refuse(3, "rgb.txt: no image in the list: 30 time stamps not a number")

    def test_stamps_that_are_no_numbers(self):
        lines = self.lines("rgb.txt")
        self.write("rgb.txt", lines[:3] + ["soon rgb/x.png"] + lines[3:])
        self.refuse(3, "rgb.txt:4", "'soon'")

    def test_nothing_associated(self):
        self.write("depth.txt", [f"{1000 + float(line.split()[0])} {line.split()[1]}" for line in self.lines("depth.txt")])
        self.refuse(3, "none of 30 colour images has a depth image")

    def test_float_depth_with_nan(self):
        name = self.lines("depth.txt")[8].split()[1]
        metres = [value / 5000 if value else float("nan") for row in read_png_16(self.sequence / name) for value in row]
        metres[:WIDTH * 40] = [float("nan")] * (WIDTH * 20) + [float("inf")] * (WIDTH * 10) + [-1.0] * (WIDTH * 10)
        (self.sequence / "depth" / "float.tiff").write_bytes(float_tiff(WIDTH, HEIGHT, metres))
        lines = self.lines("depth.txt")
        self.write("depth.txt", [line.replace(name, "depth/float.tiff") for line in lines])
        self.run_it(FRAMES)
        error = json.loads((self.out / "evaluation.json").read_text())["estimate"]["ate_m"]["max"]
        self.assertLess(error, 0.02)

    def test_depth_without_any_measurement(self):
        for index in range(FRAMES):
            self.image("depth", index).write_bytes(png(WIDTH, HEIGHT, 16))
        self.refuse(3, "none of the 30 frames could be tracked")
        self.assertTrue((self.out / "stats.json").exists())

    def test_ground_truth_that_is_no_use(self):
        for text, word in (("1 nan 0 0 0 0 0 1\n", "groundtruth.txt:1: word 2 is not a finite number"), ("1 0 0 0 0 0 0 1\n", "no score"),
                           ("", "no score")):
            (self.sequence / "groundtruth.txt").write_text(text)
            done = call("run", self.sequence, "--out", self.out)
            told = [line for line in done.stderr.splitlines() if line.startswith("semvslam: ") and word in line]
            self.assertEqual((0, 1), (done.returncode, len(told)), done.stderr)
            self.assertEqual(FRAMES, json.loads((self.out / "stats.json").read_text())["tracked"])
            self.assertEqual(FRAMES, sum(line[0] != "#" for line in (self.out / "trajectory.txt").read_text().splitlines()))

    def test_output_that_cannot_be_written(self):
        for out in ("/proc/semvslam_test", "/dev/null/results", self.sequence / "rgb.txt" / "results"):
            self.expect_error(call("run", self.sequence, "--out", out), 4, str(out))
        (self.out / "stats.json").mkdir(parents=True)
        (self.out / "stats.json" / "something").write_text("x")
        self.refuse(4, "stats.json")

    def test_recordings_that_are_none(self):
        self.sequence = self.folder / "nowhere"
        self.refuse(3, "nowhere", "no such folder")
        self.sequence = self.folder / "whole" / "rgb.txt"
        self.refuse(3, "is not a folder")
        self.sequence = self.folder / "hollow"
        self.sequence.mkdir()
        self.refuse(3, "hollow")
        self.write("rgb.txt", ["# nothing"])
        self.write("depth.txt", ["# nothing"])
        self.refuse(3, "rgb.txt", "no image in the list")


if __name__ == "__main__":
    unittest.main()
