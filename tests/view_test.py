#!/usr/bin/env python3
"""`semvslam view` from outside: the page, what is missing or damaged, several runs, a run that goes on.
usage: view_test.py PROGRAM [unittest options]"""
import base64
import html.parser
import json
import re
import shutil
import signal
import struct
import subprocess
import unittest
import urllib.request

from program_testing import PROGRAM, ProgramCase, call


class Page(html.parser.HTMLParser):
    """The tags of a page, whether they are closed in turn, what it links to, and the scene in it."""
    VOID = {"meta", "link", "input", "rect", "line", "path", "br"}
    LINKS = {"src", "href", "action", "srcset", "data", "poster"}

    def __init__(self, text):
        super().__init__()
        self.tags, self.open, self.links, self.scene, self.text = {}, [], [], "", ""
        self.in_scene = False
        self.feed(text)
        self.close()

    def handle_starttag(self, tag, attributes):
        self.tags[tag] = self.tags.get(tag, 0) + 1
        self.links += [value for name, value in attributes if name in self.LINKS]
        self.in_scene = ("id", "scene") in attributes and tag == "script"
        if tag not in self.VOID:
            self.open.append(tag)

    def handle_startendtag(self, tag, attributes):
        self.tags[tag] = self.tags.get(tag, 0) + 1

    def handle_endtag(self, tag):
        assert self.open and self.open.pop() == tag, tag

    def handle_data(self, data):
        if self.in_scene:
            self.scene += data
        else:
            self.text += data


def floats(text):
    data = base64.b64decode(text, validate=True)
    return struct.unpack(f"<{len(data) // 4}f", data)


