#!/usr/bin/env python3
"""Tests of `segment` and `eval-seg` from outside, with the shipped network: results, exit codes, bad input.
usage: segment_test.py PROGRAM PICTURE [unittest options]      PICTURE: shows a person and no other file of its name"""
import json
import pathlib
import shutil
import sys
import tempfile
import unittest

from program_testing import ErrorLineCase, call

PICTURE = pathlib.Path(sys.argv.pop(1)).resolve()


class SegmentTest(ErrorLineCase):
    def setUp(self):
        self.folder = pathlib.Path(tempfile.mkdtemp(prefix="semvslam_segment_"))
        self.out = self.folder / "out"

    def tearDown(self):
        shutil.rmtree(self.folder)

    def segmented(self):
        done = call("segment", PICTURE, "--out", self.out, "--precision", "f32")
        self.assertEqual(0, done.returncode, done.stderr)
        self.assertIn("person", done.stdout)
        return json.loads((self.out / f"{PICTURE.stem}.json").read_text())

    def test_segment_writes_overlay_instances_and_json(self):
        found = self.segmented()
        names = {f"{PICTURE.stem}.{ending}" for ending in ("overlay.png", "instances.png", "json")}
        self.assertEqual(names, {f.name for f in self.out.iterdir()})
        self.assertEqual("person", found["instances"][0]["class"])

    def test_a_network_agrees_with_itself(self):
        """What segment finds, taken as the truth, must score 1."""
        found = self.segmented()
        size = {"width": found["width"], "height": found["height"]}
        labels = self.folder / "labels.json"
        labels.write_text(json.dumps({
            "images": [{"id": 1, "file_name": PICTURE.name, **size}], "categories": [{"id": 1, "name": "person"}],
            "annotations": [{"id": n, "image_id": 1, "category_id": 1, "iscrowd": 0, "bbox": i["box"], "area": i["pixels"],
                             "segmentation": i["segmentation"]} for n, i in enumerate(found["instances"]) if i["class"] == "person"]}))
        done = call("eval-seg", labels, PICTURE.parent, "--json", "-", "--precision", "f32")
        self.assertEqual(0, done.returncode, done.stderr)
        score = json.loads(done.stdout)
        for key in ("person_pixel_iou", "person_mask_ap", "person_mask_ap50"):
            self.assertAlmostEqual(1, score[key], 9, key)
        self.assertGreater(score["gflops"], 1)
        self.assertGreater(score["ms_median"], 0)

    def test_pictures_that_are_none(self):
        self.expect_error(call("segment", self.folder / "absent.png"), 3, "absent.png")
        for name, content in (("empty.png", b""), ("text.png", b"no picture"), ("cut.png", PICTURE.read_bytes()[:60])):
            (self.folder / name).write_bytes(content)
            self.expect_error(call("segment", self.folder / name), 3, name)

    def test_models_and_labels_that_are_none(self):
        self.expect_error(call("segment", PICTURE, "--model", self.folder), 3, "model.json")
        self.expect_error(call("segment", PICTURE, "--backend", "abacus"), 2, "--backend")
        self.expect_error(call("eval-seg", self.folder / "absent.json", self.folder), 3, "absent.json")
        labels = self.folder / "labels.json"
        labels.write_text("{")
        self.expect_error(call("eval-seg", labels, self.folder), 3, "labels.json")
        labels.write_text(json.dumps({"images": [{"id": 1, "file_name": PICTURE.name, "width": 7, "height": 7}], "categories": [],
                                      "annotations": []}))
        self.expect_error(call("eval-seg", labels, PICTURE.parent), 3, PICTURE.name, "size")


if __name__ == "__main__":
    unittest.main()
