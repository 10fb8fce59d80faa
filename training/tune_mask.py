#!/usr/bin/env python3
"""Trains the mask head alone, on the features of exported graphs: minutes instead of hours, and trunk and boxes stay as they are.

usage: tune_mask.py MODEL_DIR OUT_DIR --train JSON IMAGES [--also JSON IMAGES SHARE ...] [--pictures 6000] [--epochs 12]

Features and masks of the persons and things in augmented pictures are gathered once (some 100 kB an object in memory), in boxes as
the network itself finds them and in true ones moved a little. The loss is that of what will be seen: a person's mask is the head's
mixed with the semantic map (README, step 7), so the head learns what the map lacks. OUT_DIR receives mask.onnx, model.json and log.jsonl.
"""
import argparse
import json
import os
import types

import numpy as np
import torch
from torchvision.ops import roi_align

import export
import infer
import tuning
from segnet import cost, exported, model
from tuning import CANVAS, PERSON


def plain_mask_head(folder):
    """The head with the exported weights; batch normalisation was folded into them and is not brought back."""
    stored = exported.weights(folder, "mask")
    head = export.fuse(model.MaskHead().eval())
    for name, module in head.named_modules():
        if not hasattr(module, "weight"):
            continue
        if f"head.{name}.weight" in stored:
            module.weight.data.copy_(stored[f"head.{name}.weight"])
            module.bias.data.copy_(stored[f"head.{name}.bias"])
        else:                                              # of a head with fewer layers: begins as the identity
            torch.nn.init.dirac_(module.weight)
            module.weight.data.add_(torch.randn_like(module.weight) * 0.01)
            module.bias.data.zero_()
    return head


class Gatherer:
    def __init__(self, folder, threads):
        self.regions = tuning.Regions(infer.open_model(folder, threads, "f32", refine=False)[0])

    def __call__(self, picture, target, rng):
        """picture uint8 [3, H, W]. Features [n, 14, 14, 96] f16, semantic map [n, 28, 28] f16, masks [n, 28, 28] u8, classes, weights."""
        t, levels = self.regions.trunk(picture)
        rois, which = self.regions(t, levels, target, rng)
        if not len(rois):
            return None
        features = infer.roi_align(levels, rois, 14, infer.MASK_LEVELS)
        masks = roi_align(target["masks"][which].float()[:, None], tuning.with_index(rois), 28, 1.0, 2, True)[:, 0]
        s = torch.from_numpy(np.ascontiguousarray(t["semantic"][0, :, :, 0]))[None, None]
        semantic = roi_align(s, tuning.with_index(rois, same=True), 28, 1 / infer.STRIDES[0], 1, True)[:, 0]
        return (torch.from_numpy(features).half(), semantic.half(), (masks * 255).round().byte(), target["labels"][which], target["worth"][which])


def mixed(person, semantic):
    """A person's mask as it is pasted, before the threshold."""
    return (1 - infer.SEMANTIC_SHARE) * person + infer.SEMANTIC_SHARE * semantic.float()


def loss_of(head, features, semantic, masks, labels, worth):
    m = head(features.float().permute(0, 3, 1, 2)).float().sigmoid()
    person = labels == PERSON
    p = torch.where(person[:, None, None], mixed(m[:, 0], semantic), m[:, 1]).flatten(1)
    # Seen is what lies above the threshold: p is bent so that it is even odds there.
    p = p.clamp(1e-4, 1 - 1e-4)
    even = torch.where(person, infer.MASK_THRESHOLD, 0.5)[:, None]
    return tuning.mask_loss(torch.logit(p) - torch.logit(even), masks.float().flatten(1) / 255, worth)


def main():
    o = tuning.begin(argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter),
                     pictures=6000, epochs=12, batch=64, lr=5e-4, bits=7)
    objects, held = tuning.parted(tuning.gathered(lambda: Gatherer(o.model, o.threads), o))
    head = plain_mask_head(o.model).requires_grad_(True).to(memory_format=torch.channels_last)
    features, semantic = held[:2]

    def seen(i):
        m = head(features[i].float().permute(0, 3, 1, 2)).sigmoid()[:, 0]
        return mixed(m, semantic[i]) >= infer.MASK_THRESHOLD

    trained = tuning.train(head, objects, lambda *batch: loss_of(head, *batch), lambda: tuning.held_iou(held, seen), o)
    export.write_mask(types.SimpleNamespace(mask=head), o.out)
    path = os.path.join(o.out, "mask.onnx")
    print(f"{export.coarse_weights(path, o.bits)} bytes packed")
    with open(os.path.join(o.model, "model.json")) as f:
        about = json.load(f)
    about["gflops"]["mask"] = cost.gflops(model.MaskRcnn(about["backbone"], len(about["classes"])).eval(), CANVAS)["mask"]
    about["mask_threshold"], about["sha256"]["mask.onnx"] = infer.MASK_THRESHOLD, export.sha(path)
    about["training"]["mask_head"] = trained
    tuning.write_about(about, o)


if __name__ == "__main__":
    main()
