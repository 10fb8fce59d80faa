#!/usr/bin/env python3
"""Trains the refinement of masks (segnet/refine.py) on what exported graphs make of augmented pictures; the graphs stay as they are.

usage: tune_refine.py MODEL_DIR OUT_DIR --train JSON IMAGES [--also JSON IMAGES SHARE ...] [--pictures 9000] [--epochs 10]

The mask head's masks and features at stride 4 of persons and things are gathered once (160 kB an object in memory, at most five
objects a picture), in boxes as the network itself finds them and in true ones moved a little, with a margin around them. OUT_DIR
receives the whole model: refine.onnx, the trunks with their new output `fine`, the heads as they are, model.json; and log.jsonl.
"""
import argparse
import json
import os
import shutil

import torch
from torchvision.ops import roi_align

import export
import infer
import tuning
from segnet.refine import Refine
from tuning import PERSON

STRIDE, MOST = 4, 5           # of the features; objects of one picture
SIDE = infer.REFINE_SIDE


class Gatherer:
    def __init__(self, folder, threads):
        self.segmenter, _ = infer.open_model(folder, threads, "f32", refine=False)
        self.regions = tuning.Regions(self.segmenter)

    def __call__(self, picture, target, rng):
        """picture uint8 [3, H, W]. Logits [n, S, S] f16, features [n, S, S, C] f16, masks [n, S, S] u8, classes, weights."""
        t, levels = self.regions.trunk(picture)
        rois, which = self.regions(t, levels, target, rng)
        if len(rois) > MOST:
            some = rng.permutation(len(rois))[:MOST]
            rois, which = rois[some], which[some]
        if not len(rois):
            return None
        labels = target["labels"][which]
        masks = self.segmenter.g.mask(infer.roi_align(levels, rois, 14, infer.MASK_LEVELS))["masks"]
        wide = infer.grown(rois, infer.REFINE_MARGIN)
        logits, _ = self.segmenter.refine_inputs(t, masks, rois, labels.numpy() - PERSON, wide)
        features = infer.roi_align([t["fine"][0]], wide, SIDE, (), (STRIDE,))
        true = roi_align(target["masks"][which].float()[:, None], tuning.with_index(wide), SIDE, 1.0, 2, True)[:, 0]
        return (torch.from_numpy(logits).half(), torch.from_numpy(features).half(), (true * 255).round().byte(), labels, target["worth"][which])


def held_iou(head, held):
    """Mean IoU of persons' masks within their regions."""
    logits, features, masks, labels, _ = held
    total, persons = 0.0, (labels == PERSON).nonzero()[:, 0]
    with torch.no_grad():
        for i in persons.split(128):
            p = (head(logits[i].float(), features[i].float()) >= 0.5).flatten(1)
            y = (masks[i] >= 128).flatten(1)
            total += ((p & y).sum(1) / (p | y).sum(1).clamp(min=1)).sum().item()
    return total / max(1, len(persons))


def write(head, o, channels):
    """The whole model into the folder o.out; returns what model.json becomes."""
    x = torch.zeros(4, SIDE, SIDE), torch.zeros(4, SIDE, SIDE, channels)
    export.write_graph(o.out, "refine", head.requires_grad_(False), x, ["logits", "features"], ["masks"], free=True)
    print(f"{export.coarse_weights(os.path.join(o.out, 'refine.onnx'), o.bits)} bytes packed")
    with open(os.path.join(o.out, "model.json")) as f:
        about = json.load(f)
    about.update(refine="refine.onnx", fine_stride=STRIDE, fine_channels=channels, refine_margin=infer.REFINE_MARGIN)
    multiply_adds = SIDE * SIDE * sum(c.weight.numel() for c in (*head.convs, head.last))
    about["gflops"]["refine"] = round(2e-9 * multiply_adds, 6)
    about["sha256"] = {f: export.sha(os.path.join(o.out, f)) for f in sorted({*about["sha256"], "refine.onnx"})}
    return about


def main():
    a = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    tuning.add_arguments(a, pictures=9000, epochs=10, batch=32, lr=2e-3, bits=6)
    o = a.parse_args()
    os.makedirs(o.out, exist_ok=True)
    torch.manual_seed(o.seed)
    torch.set_num_threads(o.threads)
    with open(os.path.join(o.model, "model.json")) as f:
        about = json.load(f)
    for name in ("model.json", *about["sha256"]):
        shutil.copyfile(os.path.join(o.model, name), os.path.join(o.out, name))
    channels = export.add_fine(o.out, about.get("trunk_int8"), STRIDE)
    objects, held = tuning.parted(tuning.gathered(o.keep, lambda: Gatherer(o.out, o.threads), o))
    head = Refine(channels).to(memory_format=torch.channels_last)
    head.normalise(objects[1][:500])

    def loss(i, mirrored):
        logits, features, masks, _, worth = (s[i] for s in objects)
        logits, features, masks = logits.float(), features.float(), masks.float() / 255
        if mirrored:
            logits, features, masks = logits.flip(2), features.flip(2), masks.flip(2)
        return tuning.mask_loss(head.logits(logits, features).float().flatten(1), masks.flatten(1), worth)

    with open(os.path.join(o.out, "log.jsonl"), "a", buffering=1) as log:
        steps, before, after = tuning.train(head, len(objects[3]), loss, lambda: held_iou(head, held), o, log)
    about = write(head, o, channels)
    about["training"]["refine"] = {"objects": len(objects[3]), "steps": steps, "held_out_iou": [round(before, 4), round(after, 4)]}
    with open(os.path.join(o.out, "model.json"), "w") as f:
        json.dump(about, f, indent=1)


if __name__ == "__main__":
    main()
