#!/usr/bin/env python3
"""Check point -> three ONNX graphs (trunk, box head, mask head), model.json, and the trunk in INT8 where wanted.

usage: export.py CHECKPOINT OUT_DIR [--average CHECKPOINT ...] [--size 480x640] [--int8 COCO_JSON IMAGES]
"""
import argparse
import hashlib
import json
import os
import zlib

import numpy as np
import torch
from torch import nn
from torch.nn.utils.fusion import fuse_conv_bn_eval

import infer
from segnet import boxes, cost, model


def fuse(m):
    """Batch normalisation into the convolution before it."""
    for name, child in m.named_children():
        if isinstance(child, nn.Sequential):
            layers, k = list(child), 0
            while k + 1 < len(layers):
                if isinstance(layers[k], nn.Conv2d) and isinstance(layers[k + 1], nn.BatchNorm2d):
                    layers[k:k + 2] = [fuse_conv_bn_eval(layers[k], layers[k + 1])]
                k += 1
            if len(layers) != len(child):
                setattr(m, name, nn.Sequential(*layers))
                child = getattr(m, name)
        fuse(child)
    return m


class Trunk(nn.Module):
    """Channels last everywhere: the C++ side reads whole feature vectors of a cell."""

    def __init__(self, net):
        super().__init__()
        self.net = net

    def forward(self, image):
        p, obj, deltas, semantic = self.net.trunk(image)
        return tuple(t.permute(0, 2, 3, 1) for t in (*p, *obj, *deltas, semantic.sigmoid()))


class Box(nn.Module):
    def __init__(self, net):
        super().__init__()
        self.head = net.box

    def forward(self, rois):
        score, deltas = self.head(rois.flatten(1))
        return score.softmax(1), deltas


class Mask(nn.Module):
    def __init__(self, net):
        super().__init__()
        self.head = net.mask

    def forward(self, rois):
        return self.head(rois.permute(0, 3, 1, 2)).sigmoid()


TRUNK_INT8 = "trunk.int8.xml"       # its weights are beside it in trunk.int8.bin
TRUNK_OUT = ["p3", "p4", "p5", "objectness3", "objectness4", "objectness5", "deltas3", "deltas4", "deltas5", "semantic"]


def load(path, *earlier):
    """Of several check points of one training the mean of the weights (Izmailov et al., Averaging weights leads to wider optima and
    better generalization, UAI 2018), with the state of the first."""
    state = torch.load(path, map_location="cpu", weights_only=False)
    sets = [state["ema"]] + [torch.load(p, map_location="cpu", weights_only=False)["ema"] for p in earlier]
    mean = {k: sum(s[k] for s in sets) / len(sets) if v.is_floating_point() else v for k, v in sets[0].items()}
    net = model.MaskRcnn(state["backbone"], len(state["names"]))
    net.load_state_dict(mean)
    return fuse(net.eval()).requires_grad_(False), state


def write_onnx(net, out, size):
    write_graph(out, "trunk", Trunk(net), (torch.zeros(1, 3, *size),), ["image"], TRUNK_OUT)
    write_graph(out, "box", Box(net), (torch.zeros(4, 7, 7, model.CHANNELS),), ["rois"], ["probabilities", "deltas"], free=True)
    write_mask(net, out)


def write_mask(net, out):
    """net: anything whose `mask` is the mask head."""
    write_graph(out, "mask", Mask(net), (torch.zeros(4, 14, 14, model.CHANNELS),), ["rois"], ["masks"], free=True)


def write_graph(out, name, module, x, given, outs, free=False):
    """x, given: inputs and their names. free: any number of rois."""
    path = os.path.join(out, name + ".onnx")
    torch.onnx.export(module.eval(), x, path, input_names=given, output_names=outs, opset_version=10, dynamo=False,
                      dynamic_axes={n: {0: "n"} for n in (*given, *outs)} if free else None)
    bake_padding(path)
    round_weights(path)


