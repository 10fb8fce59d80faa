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
import time
import types

import numpy as np
import torch
import torch.nn.functional as F
from torchvision.ops import roi_align

import export
import infer
from segnet import boxes, cost, dataset, exported, losses, model

PERSON, MOVED = 1, 0.06       # class; standard deviation of moved true boxes' sides, as a share of width or height
SURE = 0.3                    # of the boxes that the network finds, those that it gives at least this
CANVAS = (480, 640)


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
        self.graphs = infer.OpenVino(folder, threads, "f32")
        self.segmenter = infer.Segmenter(self.graphs)

    def boxes_found(self, t, levels):
        proposals = self.segmenter.proposals(t)
        o = self.graphs.box(infer.roi_align(levels, proposals, 7, infer.BOX_LEVELS))
        found = infer.decode(o["deltas"] / infer.BOX_WEIGHTS, proposals, CANVAS)
        sure = o["probabilities"][:, 1:].max(1)
        keep = np.nonzero(sure >= SURE)[0]
        keep = keep[infer.nms(found[keep], sure[keep], 0.8, 50)] if len(keep) else keep
        return found[keep]

    def __call__(self, picture, target, rng):
        """picture uint8 [3, H, W]. Features [n, 14, 14, 96] f16, semantic map [n, 28, 28] f16, masks [n, 28, 28] u8, classes, weights."""
        t = self.graphs.trunk(picture.numpy()[None].astype(np.float32) / 127.5 - 1)
        t = {k: v.copy() for k, v in t.items()}
        levels = [t["p3"][0], t["p4"][0], t["p5"][0]]
        true = target["boxes"].numpy()
        drawn = np.nonzero(target["drawn"].numpy())[0]
        if not len(drawn):
            return None
        size = np.concatenate((true[:, 2:] - true[:, :2],) * 2, 1)
        rois, which = [], []
        found = self.boxes_found(t, levels)
        if len(found):
            overlap = boxes.overlap(torch.from_numpy(found), target["boxes"])[0].numpy()
            best = overlap.argmax(1)
            ok = (overlap.max(1) >= 0.5) & np.isin(best, drawn)
            rois.append(found[ok]), which.append(best[ok])
        moved = true[drawn] + rng.normal(0, MOVED, (len(drawn), 4)).astype(np.float32) * size[drawn]
        moved = np.clip(moved, 0, np.array(CANVAS[::-1] * 2, np.float32))
        ok = (moved[:, 2:] - moved[:, :2] >= 4).all(1)
        rois.append(moved[ok]), which.append(drawn[ok])
        rois, which = np.concatenate(rois).astype(np.float32), np.concatenate(which)
        if not len(rois):
            return None
        features = infer.roi_align(levels, rois, 14, infer.MASK_LEVELS)
        r = torch.from_numpy(rois)
        index = torch.arange(len(rois), dtype=torch.float32)[:, None]
        masks = roi_align(target["masks"][which].float()[:, None], torch.cat((index, r), 1), 28, 1.0, 2, True)[:, 0]
        s = torch.from_numpy(np.ascontiguousarray(t["semantic"][0, :, :, 0]))[None, None]
        semantic = roi_align(s, torch.cat((index * 0, r), 1), 28, 1 / infer.STRIDES[0], 1, True)[:, 0]
        return (torch.from_numpy(features).half(), semantic.half(), (masks * 255).round().byte(), target["labels"][which], target["worth"][which])


def gather(o, data, most):
    gatherer, rng, parts = Gatherer(o.model, o.threads), np.random.default_rng(o.seed), []
    loader = torch.utils.data.DataLoader(data, batch_size=None, num_workers=1, prefetch_factor=8)
    seen, begin = 0, time.time()
    for pictures, targets in loader:
        for picture, target in zip(pictures, targets):
            part = gatherer(picture, target, rng)
            if part is not None:
                parts.append(part)
            seen += 1
            if seen % 500 == 0:
                print(f"{seen} pictures, {sum(len(p[3]) for p in parts)} objects, {time.time() - begin:.0f} s", flush=True)
        if seen >= most:
            break
    return [torch.cat(p) for p in zip(*parts)]


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
    logits = torch.logit(p) - torch.logit(even)
    y = masks.float().flatten(1) / 255
    loss = F.binary_cross_entropy_with_logits(logits, y, reduction="none").mean(1) + 0.5 * losses.dice(logits.sigmoid(), y)
    return (loss * worth).sum() / worth.sum()


def seen_iou(head, held):
    """Mean IoU of persons' masks as they will be seen."""
    features, semantic, masks, labels, _ = held
    total, count = 0.0, 0
    with torch.no_grad():
        for i in torch.arange(len(labels)).split(256):
            i = i[labels[i] == PERSON]
            m = head(features[i].float().permute(0, 3, 1, 2)).sigmoid()[:, 0]
            p = (mixed(m, semantic[i]) >= infer.MASK_THRESHOLD).flatten(1)
            y = (masks[i] >= 128).flatten(1)
            total += ((p & y).sum(1) / (p | y).sum(1).clamp(min=1)).sum().item()
            count += len(i)
    return total / max(1, count)


