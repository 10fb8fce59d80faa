#!/usr/bin/env python3
"""The paper's Table II for our networks, as Markdown: cost, accuracy and speed of the whole network with each backbone.

Cost is counted (10^9 operations, two to a multiply-add; 100 proposals, 5 masks). Speed is OpenVINO's time for the trunk, the box head of
100 regions and the mask head of 5, without what is done between them; all backbones take turns, so that a busy machine is as unkind to
each. The time does not depend on the weights, so backbones that nobody has trained are timed with random ones. Accuracy is given for what
is trained: models/scores.json. The refinement of masks, 0.13 GFLOPs each, is in the accuracy alone.

usage: table2.py [--threads 2] [--rounds 30] [--no-time] [--json OUT]
"""
import argparse
import json
import os
import tempfile
import time

import numpy as np

from segnet import backbones, cost, model
import export
import infer

PROPOSALS, MASKS = 100, 5
TRAINED = os.path.join(os.path.dirname(os.path.abspath(__file__)), "..", "models")


class Timed:
    """The three graphs of one network."""

    def __init__(self, net, size, threads, precision):
        import openvino as ov
        options = {"INFERENCE_NUM_THREADS": threads, "NUM_STREAMS": 1, "INFERENCE_PRECISION_HINT": precision}
        shapes = (("trunk", (1, 3, *size)), ("box", (PROPOSALS, 7, 7, model.CHANNELS)), ("mask", (MASKS, 14, 14, model.CHANNELS)))
        self.parts, self.laps = [], []
        with tempfile.TemporaryDirectory() as folder:
            export.write_onnx(net, folder, size)
            for name, shape in shapes:
                graph = ov.Core().read_model(os.path.join(folder, name + ".onnx"))
                graph.reshape(list(shape))
                self.parts.append((ov.Core().compile_model(graph, "CPU", options).create_infer_request(), np.zeros(shape, np.float32)))

    def lap(self):
        start = time.perf_counter()
        for request, x in self.parts:
            request.infer([x], share_inputs=True)
        self.laps.append((time.perf_counter() - start) * 1e3)


def accuracy():
    """Backbone -> its scores on the held-out pictures."""
    with open(os.path.join(TRAINED, "model.json")) as f:
        backbone = json.load(f)["backbone"]
    with open(os.path.join(TRAINED, "scores.json")) as f:
        return {backbone: json.load(f)["coco_640"]}          # the size that is timed


def main():
    a = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    a.add_argument("--size", default="480x640")
    a.add_argument("--threads", type=int, default=2)
    a.add_argument("--precision", default="bf16", choices=("bf16", "f32"), help="bf16 where the CPU has it")
    a.add_argument("--rounds", type=int, default=30)
    a.add_argument("--no-time", action="store_true")
    a.add_argument("--json")
    o = a.parse_args()
    size = infer.size_of(o.size)
    trained, rows, timed = accuracy(), {}, {}
    for name in backbones.MAKERS:
        net = export.fuse(model.MaskRcnn(name).eval()).requires_grad_(False)
        g = cost.gflops(net, size)
        rows[name] = {"parameters": sum(p.numel() for p in net.parameters()), "trunk_gflops": g["trunk"],
                      "gflops": g["trunk"] + PROPOSALS * g["box"] + MASKS * g["mask"]}
        if name in trained:
            rows[name].update(person_mask_ap50=trained[name]["person_segm_ap50"], person_pixel_iou=trained[name]["person_pixel_iou"])
        if not o.no_time:
            timed[name] = Timed(net, size, o.threads, o.precision)
    for _ in range(o.rounds + 3 if timed else 0):
        for t in timed.values():
            t.lap()
    for name, t in timed.items():
        rows[name].update(ms_median=float(np.median(t.laps[3:])), ms_min=float(min(t.laps[3:])))
    print("| backbone | parameters (M) | GFLOPs | of them trunk | person mask AP50 | person pixel IoU | ms, median | least |")
    print("|---|---|---|---|---|---|---|---|")
    for name, r in rows.items():
        score = [f"{r[k]:.3f}" if k in r else "not trained" for k in ("person_mask_ap50", "person_pixel_iou")]
        ms = [f"{r[k]:.1f}" if k in r else "-" for k in ("ms_median", "ms_min")]
        print("| " + " | ".join([name, f"{r['parameters'] / 1e6:.1f}", f"{r['gflops']:.2f}", f"{r['trunk_gflops']:.2f}", *score, *ms]) + " |")
    if o.json:
        with open(o.json, "w") as f:
            json.dump({"threads": o.threads, "precision": o.precision, "rounds": o.rounds, "backbones": rows}, f, indent=1)


if __name__ == "__main__":
    main()