def bake_padding(path):
    """Padding before a convolution becomes the convolution's own, and what is not needed any more goes.

    The exporter computes the amounts with a chain of nodes, which simpler runtimes cannot follow.
    """
    import onnx
    m = onnx.load(path)
    nodes = list(m.graph.node)
    maker = {o: n for n in nodes for o in n.output}
    for n in nodes:
        before = maker.get(n.input[0]) if n.op_type == "Conv" else None
        if before is None or before.op_type != "Pad":
            continue
        attribute = next(a for a in n.attribute if a.name == "pads")
        kernel = next(a for a in n.attribute if a.name == "kernel_shape").ints
        if list(attribute.ints) != [0, 0, 0, 0]:
            raise ValueError(f"{n.name}: padded twice")
        attribute.ints[:] = [0, 0, kernel[0] // 2, kernel[1] // 2]          # see backbones.SameConv
        n.input[0] = before.input[0]
    needed, kept = {o.name for o in m.graph.output}, []
    for n in reversed(nodes):
        if needed & set(n.output):
            kept.append(n)
            needed |= set(n.input)
    del m.graph.node[:]
    m.graph.node.extend(reversed(kept))
    onnx.checker.check_model(m)
    onnx.save(m, path)


def calibration(json_path, images, size, most=200):
    """Training pictures as the network sees them; every second one zoomed into, so that bodies of all sizes occur."""
    import cv2
    with open(json_path) as f:
        listed = json.load(f)["images"]
    rng = np.random.default_rng(0)
    for i in rng.permutation(len(listed))[:most]:
        bgr = cv2.imread(os.path.join(images, listed[i]["file_name"]))
        if rng.random() < 0.5:
            h, w = bgr.shape[:2]
            f = rng.uniform(0.4, 0.9)
            y, x = int(rng.uniform(0, h * (1 - f))), int(rng.uniform(0, w * (1 - f)))
            bgr = bgr[y:y + int(h * f), x:x + int(w * f)]
        rgb, _, _ = infer.letterbox(bgr, size)
        yield np.ascontiguousarray(rgb.transpose(2, 0, 1)[None], np.float32) / 127.5 - 1


def quantise(out, pictures):
    """The trunk in INT8, in OpenVINO's format, beside the ONNX one. The heads take too little time to be worth it."""
    import nncf
    import openvino as ov
    m = ov.Core().read_model(os.path.join(out, "trunk.onnx"))
    # The last 1x1 convolutions are cheap, and coarse steps in scores and box sizes cost accuracy.
    last = [n.get_friendly_name() for n in m.get_ops() if n.get_type_name() == "Convolution"
            and any(p in n.get_friendly_name() for p in ("objectness", "deltas", "semantic"))]
    # Weights of seven bits: processors without VNNI, which this trunk is for, add pairs of products in 16 bits, and eight overflow.
    narrow = nncf.AdvancedQuantizationParameters(overflow_fix=nncf.OverflowFix.ENABLE)
    q = nncf.quantize(m, nncf.Dataset(pictures), subset_size=len(pictures), ignored_scope=nncf.IgnoredScope(names=last),
                      advanced_parameters=narrow)
    ov.save_model(q, os.path.join(out, TRUNK_INT8), compress_to_fp16=True)


def change_weights(path, change):
    """Every float32 array of the graph becomes what `change` makes of it."""
    import onnx
    from onnx import numpy_helper
    m = onnx.load(path)
    for i in m.graph.initializer:
        w = numpy_helper.to_array(i)
        if w.dtype == np.float32:
            i.CopyFrom(numpy_helper.from_array(change(w).astype(np.float32), i.name))
    onnx.save(m, path)


def round_weights(path):
    """Weights with the 7 bits of mantissa that bfloat16 has, as which fast processors take them anyway: files pack to a third."""
    def rounded(w):
        bits = w.view(np.uint32).astype(np.uint64)
        bits = (bits + 0x7FFF + ((bits >> 16) & 1)) & 0xFFFF0000              # to the nearest, ties to even
        return bits.astype(np.uint32).view(np.float32)
    change_weights(path, rounded)


def coarse_weights(path, bits):
    """Weights on a grid, whose step is a power of two of each output channel's own: files pack smaller still. Returns that size."""
    def on_grid(w):
        if w.ndim < 2:
            return w
        rows = w.reshape(len(w), -1)
        step = 2.0 ** np.ceil(np.log2(np.maximum(np.abs(rows).max(1, keepdims=True), 1e-12) / (2 ** (bits - 1) - 1)))
        return (np.round(rows / step) * step).reshape(w.shape)
    change_weights(path, on_grid)
    with open(path, "rb") as f:
        return len(zlib.compress(f.read(), 9))


def sha(path):
    with open(path, "rb") as f:
        return hashlib.sha256(f.read()).hexdigest()


def about(net, state, out, size, int8):
    files = sorted(f for f in os.listdir(out) if f.endswith((".onnx", ".xml", ".bin")))
    return {"format": 1, "name": "semvslam-maskrcnn-" + state["backbone"], "backbone": state["backbone"],
            "trunk": "trunk.onnx", "box": "box.onnx", "mask": "mask.onnx", **({"trunk_int8": TRUNK_INT8} if int8 else {}),
            "input": {"height": size[0], "width": size[1], "channels": "RGB", "range": [-1, 1], "pad": 127}, "classes": state["names"],
            "strides": boxes.STRIDES, "anchor_sizes": boxes.SIZES, "anchor_ratios": boxes.RATIOS, "box_weights": boxes.BOX_WEIGHTS,
            "box_levels": boxes.BOX_LEVELS, "mask_levels": boxes.MASK_LEVELS, "feature_channels": model.CHANNELS,
            "semantic_share": infer.SEMANTIC_SHARE, "mask_threshold": infer.MASK_THRESHOLD, "gflops": cost.gflops(net, size),
            "training": {"steps": state["step"], "images_seen": state["seen"]}, "sha256": {f: sha(os.path.join(out, f)) for f in files}}


def main():
    a = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    a.add_argument("checkpoint")
    a.add_argument("out")
    a.add_argument("--average", nargs="+", default=[], metavar="CHECKPOINT", help="earlier runs' ends, to average the weights with")
    a.add_argument("--size", default="480x640")
    a.add_argument("--int8", nargs=2, metavar=("COCO_JSON", "IMAGES"))
    o = a.parse_args()
    os.makedirs(o.out, exist_ok=True)
    size = infer.size_of(o.size)
    net, state = load(o.checkpoint, *o.average)
    write_onnx(net, o.out, size)
    if o.int8:
        quantise(o.out, list(calibration(*o.int8, size)))
    with open(os.path.join(o.out, "model.json"), "w") as f:
        json.dump(about(net, state, o.out, size, bool(o.int8)), f, indent=1)
    print(json.dumps({f: os.path.getsize(os.path.join(o.out, f)) for f in sorted(os.listdir(o.out))}, indent=1))


if __name__ == "__main__":
    main()
