#!/usr/bin/env python3
"""Cost of the network with each backbone: parameters, GFLOPs (2 x multiply-adds) and OpenVINO's time for the trunk (untrained weights)."""
import argparse
import tempfile
import time

import numpy as np
import torch

from segnet import backbones, model
import export


def multiply_adds(net, size, proposals=50, masks=5):
    total = [0]

    def conv(m, _, out):
        total[0] += out.numel() * m.weight.numel() // m.weight.shape[0]

    hooks = []
    for m in net.modules():
        if isinstance(m, (torch.nn.Conv2d, torch.nn.Linear)):
            hooks.append(m.register_forward_hook(conv))
    with torch.no_grad():
        net.trunk(torch.zeros(1, 3, *size))
        trunk = total[0]
        net.box(torch.zeros(proposals, 49 * model.CHANNELS))
        net.mask(torch.zeros(masks, model.CHANNELS, 14, 14))
    for h in hooks:
        h.remove()
    return trunk, total[0]


def main():
    a = argparse.ArgumentParser(description=__doc__)
    a.add_argument("--size", default="384x512")
    a.add_argument("--threads", type=int, default=2)
    a.add_argument("--no-time", action="store_true")
    o = a.parse_args()
    size = tuple(int(v) for v in o.size.split("x"))
    print("| backbone | parameters (M) | trunk GFLOPs | all GFLOPs (50 proposals, 5 masks) | trunk ms, median |")
    print("|---|---|---|---|---|")
    for name in backbones.MAKERS:
        net = export.fuse(model.MaskRcnn(name).eval()).requires_grad_(False)
        trunk, everything = multiply_adds(net, size)
        ms = "-"
        if not o.no_time:
            import openvino as ov
            with tempfile.TemporaryDirectory() as d:
                export.write_onnx(net, d, size)
                r = ov.Core().compile_model(d + "/trunk.onnx", "CPU", {"INFERENCE_NUM_THREADS": o.threads, "NUM_STREAMS": 1}).create_infer_request()
                x, laps = np.zeros((1, 3, *size), np.float32), []
                for _ in range(25):
                    t = time.perf_counter()
                    r.infer([x], share_inputs=True)
                    laps.append((time.perf_counter() - t) * 1e3)
                ms = f"{np.median(laps[5:]):.1f}"
        print(f"| {name} | {sum(p.numel() for p in net.parameters()) / 1e6:.1f} | {2e-9 * trunk:.2f} | {2e-9 * everything:.2f} | {ms} |", flush=True)


if __name__ == "__main__":
    main()
