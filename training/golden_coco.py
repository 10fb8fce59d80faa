#!/usr/bin/env python3
"""Writes random labels and detections with the scores that pycocotools gives them, for the test of another scorer.

usage: golden_coco.py OUT.json
"""
import contextlib
import io
import json
import sys

import numpy as np
from pycocotools import mask as rle
from pycocotools.coco import COCO
from pycocotools.cocoeval import COCOeval

NAMES = {1: "person", 3: "car", 62: "chair"}


def blob(rng, w, h, cx, cy, r):
    a = np.sort(rng.uniform(0, 2 * np.pi, 12))
    d = r * rng.uniform(0.6, 1.2, 12)
    p = np.stack((np.clip(cx + d * np.cos(a), 0, w), np.clip(cy + d * np.sin(a), 0, h)), 1)
    return [round(float(v), 1) for v in p.reshape(-1)]


def main():
    rng = np.random.default_rng(5)
    data = {"images": [], "annotations": [], "categories": [{"id": k, "name": v} for k, v in NAMES.items()]}
    found = []
    for image in range(1, 13):
        w, h = int(rng.integers(150, 320)), int(rng.integers(150, 320))
        data["images"].append({"id": image, "file_name": f"{image}.png", "width": w, "height": h})
        for _ in range(int(rng.integers(0, 6))):
            cat = int(rng.choice([1, 1, 3, 62]))
            cx, cy, r = rng.uniform(0, w), rng.uniform(0, h), rng.uniform(10, 90)
            polygon = blob(rng, w, h, cx, cy, r)
            crowd = int(rng.random() < 0.15)
            m = rle.merge(rle.frPyObjects([polygon], h, w))
            area = float(rle.area(m))
            if area < 20:
                continue
            data["annotations"].append({"id": len(data["annotations"]) + 1, "image_id": image, "category_id": cat, "iscrowd": crowd,
                                        "segmentation": [polygon], "area": area, "bbox": [float(v) for v in rle.toBbox(m)]})
            for _ in range(int(rng.integers(0, 4))):
                moved = np.asarray(polygon).reshape(-1, 2) * rng.uniform(0.9, 1.1) + rng.normal(0, 0.06 * r, 2)
                moved = np.clip(moved, 0, (w, h)).round(1)
                found.append({"image_id": image, "category_id": cat if rng.random() < 0.9 else 3, "score": round(float(rng.random()), 6), "polygon": moved.reshape(-1).tolist()})
    size = {i["id"]: (i["height"], i["width"]) for i in data["images"]}
    results = []
    for f in found:
        m = rle.merge(rle.frPyObjects([f["polygon"]], *size[f["image_id"]]))
        f["area"] = int(rle.area(m))
        results.append({"image_id": f["image_id"], "category_id": f["category_id"], "score": f["score"], "segmentation": m})
    out = {"dataset": data, "detections": found, "expected": {}}
    with contextlib.redirect_stdout(io.StringIO()):
        coco = COCO()
        coco.dataset = json.loads(json.dumps(data))
        for a in coco.dataset["annotations"]:        # a crowd as pycocotools wants it, the same pixels
            if a["iscrowd"]:
                a["segmentation"] = rle.merge(rle.frPyObjects(a["segmentation"], *size[a["image_id"]]))
        coco.createIndex()
        shown = coco.loadRes(results)
        for name, ids in (("person", [1]), ("all", list(NAMES))):
            e = COCOeval(coco, shown, "segm")
            e.params.catIds = ids
            e.evaluate()
            e.accumulate()
            e.summarize()
            out["expected"][name] = {"ap": float(e.stats[0]), "ap50": float(e.stats[1])}
    with open(sys.argv[1], "w") as f:
        json.dump(out, f)
    print(out["expected"], len(found))


if __name__ == "__main__":
    main()
