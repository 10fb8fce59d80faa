"""Training one part of an exported network alone: what the graphs make of augmented pictures is gathered once, then trained on."""
import json
import os
import time

import numpy as np
import torch

import infer
from segnet import boxes, dataset, losses

PERSON, MOVED = 1, 0.06       # class; standard deviation of moved true boxes' sides, as a share of width or height
SURE = 0.3                    # of the boxes that the network finds, those that it gives at least this
CANVAS = (480, 640)


class Regions:
    """The boxes in which masks are asked for."""

    def __init__(self, segmenter):
        self.segmenter = segmenter

    def trunk(self, picture):
        """picture: uint8 [3, H, W]. What the trunk gives, and of that the pyramid's levels."""
        x = picture.numpy()[None].astype(np.float32) / 127.5 - 1
        t = {k: v.copy() for k, v in self.segmenter.g.trunk(x).items()}
        return t, [t["p3"][0], t["p4"][0], t["p5"][0]]

    def found(self, t, levels):
        """Boxes as the network finds them."""
        proposals = self.segmenter.proposals(t)
        o = self.segmenter.g.box(infer.roi_align(levels, proposals, 7, infer.BOX_LEVELS))
        found = infer.decode(o["deltas"] / infer.BOX_WEIGHTS, proposals, CANVAS)
        sure = o["probabilities"][:, 1:].max(1)
        keep = np.nonzero(sure >= SURE)[0]
        keep = keep[infer.nms(found[keep], sure[keep], 0.8, 50)] if len(keep) else keep
        return found[keep]

    def __call__(self, t, levels, target, rng):
        """Found boxes on objects whose mask is known, and their true boxes moved a little: [n, 4], and which object each is on."""
        true = target["boxes"].numpy()
        drawn = np.nonzero(target["drawn"].numpy())[0]
        if not len(drawn):
            return np.zeros((0, 4), np.float32), np.zeros(0, int)
        size = np.concatenate((true[:, 2:] - true[:, :2],) * 2, 1)
        rois, which = [], []
        found = self.found(t, levels)
        if len(found):
            overlap = boxes.overlap(torch.from_numpy(found), target["boxes"])[0].numpy()
            best = overlap.argmax(1)
            ok = (overlap.max(1) >= 0.5) & np.isin(best, drawn)
            rois.append(found[ok]), which.append(best[ok])
        moved = true[drawn] + rng.normal(0, MOVED, (len(drawn), 4)).astype(np.float32) * size[drawn]
        moved = np.clip(moved, 0, np.array(CANVAS[::-1] * 2, np.float32))
        ok = (moved[:, 2:] - moved[:, :2] >= 4).all(1)
        rois.append(moved[ok]), which.append(drawn[ok])
        return np.concatenate(rois).astype(np.float32), np.concatenate(which)


def with_index(boxes_, same=False):
    """[n, 5] for torchvision's roi_align: every box in a picture of its own, or all in the `same`."""
    b = torch.from_numpy(boxes_)
    index = torch.arange(len(b), dtype=torch.float32)[:, None]
    return torch.cat((index * 0 if same else index, b), 1)


def gathered(gatherer, o):
    """What a gatherer sees in augmented pictures, half of them nearly plain, boxes as in use; from the file o.keep if that is there.

    gatherer() gives the function (picture, target, rng) -> tensors with a row per object, or None. o: of the command line.
    """
    if o.keep and os.path.exists(o.keep):
        return torch.load(o.keep)
    see, now = gatherer(), time.time()
    data = dataset.Batches([(*o.train, None)] + o.also, [o.seed], now - 0.6 * 1e6, now + 0.4 * 1e6, canvases=((*CANVAS, 2), (*CANVAS, 2)))
    rng, parts, seen = np.random.default_rng(o.seed), [], 0
    for pictures, targets in torch.utils.data.DataLoader(data, batch_size=None, num_workers=1, prefetch_factor=8):
        for picture, target in zip(pictures, targets):
            part = see(picture, target, rng)
            if part is not None:
                parts.append(part)
            seen += 1
            if seen % 500 == 0:
                print(f"{seen} pictures, {sum(len(p[0]) for p in parts)} objects, {time.time() - now:.0f} s", flush=True)
        if seen >= o.pictures:
            break
    stored = [torch.cat(p) for p in zip(*parts)]
    if o.keep:
        torch.save(stored, o.keep)
    return stored


def parted(stored):
    """(to train on, held out): the last twentieth of the objects, which are of pictures of their own, is held out."""
    n = len(stored[0]) // 20
    return [s[:-n] for s in stored], [s[-n:] for s in stored]