def main():
    a = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    a.add_argument("model")
    a.add_argument("out")
    a.add_argument("--train", nargs=2, required=True, metavar=("JSON", "IMAGES"))
    a.add_argument("--also", nargs=3, action="append", default=[], metavar=("JSON", "IMAGES", "SHARE"))
    a.add_argument("--pictures", type=int, default=6000)
    a.add_argument("--epochs", type=float, default=12)
    a.add_argument("--batch", type=int, default=64)
    a.add_argument("--lr", type=float, default=5e-4)
    a.add_argument("--threads", type=int, default=2)
    a.add_argument("--seed", type=int, default=1)
    a.add_argument("--bits", type=int, default=7, help="of the weights that are written, each output channel on a grid of its own")
    a.add_argument("--keep", metavar="FILE", help="gathered features: written there, read if there already")
    o = a.parse_args()
    os.makedirs(o.out, exist_ok=True)
    torch.manual_seed(o.seed)
    torch.set_num_threads(o.threads)
    if o.keep and os.path.exists(o.keep):
        stored = torch.load(o.keep)
    else:
        # Half of the pictures nearly plain, none of the canvases a part: boxes as in use.
        now = time.time()
        data = dataset.Batches([(*o.train, None)] + o.also, [o.seed], now - 0.6 * 1e6, now + 0.4 * 1e6, canvases=((*CANVAS, 2), (*CANVAS, 2)))
        stored = gather(o, data, o.pictures)
        if o.keep:
            torch.save(stored, o.keep)
    n = len(stored[3])
    held = [s[-n // 20:] for s in stored]                   # the last pictures
    train = [s[:-n // 20] for s in stored]
    n = len(train[3])
    steps = int(o.epochs * n / o.batch)
    head = plain_mask_head(o.model).requires_grad_(True).to(memory_format=torch.channels_last)
    before = seen_iou(head, held)
    log = open(os.path.join(o.out, "log.jsonl"), "a", buffering=1)
    log.write(json.dumps({"objects": n, "persons": int((train[3] == PERSON).sum()), "steps": steps, "held_iou": round(before, 4)}) + "\n")
    opt = torch.optim.AdamW(head.parameters(), lr=o.lr, betas=(0.9, 0.99), weight_decay=0.01)
    average = {k: v.clone() for k, v in head.state_dict().items()}
    mean, short = None, torch.ops.mkldnn._is_mkldnn_bf16_supported()
    for step in range(steps):
        i = torch.randint(n, (o.batch,))
        batch = [s[i] for s in train]
        flip = torch.rand(()) < 0.5
        if flip:
            batch[:3] = batch[0].flip(2), batch[1].flip(2), batch[2].flip(2)
        for g in opt.param_groups:
            g["lr"] = o.lr * min(1, (step + 1) / 100) * 0.5 * (1 + np.cos(np.pi * step / steps))
        with torch.autocast("cpu", torch.bfloat16, enabled=short):
            loss = loss_of(head, *batch)
        opt.zero_grad()
        loss.backward()
        torch.nn.utils.clip_grad_norm_(head.parameters(), 5.0)
        opt.step()
        for k, v in head.state_dict().items():
            average[k].lerp_(v, 0.005)
        mean = loss.item() if mean is None else 0.99 * mean + 0.01 * loss.item()
        if (step + 1) % 500 == 0 or step + 1 == steps:
            row = {"step": step + 1, "loss": round(mean, 4)}
            if (step + 1) % 2000 == 0 or step + 1 == steps:
                row["held_iou"] = round(seen_iou(head, held), 4)
            log.write(json.dumps(row) + "\n")
    head.load_state_dict(average)
    after = seen_iou(head, held)
    log.write(json.dumps({"averaged": True, "held_iou": round(after, 4)}) + "\n")
    export.write_mask(types.SimpleNamespace(mask=head), o.out)
    path = os.path.join(o.out, "mask.onnx")
    print(f"{export.coarse_weights(path, o.bits)} bytes packed")
    with open(os.path.join(o.model, "model.json")) as f:
        about = json.load(f)
    about["gflops"]["mask"] = cost.gflops(model.MaskRcnn(about["backbone"], len(about["classes"])).eval(), CANVAS)["mask"]
    about["mask_threshold"], about["sha256"]["mask.onnx"] = infer.MASK_THRESHOLD, export.sha(path)
    about["training"]["mask_head"] = {"objects": n, "steps": steps, "held_out_iou": [round(v, 4) for v in (before, after)]}
    with open(os.path.join(o.out, "model.json"), "w") as f:
        json.dump(about, f, indent=1)


if __name__ == "__main__":
    main()
