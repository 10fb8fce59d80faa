#!/usr/bin/env python3
"""download from outside, from a server of its own: what comes whole, in pieces, not at all.
usage: download_test.py PROGRAM [unittest options]"""
import hashlib
import http.server
import re
import shutil
import signal
import subprocess
import tarfile
import threading
import unittest
import zipfile

from program_testing import PROGRAM, ProgramCase, call


class Server(http.server.ThreadingHTTPServer):
    """Serves `files` (name -> bytes). `breaks`: bytes after which each answer breaks off, one per answer; `ranges`: whether it
    can begin in the middle; `gate`: holds an answer after its first half until it is set. `asked`: (name, Range) of each request."""
    def __init__(self):
        super().__init__(("127.0.0.1", 0), Handler)
        self.files, self.breaks, self.ranges, self.gate, self.asked = {}, [], True, None, []
        self.half_way = threading.Event()
        threading.Thread(target=self.serve_forever, daemon=True).start()
        self.url = f"http://127.0.0.1:{self.server_address[1]}"


class Handler(http.server.BaseHTTPRequestHandler):
    def do_GET(self):
        name, wanted = self.path.rsplit("/", 1)[-1], self.headers.get("Range")
        self.server.asked.append((name, wanted))
        if self.path.startswith("/moved/"):
            self.send_response(302)
            self.send_header("Location", f"{self.server.url}/{name}")
            self.end_headers()
            return
        content = self.server.files.get(name)
        if content is None:
            self.send_error(404)
            return
        begin = int(re.match(r"bytes=(\d+)-$", wanted)[1]) if wanted and self.server.ranges else 0
        if begin >= len(content):
            self.send_error(416)
            return
        self.send_response(206 if begin else 200)
        self.send_header("Content-Length", str(len(content) - begin))
        if begin:
            self.send_header("Content-Range", f"bytes {begin}-{len(content) - 1}/{len(content)}")
        self.end_headers()
        end = begin + self.server.breaks.pop(0) if self.server.breaks else len(content)
        if self.server.gate:
            self.wfile.write(content[begin:len(content) // 2])
            self.wfile.flush()
            self.server.half_way.set()
            self.server.gate.wait(60)
            begin = len(content) // 2
        try:
            self.wfile.write(content[begin:end])
        except OSError:
            pass  # the client has gone

    def log_message(self, *_):
        pass


class DownloadTest(ProgramCase):
    FRAMES = 4
    TUM, BONN = "rgbd_dataset_freiburg1_xyz", "rgbd_bonn_balloon"
    KNOWN = "rgbd_dataset_freiburg3_walking_xyz"  # its checksum is known

    @classmethod
    def setUpClass(cls):
        super().setUpClass()
        cls.archives = {}
        for name in (cls.TUM, cls.KNOWN):
            with tarfile.open(cls.folder / f"{name}.tgz", "w:gz") as archive:
                archive.add(cls.whole, name)
        with zipfile.ZipFile(cls.folder / f"{cls.BONN}.zip", "w") as archive:
            for file in cls.whole.rglob("*"):
                archive.write(file, f"{cls.BONN}/{file.relative_to(cls.whole)}")
        for file in cls.folder.glob("rgbd_*"):
            cls.archives[file.name] = file.read_bytes()

    def setUp(self):
        super().setUp()
        self.server = Server()
        self.server.files = dict(self.archives)
        self.addCleanup(self.server.server_close)
        self.addCleanup(self.server.shutdown)
        shutil.rmtree(self.out, ignore_errors=True)

    def get(self, *words, mirror=""):
        return call("download", *words, "--to", self.out, "--mirror", self.server.url + mirror)

    def expect_there(self, folder, *beside):
        self.assertEqual({folder, *beside}, {file.name for file in self.out.iterdir()})
        self.assertEqual({f.relative_to(self.whole) for f in self.whole.rglob("*")},
                         {f.relative_to(self.out / folder) for f in (self.out / folder).rglob("*")})

    def test_recordings_come_and_can_be_run(self):
        done = self.get("tum", "fr1_xyz")
        self.assertEqual(0, done.returncode, done.stderr)
        self.expect_there(self.TUM)
        self.assertIn(hashlib.sha256(self.archives[self.TUM + ".tgz"]).hexdigest(), done.stdout)
        self.assertIn("4 frames", done.stdout)
        run = call("run", self.out / self.TUM, "--out", self.out / "run", "--mode", "orb", "--quiet")
        self.assertEqual(0, run.returncode, run.stderr)
        self.server.asked.clear()
        again = self.get("tum", "freiburg1_xyz")
        self.assertEqual((0, []), (again.returncode, self.server.asked), "it is there")
        self.assertIn("is there already", again.stdout)

    def test_zip_redirection_and_the_archive_that_is_kept(self):
        done = self.get("bonn", "balloon", "--keep-archive", "--quiet", mirror="/moved")
        self.assertEqual((0, ""), (done.returncode, done.stdout), done.stderr)
        self.expect_there(self.BONN, self.BONN + ".zip")
        shutil.rmtree(self.out / self.BONN)
        self.server.asked.clear()
        self.assertEqual(0, self.get("bonn", "balloon").returncode)
        self.assertEqual([], self.server.asked, "only unpacked")
        self.expect_there(self.BONN)

    def test_an_answer_that_breaks_off_is_gone_on_with(self):
        self.server.breaks = [1000, 500]
        done = self.get("tum", "fr1_xyz")
        self.assertEqual(0, done.returncode, done.stderr)
        self.assertEqual([None, "bytes=1000-", "bytes=1500-"], [wanted for _, wanted in self.server.asked])
        self.expect_there(self.TUM)

    def test_one_that_always_breaks_off_is_an_error_and_the_next_call_goes_on(self):
        self.server.breaks = [1000, 500, 10]
        self.expect_error(self.get("tum", "fr1_xyz"), 4, self.TUM)
        self.assertEqual(1510, (self.out / f"{self.TUM}.tgz.part").stat().st_size)
        self.server.asked.clear()
        self.assertEqual(0, self.get("tum", "fr1_xyz").returncode)
        self.assertEqual([(f"{self.TUM}.tgz", "bytes=1510-")], self.server.asked)
        self.expect_there(self.TUM)

    def test_a_server_without_ranges_begins_anew(self):
        self.server.ranges = False
        self.server.breaks = [1000]
        done = self.get("tum", "fr1_xyz")
        self.assertEqual(0, done.returncode, done.stderr)
        self.expect_there(self.TUM)

    def test_what_was_whole_but_not_yet_named_so(self):
        self.out.mkdir()
        (self.out / f"{self.TUM}.tgz.part").write_bytes(self.archives[f"{self.TUM}.tgz"])
        done = self.get("tum", "fr1_xyz")
        self.assertEqual(0, done.returncode, done.stderr)
        self.expect_there(self.TUM)

    def test_an_interrupt_keeps_what_has_come(self):
        self.server.gate = threading.Event()
        half = len(self.archives[f"{self.TUM}.tgz"]) // 2
        child = subprocess.Popen([PROGRAM, "download", "tum", "fr1_xyz", "--to", self.out, "--mirror", self.server.url],
                                 stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)
        self.assertTrue(self.server.half_way.wait(60))
        child.send_signal(signal.SIGINT)
        _, errors = child.communicate(timeout=60)
        self.server.gate.set()
        self.assertEqual(130, child.returncode, errors)
        self.assertIn("goes on from here", errors)
        self.server.gate = None
        self.server.asked.clear()
        self.assertEqual(0, self.get("tum", "fr1_xyz").returncode)
        begun = int(self.server.asked[0][1].split("=")[1].rstrip("-")) if self.server.asked[0][1] else 0
        self.assertLessEqual(begun, half)
        self.expect_there(self.TUM)

    def test_checksums(self):
        self.expect_error(self.get("tum", "fr3_walking_xyz"), 3, "SHA-256", "1459e9488ac0e61a", "--skip-checksum")
        self.assertEqual([], list(self.out.iterdir()), "no damaged archive is left")
        done = self.get("tum", "fr3_walking_xyz", "--skip-checksum")
        self.assertEqual(0, done.returncode, done.stderr)
        self.expect_there(self.KNOWN)

    def test_what_is_damaged_or_missing_or_unknown(self):
        self.server.files[self.TUM + ".tgz"] = self.archives[self.TUM + ".tgz"][:-2000]
        self.expect_error(self.get("tum", "fr1_xyz"), 3, "damaged archive")
        self.assertEqual([], list(self.out.iterdir()))
        self.server.files[self.TUM + ".tgz"] = b"<html>moved</html>"
        self.expect_error(self.get("tum", "fr1_xyz"), 3, "damaged archive")
        self.server.files[self.TUM + ".tgz"] = self.archives[self.KNOWN + ".tgz"]
        self.expect_error(self.get("tum", "fr1_xyz"), 3, f"should hold the folder {self.TUM}")
        del self.server.files[self.TUM + ".tgz"]
        self.expect_error(self.get("tum", "fr1_xyz"), 3, "no such file", f"{self.TUM}.tgz")
        self.assertEqual([], list(self.out.iterdir()))
        self.expect_error(self.get("tum", "fr1_xzy"), 3, "nearest known one is 'fr1_xyz'")
        self.expect_error(self.get("tom", "fr1_xyz"), 3, "nearest known one is 'tum'")
        self.expect_error(call("download"), 3, "--list")
        self.expect_error(call("download", "tum", "fr1_xyz", "--to", self.out, "--mirror", "http://127.0.0.1:1"), 4, "127.0.0.1")
        (self.folder / "file").write_text("")
        self.expect_error(call("download", "tum", "fr1_xyz", "--to", self.folder / "file"), 4, "file")

    def test_list(self):
        done = call("download", "--list")
        self.assertEqual(0, done.returncode)
        for word in ("fr3_walking_xyz", "rgbd_bonn_balloon", "paper"):
            self.assertIn(word, done.stdout)


if __name__ == "__main__":
    unittest.main()
