#!/usr/bin/env python3
"""Start weights of the backbone from a COCO detector in TensorFlow.js form (SSDLite with MobileNetV2). See README.md.

The folder holds `model.json` and the shards that its `weightsManifest` names. Batch normalisation is folded in there but for the
depth-wise convolutions, whose factor is a tensor of its own. Written: `.npz` by torchvision's layer names, as `train.py --start` reads.
"""
import argparse
import json
import pathlib
import sys

import numpy as np

ROOT = "FeatureExtractor/MobilenetV2/"
BLOCKS = 17


def tensors(folder):
    """Every float32 tensor by its name."""
    stored = {}
    for group in json.loads((folder / "model.json").read_text())["weightsManifest"]:
        data = b"".join((folder / p).read_bytes() for p in group["paths"])
        place = 0
        for w in group["weights"]:
            if "quantization" in w:
                raise ValueError(f"{folder}: {w['name']} is quantised; take a model with float32 weights")
            n = int(np.prod(w["shape"])) * np.dtype(w["dtype"]).itemsize
            if w["dtype"] == "float32":
                stored[w["name"]] = np.frombuffer(data, np.float32, n // 4, place).reshape(w["shape"])
            place += n
        if place != len(data):
            raise ValueError(f"{folder}: the shards hold {len(data)} bytes, model.json describes {place}")
    return stored


def convolution(stored, name):
    """Weight [out, in / groups, k, k] and bias [out] with batch normalisation folded in. TensorFlow has [k, k, in, out]."""
    bias = stored[f"{ROOT}{name}/BatchNorm/batchnorm/sub"]
    depthwise = f"{ROOT}{name}/depthwise_weights"
    if depthwise in stored:
        factor = stored[f"{ROOT}{name}/BatchNorm/batchnorm/mul"]
        return stored[depthwise].transpose(2, 3, 0, 1) * factor[:, None, None, None], bias
    return stored[f"{ROOT}{name}/Conv2D/merged_input"].transpose(3, 2, 0, 1), bias


def layers():
    """(theirs, torchvision's name) of the 51 convolutions up to 320 channels."""
    yield "Conv", "features.0.0"
    for b in range(BLOCKS):
        theirs = "expanded_conv" + (f"_{b}" if b else "")
        parts = ["expand", "depthwise", "project"] if b else ["depthwise", "project"]
        for i, part in enumerate(parts):
            yield f"{theirs}/{part}", f"features.{b + 1}.conv.{i}" + ("" if part == "project" else ".0")


def main():
    a = argparse.ArgumentParser(description=__doc__)
    a.add_argument("folder", type=pathlib.Path, help="of model.json and its shards")
    a.add_argument("out", help=".npz to write")
    o = a.parse_args()
    try:
        stored = tensors(o.folder)
        out = {}
        for theirs, ours in layers():
            out[ours + ".weight"], out[ours + ".bias"] = convolution(stored, theirs)
    except KeyError as e:
        sys.exit(f"error: {o.folder}: no tensor {e}; wanted is SSDLite with MobileNetV2 1.0")
    except (OSError, ValueError) as e:
        sys.exit(f"error: {e}")
    np.savez(o.out, **out)
    print(f"{o.out}: {len(out) // 2} convolutions, {sum(v.size for v in out.values()):,} numbers")


if __name__ == "__main__":
    main()
