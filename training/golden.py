#!/usr/bin/env python3
"""Writes a synthetic picture and what the reference makes of it, for the test of another implementation.

usage: golden.py MODEL_DIR OUT_DIR
picture.png and golden.json: the small steps on formula-made data (`roi_align`, `nms`, `paste`, `decode`), on the picture the
proposals and single values of the graphs' outputs, and on OUT_DIR/people.jpg, a rendered frame, the detections.
"""
import argparse
import json
import os

import cv2
import numpy as np

import infer


def picture(h=480, w=640):
    """A plain room with two standing figures, one of them cut by the border. No randomness but a fixed noise formula."""
    y, x = np.mgrid[0:h, 0:w]
    img = np.stack((150 - y // 8, 160 - y // 10 + x // 40, 170 - x // 20), 2).astype(np.int32)
    img[h * 2 // 3:] = (90, 110, 130)
    img += ((x * 7919 + y * 104729) % 13 - 6)[..., None].astype(np.int32)
    img = np.ascontiguousarray(np.clip(img, 0, 255).astype(np.uint8))
    cv2.rectangle(img, (30, 220), (170, 330), (60, 90, 140), -1)
    for cx, top, s in ((260, 60, 1.0), (560, 20, 1.5)):
        p = lambda dx, dy: (int(cx + dx * s), int(top + dy * s))
        poly = lambda pts, c: cv2.fillPoly(img, [np.array([p(*q) for q in pts], np.int32)], c, cv2.LINE_AA)
        poly([(-38, 210), (-4, 210), (-8, 370), (-34, 370)], (90, 60, 40))
        poly([(4, 210), (38, 210), (34, 370), (8, 370)], (90, 60, 40))
        poly([(-44, 72), (44, 72), (40, 220), (-40, 220)], (40, 40, 160))
        poly([(-44, 74), (-64, 90), (-72, 200), (-54, 204), (-40, 110)], (40, 40, 160))
        poly([(44, 74), (64, 90), (72, 200), (54, 204), (40, 110)], (40, 40, 160))
        poly([(-12, 50), (12, 50), (14, 76), (-14, 76)], (130, 160, 210))
        cv2.ellipse(img, p(0, 30), (int(24 * s), int(32 * s)), 0, 0, 360, (140, 170, 220), -1, cv2.LINE_AA)
        cv2.ellipse(img, p(0, 14), (int(26 * s), int(20 * s)), 0, 180, 360, (30, 40, 50), -1, cv2.LINE_AA)
    return cv2.GaussianBlur(img, (0, 0), 1.2)


def listed(a, digits=5):
    return np.round(np.asarray(a, np.float64), digits).tolist()


def formulas():
    value = lambda h, w, c: (((np.arange(h)[:, None, None] * 37 + np.arange(w)[None, :, None] * 17 + np.arange(c)[None, None] * 11) % 101) / 50 - 1).astype(np.float32)
    levels = [value(48, 64, 4), value(24, 32, 4), value(12, 16, 4)]
    boxes = np.array([[10, 12, 60, 100], [-20, -10, 40, 50], [100, 50, 380, 330], [0, 0, 512, 384], [300.5, 200.25, 511.9, 383.9], [5, 5, 5.5, 9]], np.float32)
    prob = ((np.add.outer(np.arange(28) * 13, np.arange(28) * 7) % 29) / 28).astype(np.float32)
    corners = [-7.3, 20.6, 50.2, 99.5]
    box = np.array(corners, np.float32)
    (x0, y0, window), _ = infer.paste(prob, box, (90, 120))
    hint = (((np.arange(48)[:, None] * 5 + np.arange(64)[None] * 3) % 17) / 16).astype(np.float32)
    (_, _, mixed), certainty = infer.paste(prob, box, (90, 120), 0.48, hint, (2.0, 2.5), 0.5)
    region = infer.grown(box[None], infer.REFINE_MARGIN)[0]
    coarse = infer.on_region(prob, box, region, hint, 0.35)
    nb = np.array([[i * 7 % 50, i * 13 % 40, i * 7 % 50 + 30 + i % 5, i * 13 % 40 + 25 + i % 7] for i in range(40)], np.float32)
    ns = np.array([(i * 29 % 41) / 41 for i in range(40)], np.float32)
    ref = np.array([[10, 20, 60, 90], [0, 0, 500, 380]], np.float32)
    deltas = np.array([[0.1, -0.2, 0.3, 5.0], [0.0, 0.4, -0.5, 0.2]], np.float32)
    return {"about": "levels: value(y, x, c) = ((37 y + 17 x + 11 c) mod 101) / 50 - 1, sizes 48x64, 24x32, 12x16, 4 channels; "
                     "mask probabilities: ((13 y + 7 x) mod 29) / 28",
            "roi_align": {"boxes": listed(boxes), "cells7": listed(infer.roi_align(levels, boxes, 7, infer.BOX_LEVELS).reshape(len(boxes), -1)),
                          "cells14_sum": listed(infer.roi_align(levels, boxes, 14, infer.MASK_LEVELS).sum((1, 2)), 3)},
            "paste": {"box": corners, "height": 90, "width": 120, "x0": x0, "y0": y0, "w": window.shape[1], "h": window.shape[0],
                      "row_counts": window.sum(1).tolist(),
                      "mixed": {"about": "semantic: ((5 y + 3 x) mod 17) / 16, 48x64 cells of 8 px, scale 2 and 2.5, share 0.5, threshold 0.48",
                                "pixels": int(mixed.sum()), "certainty": certainty}},
            "refine": {"about": "the same mask and semantic map, both in pixels of the input; share 0.35, threshold 0.44", "box": corners,
                       "region": listed(region), "certainty": infer.mean_inside(coarse, 0.44),
                       "logits_of_every_5th_row": listed(infer.bent(coarse, 0.44)[::5, ::5], 4)},
            "nms": {"boxes": listed(nb), "scores": listed(ns, 7), "threshold": 0.5, "keep": infer.nms(nb, ns, 0.5, 50).tolist()},
            "decode": {"reference": listed(ref), "deltas": listed(deltas), "height": 384, "width": 512, "boxes": listed(infer.decode(deltas, ref, (384, 512)), 4)}}


def main():
    a = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    a.add_argument("models")
    a.add_argument("out")
    a.add_argument("--precision", default="f32", help="bf16 and f32 differ in the third digit")
    o = a.parse_args()
    seg, m = infer.open_model(o.models, 1, o.precision)
    graphs = seg.g
    os.makedirs(o.out, exist_ok=True)
    bgr = picture()
    cv2.imwrite(os.path.join(o.out, "picture.png"), bgr)
    rgb, fx, fy = infer.letterbox(bgr, graphs.size)
    x = np.ascontiguousarray(rgb.transpose(2, 0, 1)[None], np.float32) / 127.5 - 1
    t = {k: v.copy() for k, v in graphs.trunk(x).items()}
    found = seg(cv2.imread(os.path.join(o.out, "people.jpg")), 0.05)
    out = {"model": m["name"], "trunk": m["trunk"], "precision": o.precision, "resize": [fx, fy],
           "input_sum": float(rgb.astype(np.int64).sum()),
           "trunk_outputs": {k: {"shape": list(v.shape), "mean": float(v.mean()), "first_cell": listed(v[0, 0, 0, :6]),
                                 "middle_cell": listed(v[0, v.shape[1] // 2, v.shape[2] // 2, :6])} for k, v in t.items()},
           "proposals": listed(seg.proposals(t), 2),
           "detections": [{"class": m["classes"][i["class"]], "score": round(i["score"], 4), "box": listed(i["box"], 2), "window_x0": i["window"][0],
                           "window_y0": i["window"][1], "mask_pixels": int(i["window"][2].sum())} for i in found],
           "formulas": formulas()}
    with open(os.path.join(o.out, "golden.json"), "w") as f:
        json.dump(out, f, indent=1)
    print(json.dumps(out["detections"], indent=1))


if __name__ == "__main__":
    main()
