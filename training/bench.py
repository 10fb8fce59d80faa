#!/usr/bin/env python3
"""Milliseconds of each exported graph and of the whole reference inference. On a busy machine read the minimum and the CPU time.

usage: bench.py MODEL_DIR IMAGE [--threads 1 2] [--precision f32]
"""
import argparse
import time

import cv2
import numpy as np

import infer


def laps(call, repeats):
    out, busy = [], time.process_time()
    for _ in range(repeats):
        t = time.perf_counter()
        call()
        out.append((time.perf_counter() - t) * 1e3)
    busy = (time.process_time() - busy) / repeats * 1e3
    return f"min {min(out):6.2f}  median {np.median(out):6.2f}  CPU time, all threads {busy:6.2f}"


def main():
    a = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    a.add_argument("models")
    a.add_argument("image")
    a.add_argument("--threads", type=int, nargs="*", default=[1, 2])
    a.add_argument("--precision")
    a.add_argument("--int8", action="store_true", help="the trunk in INT8")
    a.add_argument("--size", help="of the network's input, height x width")
    a.add_argument("--repeats", type=int, default=40)
    o = a.parse_args()
    bgr = cv2.imread(o.image)
    for threads in o.threads:
        s, m = infer.open_model(o.models, threads, o.precision, o.int8, infer.size_of(o.size))
        x = np.zeros((1, 3, *s.g.size), np.float32)
        boxes, masks = np.zeros((infer.PROPOSALS, 7, 7, 96), np.float32), np.zeros((4, 14, 14, 96), np.float32)
        calls = {"trunk": lambda: s.g.trunk(x), f"box head, {infer.PROPOSALS} regions": lambda: s.g.box(boxes),
                 "mask head, 4 regions": lambda: s.g.mask(masks)}
        if s.g.refines:
            side = infer.REFINE_SIDE
            logits, fine = np.zeros((4, side, side), np.float32), np.zeros((4, side, side, m["fine_channels"]), np.float32)
            calls["refinement, 4 regions"] = lambda: s.g.refine(logits, fine)
        for name, call in calls.items():
            call()
            print(f"{threads} threads  {name:22} {laps(call, o.repeats)}", flush=True)
        print(f"{threads} threads  {'all, this reference':22} {laps(lambda: s(bgr, 0.5), 10)}", flush=True)


if __name__ == "__main__":
    main()
