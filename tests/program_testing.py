"""What the tests of the program from outside share. Their first argument is the program.
SEMVSLAM_RENDERER names another program that renders their recordings: a quick one, where the one to test is built with a
sanitizer."""
import os
import pathlib
import shutil
import struct
import subprocess
import sys
import tempfile
import unittest
import zlib

PROGRAM = pathlib.Path(sys.argv.pop(1)).resolve()
WIDTH, HEIGHT = 320, 240


def call(*arguments, **options):
    return subprocess.run([PROGRAM, *map(str, arguments)], stdout=options.pop("stdout", subprocess.PIPE), stderr=subprocess.PIPE,
                          text=True, timeout=240, check=False, **options)


def png(width, height, bits=8):
    """A black PNG with one channel."""
    def chunk(name, data):
        return struct.pack(">I", len(data)) + name + data + struct.pack(">I", zlib.crc32(name + data))

    rows = (b"\0" + bytes(width * bits // 8)) * height
    header = struct.pack(">IIBBBBB", width, height, bits, 0, 0, 0, 0)
    return b"\x89PNG\r\n\x1a\n" + chunk(b"IHDR", header) + chunk(b"IDAT", zlib.compress(rows, 1)) + chunk(b"IEND", b"")


def poses(file):
    """Stamp -> the seven numbers of the pose."""
    lines = [line.split() for line in file.read_text().splitlines() if not line.startswith("#")]
    return {line[0]: [float(word) for word in line[1:]] for line in lines}


class ErrorLineCase(unittest.TestCase):
    def expect_error(self, done, code, *words):
        """One line of error that holds these words, and this exit code."""
        self.assertEqual(code, done.returncode, done.stderr)
        errors = [line for line in done.stderr.splitlines() if line.startswith("semvslam: error: ")]  # libpng adds its own
        self.assertEqual(1, len(errors), done.stderr)
        for word in words:
            self.assertIn(word, errors[0])


class ProgramCase(ErrorLineCase):
    """A folder for everything, with a rendered recording `whole` of FRAMES frames in it; `out` is for a test's results."""
    FRAMES = 30
    RENDER = ()  # further options

    @classmethod
    def setUpClass(cls):
        cls.folder = pathlib.Path(tempfile.mkdtemp(prefix="semvslam_test_"))
        cls.whole = cls.folder / "whole"
        renderer = os.environ.get("SEMVSLAM_RENDERER", PROGRAM)
        subprocess.run([renderer, "render", "--out", cls.whole, "--people", "none", "--size", f"{WIDTH}x{HEIGHT}",
                        "--frames", str(cls.FRAMES), "--quiet", *cls.RENDER], check=True)

    @classmethod
    def tearDownClass(cls):
        shutil.rmtree(cls.folder)

    def setUp(self):
        self.name = self.id().rsplit(".", 1)[-1]
        self.out = self.folder / (self.name + "_out")

    def copy_of_whole(self):
        copy = self.folder / self.name
        shutil.copytree(self.whole, copy)
        return copy
