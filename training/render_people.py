#!/usr/bin/env python3
"""Renders frames with people over several seeds and labels them in COCO's format: data for the second stage of the training.

usage: render_people.py PROGRAM OUT [--seeds 101 102 ...] [--frames 16]      PROGRAM: the built semvslam

Writes a recording per seed and kind of scene (TUM layout), then OUT/rendered.json; file names are relative to OUT. Recordings that
are there already are kept. For scores take other seeds than for the training: look, dress and ways of the people, textures, light
and camera depend on the seed; the plan of the room does not.
"""
import argparse
import json
import os
import subprocess

import cv2
import numpy as np

from segnet import classes

PEOPLE, MOTIONS = ("walking", "sitting", "carrying", "none"), ("tour", "xyz", "rpy", "halfsphere")


def render(program, out, seeds, frames):
    for n, seed in enumerate(seeds):
        for k, people in enumerate(PEOPLE):
            motion = MOTIONS[(n + k) % len(MOTIONS)]
            folder = os.path.join(out, f"{people}_{motion}_{seed}")
            if not os.path.exists(folder):
                # 1.3 frames a second: neighbours differ. The training adds blur and noise itself.
                subprocess.run([program, "render", "--out", folder, "--people", people, "--motion", motion, "--frames",
                                str(frames if people != "none" else frames // 3), "--rate", "1.3", "--seed", str(seed), "--jpeg", "--quiet",
                                "--threads", "1"], check=True)


def polygons(mask):
    """Outlines that the loader fills to the same pixels, a quarter of a pixel within their edge."""
    found, _ = cv2.findContours(np.kron(mask, np.ones((2, 2), np.uint8)), cv2.RETR_EXTERNAL, cv2.CHAIN_APPROX_SIMPLE)
    return [((c.reshape(-1, 2) + 0.5) / 2).ravel().tolist() for c in found if len(c) >= 3]


def run_lengths(mask):
    """COCO's uncompressed run lengths, column by column."""
    flat = mask.T.ravel() != 0
    edges = np.flatnonzero(np.diff(flat)) + 1
    runs = np.diff(np.r_[0, edges, flat.size]).tolist()
    return {"size": list(mask.shape), "counts": [0] * int(flat[0]) + runs}


def label(out, folder, images, annotations, exact):
    with open(os.path.join(out, folder, "roles.json")) as f:
        persons = [r["number"] for r in json.load(f) if r["label"] == "person"]
    for name in sorted(os.listdir(os.path.join(out, folder, "rgb"))):
        mask = cv2.imread(os.path.join(out, folder, "mask", os.path.splitext(name)[0] + ".png"), cv2.IMREAD_UNCHANGED)
        images.append({"id": len(images) + 1, "file_name": f"{folder}/rgb/{name}", "height": mask.shape[0], "width": mask.shape[1]})
        for number in persons:
            one = (mask == number).astype(np.uint8)
            x, y, w, h = cv2.boundingRect(one)
            region = run_lengths(one) if exact else polygons(one)
            if w and region:
                annotations.append({"id": len(annotations) + 1, "image_id": images[-1]["id"], "category_id": 1, "iscrowd": 0,
                                    "area": int(one.sum()), "bbox": [x, y, w, h], "segmentation": region})


def main():
    a = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    a.add_argument("program")
    a.add_argument("out")
    a.add_argument("--seeds", type=int, nargs="*", default=list(range(101, 111)), help="none: only label what is there")
    a.add_argument("--frames", type=int, default=16, help="per recording; a third where nobody is")
    a.add_argument("--exact", action="store_true", help="run lengths instead of polygons: for scores")
    o = a.parse_args()
    os.makedirs(o.out, exist_ok=True)
    render(o.program, o.out, o.seeds, o.frames)
    images, annotations = [], []
    for folder in sorted(os.listdir(o.out)):
        if os.path.exists(os.path.join(o.out, folder, "roles.json")) and not folder.endswith(".part"):
            label(o.out, folder, images, annotations, o.exact)
    coco = {"images": images, "annotations": annotations, "categories": [{"id": n + 1, "name": c} for n, c in enumerate(classes.NAMES)]}
    with open(os.path.join(o.out, "rendered.json"), "w") as f:
        json.dump(coco, f)
    print(f"{len(images)} frames, {len(annotations)} persons")


if __name__ == "__main__":
    main()