class ViewTest(ProgramCase):
    @classmethod
    def setUpClass(cls):
        super().setUpClass()
        cls.run_folder = cls.folder / "run"
        done = call("run", cls.whole, "--out", cls.run_folder, "--mode", "orb", "--dense-map", cls.run_folder / "dense.ply", "--quiet")
        assert done.returncode == 0, done.stderr

    def copy_of_run(self, name=None):
        copy = self.folder / (name or self.name)
        shutil.copytree(self.run_folder, copy)
        return copy

    def view(self, *folders_and_options):
        done = call("view", *folders_and_options, "--out", self.out)
        self.assertEqual(0, done.returncode, done.stderr)
        return self.out.read_text(encoding="utf-8"), done

    def test_a_page_holds_the_run_and_needs_nothing_else(self):
        copy = self.copy_of_run()
        done = call("view", copy)
        self.assertEqual(0, done.returncode, done.stderr)
        self.assertEqual("", done.stderr)
        self.assertIn("view.html", done.stdout)
        text = (copy / "view.html").read_text(encoding="utf-8")
        page = Page(text)
        self.assertEqual([], page.open)
        self.assertEqual(["data:,"], page.links)
        # The names of XML's own vocabularies are no addresses that anybody asks.
        self.assertEqual(set(), set(re.findall(r"https?://[^\s\"'<]*", text)) - {"http://www.w3.org/2000/svg"})
        self.assertIn("connect-src 'none'", text)
        self.assertIn("30 of 30 (100.0 %)", page.text)
        self.assertLess(len(text), 5_000_000)
        scene = json.loads(page.scene)
        self.assertTrue(scene["inTruthWorld"])
        run = scene["runs"][0]
        self.assertEqual(30, len(floats(run["trajectory"]["times"])))
        self.assertEqual(7 * 30, len(floats(run["trajectory"]["poses"])))
        errors = floats(run["errors"])
        evaluation = json.loads((copy / "evaluation.json").read_text())["estimate"]["ate_m"]
        self.assertAlmostEqual(evaluation["max"], max(errors), 6)
        self.assertLess(0, len(floats(run["keyFrames"]["times"])))
        self.assertEqual("dense map", run["cloud"]["what"])
        points = len(base64.b64decode(run["cloud"]["grid"])) // 6
        self.assertLess(1000, points)
        self.assertEqual(3 * points, len(base64.b64decode(run["cloud"]["colours"])))

    def test_points_are_thinned_on_request(self):
        text, _ = self.view(self.run_folder, "--points", 1000)
        cloud = json.loads(Page(text).scene)["runs"][0]["cloud"]
        self.assertLessEqual(len(base64.b64decode(cloud["grid"])) // 6, 1000)
        self.assertLess(0, cloud["cell"])

    def test_runs_are_compared(self):
        first, second = self.copy_of_run("first"), self.copy_of_run("second")
        page = Page(self.view(first, second)[0])
        self.assertEqual(["first", "second"], [run["name"] for run in json.loads(page.scene)["runs"]])
        self.assertIn("Comparison", page.text)

    def test_what_is_missing_is_said_and_the_rest_shown(self):
        copy = self.copy_of_run()
        (copy / "dense.ply").write_bytes((copy / "dense.ply").read_bytes()[:1000])
        (copy / "stats.json").write_text("[1, 2")
        (copy / "keyframes.txt").write_text("1 nan 0 0 0 0 0 1\n")
        text, done = self.view(copy)
        for words in ("dense.ply: the file is cut off", "stats.json is no JSON", "keyframes.txt:1"):
            self.assertIn(words, Page(text).text)
            self.assertIn(words, done.stderr)
        self.assertEqual("landmarks", json.loads(Page(text).scene)["runs"][0]["cloud"]["what"])

    def test_a_run_that_tracked_nothing_is_a_page(self):
        copy = self.copy_of_run()
        (copy / "trajectory.txt").write_text("")
        self.assertIn("not one frame was tracked", Page(self.view(copy)[0]).text)

    def test_names_cannot_put_scripts_into_the_page(self):
        copy = self.copy_of_run("<script>alert(1)<!--")
        (copy / "stats.json").write_text(json.dumps({"mode": "</script><script>alert(2)</script>", "notices": ["<img src=x>"]}))
        text, _ = self.view(copy)
        page = Page(text)
        self.assertEqual(2, page.tags["script"])
        self.assertNotIn("img", page.tags)
        self.assertEqual("<script>alert(1)<!--", json.loads(page.scene)["runs"][0]["name"])

    def test_what_cannot_be_shown_is_one_line(self):
        self.expect_error(call("view"), 2, "RUN_DIR")
        self.expect_error(call("view", self.folder / "none"), 3, "none: no such folder")
        self.expect_error(call("view", self.whole, "--out", self.out), 3, "holds no run")
        self.expect_error(call("view", self.run_folder, "--dense", self.folder / "none.ply"), 3, "none.ply")
        self.expect_error(call("view", self.run_folder, "--truth", self.folder / "none.txt"), 3, "none.txt")
        self.expect_error(call("view", self.run_folder, "--out", self.folder / "no" / "folder" / "x.html"), 3, "x.html")
        self.expect_error(call("view", self.run_folder, "--port", 1), 2, "--serve")
        self.expect_error(call("view", self.run_folder, self.run_folder, "--serve"), 2, "one RUN_DIR")
        self.expect_error(call("view", self.folder / "none", "--serve"), 3, "none")
        bad = self.copy_of_run()
        (bad / "trajectory.txt").write_text("1 2 3 inf 0 0 0 1\n")
        self.expect_error(call("view", bad), 3, "trajectory.txt:1")

    def test_standard_output_takes_the_page_alone(self):
        done = call("view", self.run_folder, "--out", "-")
        self.assertEqual([], Page(done.stdout).open)

    def serve(self, folder, *options):
        process = subprocess.Popen([PROGRAM, "view", folder, "--serve", "--port", "0", *options], stdout=subprocess.PIPE,
                                   stderr=subprocess.PIPE, text=True)
        self.addCleanup(process.kill)
        address = re.search(r"http://127\.0\.0\.1:\d+/", process.stdout.readline())
        self.assertTrue(address)
        return process, address.group()

    def end(self, process, sent):
        process.send_signal(sent)
        _, errors = process.communicate(timeout=30)
        self.assertEqual(128 + sent, process.returncode, errors)
        self.assertEqual("", errors)

    def skip_to(self, events, wanted):
        """Reads up to a line, which must come soon."""
        lines = []
        while len(lines) < 100 and wanted not in lines:
            lines.append(events.readline())
        self.assertIn(wanted, lines)

    def test_a_live_run_is_served_and_its_new_poses_are_sent(self):
        copy = self.copy_of_run()
        (copy / "stats.json").write_text('{"end": "running", "frames": 31}')
        process, address = self.serve(copy)
        with urllib.request.urlopen(address, timeout=30) as answer:
            page = Page(answer.read().decode())
        self.assertEqual([], page.open)
        live = json.loads(page.scene)["live"]
        self.assertEqual(30, live["poses"])
        with urllib.request.urlopen(f"{address}events?at={live['generation']}:30", timeout=30) as events:
            self.assertEqual("text/event-stream", events.headers["Content-Type"])
            self.assertEqual(b"event: numbers\n", events.readline())
            with open(copy / "trajectory.txt", "a", encoding="utf-8") as file:
                file.write("5000000000 1 2 3 0 0 0 1\n")
            self.skip_to(events, b"event: poses\n")
            self.assertEqual(f"id: {live['generation']}:31\n".encode(), events.readline())
            pose = json.loads(events.readline().removeprefix(b"data: "))[0]
            self.assertEqual([1, 2, 3, 0, 0, 0, 1], pose[1:])
            self.end(process, signal.SIGINT)  # while the page listens

    def test_a_run_that_begins_is_seen_to_its_end(self):
        out = self.folder / self.name
        out.mkdir()
        process, address = self.serve(out)
        with urllib.request.urlopen(address, timeout=30) as answer:
            self.assertIn("no pose yet", answer.read().decode())
        with urllib.request.urlopen(address + "events?at=1:0", timeout=30) as events:
            self.assertEqual(0, call("run", self.whole, "--out", out, "--mode", "orb", "--quiet").returncode)
            self.skip_to(events, b"event: scene\n")
        with urllib.request.urlopen(address + "scene.json", timeout=30) as answer:
            scene = json.load(answer)
        self.assertEqual(30, len(floats(scene["runs"][0]["trajectory"]["times"])))
        self.assertTrue(scene["inTruthWorld"])
        self.end(process, signal.SIGTERM)

    def test_a_port_that_is_taken_is_one_line(self):
        process, address = self.serve(self.run_folder)
        port = address.rsplit(":", 1)[1].strip("/")
        self.expect_error(call("view", self.run_folder, "--serve", "--port", port), 3, "the port is taken")
        self.end(process, signal.SIGINT)


if __name__ == "__main__":
    unittest.main()
