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
import fine_output
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


def main():
    o = tuning.begin(argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter),
                     pictures=9000, epochs=10, batch=32, lr=2e-3, bits=6)
    with open(os.path.join(o.model, "model.json")) as f:
        about = json.load(f)
    for name in ("model.json", *about["sha256"]):
        shutil.copyfile(os.path.join(o.model, name), os.path.join(o.out, name))
    channels = fine_output.add(o.out, about.get("trunk_int8"), STRIDE)
    objects, held = tuning.parted(tuning.gathered(lambda: Gatherer(o.out, o.threads), o))
    head = Refine(channels).to(memory_format=torch.channels_last)
    head.normalise(objects[1][:500])

    def loss(logits, features, masks, _, worth):
        out = head.logits(logits.float(), features.float()).float()
        return tuning.mask_loss(out.flatten(1), masks.float().flatten(1) / 255, worth)

    seen = lambda i: head(held[0][i].float(), held[1][i].float()) >= 0.5
    trained = tuning.train(head, objects, loss, lambda: tuning.held_iou(held, seen), o)
    x = torch.zeros(4, SIDE, SIDE), torch.zeros(4, SIDE, SIDE, channels)
    export.write_graph(o.out, "refine", head.requires_grad_(False), x, ["logits", "features"], ["masks"], free=True)
    print(f"{export.coarse_weights(os.path.join(o.out, 'refine.onnx'), o.bits)} bytes packed")
    about.update(refine="refine.onnx", fine_stride=STRIDE, fine_channels=channels, refine_margin=infer.REFINE_MARGIN)
    about["gflops"]["refine"] = round(2e-9 * SIDE * SIDE * sum(c.weight.numel() for c in (*head.convs, head.last)), 6)
    about["sha256"] = {f: export.sha(os.path.join(o.out, f)) for f in sorted({*about["sha256"], "refine.onnx"})}
    about["training"]["refine"] = trained
    tuning.write_about(about, o)


if __name__ == "__main__":
    main()