def mask_loss(logits, masks, worth):
    """logits, masks [n, pixels]; worth [n]: cross-entropy and overlap (dice) of each, weighted."""
    loss = torch.nn.functional.binary_cross_entropy_with_logits(logits, masks, reduction="none").mean(1) + 0.5 * losses.dice(logits.sigmoid(), masks)
    return (loss * worth).sum() / worth.sum()


def held_iou(held, seen):
    """Mean IoU of persons' masks. held: masks, u8, third, classes fourth. seen(indices) -> bool, of the masks' shape."""
    masks, labels = held[2:4]
    total, persons = 0.0, (labels == PERSON).nonzero()[:, 0]
    with torch.no_grad():
        for i in persons.split(128):
            p, y = seen(i).flatten(1), (masks[i] >= 128).flatten(1)
            total += ((p & y).sum(1) / (p | y).sum(1).clamp(min=1)).sum().item()
    return total / max(1, len(persons))


def begin(a, **defaults):
    """Parses the command line; a: its parser. The folder that is written to is there afterwards."""
    add_arguments(a, **defaults)
    o = a.parse_args()
    os.makedirs(o.out, exist_ok=True)
    torch.manual_seed(o.seed)
    torch.set_num_threads(o.threads)
    return o


def train(head, objects, loss_of, iou, o):
    """AdamW with a rate that falls as a cosine; head gets the running mean of its weights. Returns what model.json says of it.

    objects: tensors with a row per object; the first three are pictures, their width the third dimension. loss_of(*rows of them) -> loss.
    iou() -> of the held-out. o: of the command line; its folder gets log.jsonl.
    """
    n = len(objects[0])
    steps, before = int(o.epochs * n / o.batch), iou()
    log = open(os.path.join(o.out, "log.jsonl"), "a", buffering=1)
    write = lambda **row: log.write(json.dumps({k: round(v, 4) if isinstance(v, float) else v for k, v in row.items()}) + "\n")
    write(objects=n, steps=steps, held_iou=before)
    opt = torch.optim.AdamW(head.parameters(), lr=o.lr, betas=(0.9, 0.99), weight_decay=0.01)
    average = {k: v.clone() for k, v in head.state_dict().items()}
    mean, short = None, torch.ops.mkldnn._is_mkldnn_bf16_supported()
    for step in range(steps):
        i = torch.randint(n, (o.batch,))
        batch = [s[i] for s in objects]
        if torch.rand(()) < 0.5:
            batch[:3] = (s.flip(2) for s in batch[:3])
        for g in opt.param_groups:
            g["lr"] = o.lr * min(1, (step + 1) / 100) * 0.5 * (1 + np.cos(np.pi * step / steps))
        with torch.autocast("cpu", torch.bfloat16, enabled=short):
            loss = loss_of(*batch)
        opt.zero_grad()
        loss.backward()
        torch.nn.utils.clip_grad_norm_(head.parameters(), 5.0)
        opt.step()
        for k, v in head.state_dict().items():
            average[k].lerp_(v, 0.005)
        mean = loss.item() if mean is None else 0.99 * mean + 0.01 * loss.item()
        if (step + 1) % 500 == 0 or step + 1 == steps:
            shown = (step + 1) % 2000 == 0 or step + 1 == steps
            write(step=step + 1, loss=mean, **({"held_iou": iou()} if shown else {}))
    head.load_state_dict(average)
    after = iou()
    write(averaged=True, held_iou=after)
    log.close()
    return {"objects": n, "steps": steps, "held_out_iou": [round(before, 4), round(after, 4)]}


def write_about(about, o):
    with open(os.path.join(o.out, "model.json"), "w") as f:
        json.dump(about, f, indent=1)


def add_arguments(a, pictures, epochs, batch, lr, bits):
    a.add_argument("model")
    a.add_argument("out")
    a.add_argument("--train", nargs=2, required=True, metavar=("JSON", "IMAGES"))
    a.add_argument("--also", nargs=3, action="append", default=[], metavar=("JSON", "IMAGES", "SHARE"))
    a.add_argument("--pictures", type=int, default=pictures)
    a.add_argument("--epochs", type=float, default=epochs)
    a.add_argument("--batch", type=int, default=batch)
    a.add_argument("--lr", type=float, default=lr)
    a.add_argument("--threads", type=int, default=2)
    a.add_argument("--seed", type=int, default=1)
    a.add_argument("--bits", type=int, default=bits, help="of the weights that are written, each output channel on a grid of its own")
    a.add_argument("--keep", metavar="FILE", help="gathered features: written there, read if there already")

