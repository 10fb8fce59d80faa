"""Anchors and box coding. Everything the C++ side must repeat exactly; see training/README.md."""
import math

import torch

STRIDES = (8, 16, 32)
SIZES = ((32.0, 56.0), (96.0, 160.0), (256.0, 416.0))       # per level, px of the network's input
RATIOS = (0.5, 1.0, 2.0)                                    # height / width
PER_CELL = len(SIZES[0]) * len(RATIOS)
CLIP = math.log(1000.0 / 16.0)
BOX_WEIGHTS = (10.0, 10.0, 5.0, 5.0)
BOX_LEVELS = (112.0, 336.0)      # sqrt(area) below the first: level 0, below the second: level 1, else level 2
MASK_LEVELS = (224.0,)           # masks use the two finer levels only


def cell_anchors(level):
    out = []
    for s in SIZES[level]:
        for r in RATIOS:
            w, h = s / math.sqrt(r), s * math.sqrt(r)
            out.append([-w / 2, -h / 2, w / 2, h / 2])
    return torch.tensor(out)


def anchors(level, h, w):
    """[h*w*A, 4], cell by cell; a cell's centre is ((x + 0.5) stride, (y + 0.5) stride)."""
    s = STRIDES[level]
    y, x = torch.meshgrid((torch.arange(h) + 0.5) * s, (torch.arange(w) + 0.5) * s, indexing="ij")
    c = torch.stack((x, y, x, y), -1).reshape(-1, 1, 4)
    return (c + cell_anchors(level)[None]).reshape(-1, 4)


def encode(boxes, reference, weights=(1.0, 1.0, 1.0, 1.0)):
    rw, rh = reference[:, 2] - reference[:, 0], reference[:, 3] - reference[:, 1]
    bw, bh = boxes[:, 2] - boxes[:, 0], boxes[:, 3] - boxes[:, 1]
    dx = (boxes[:, 0] + boxes[:, 2] - reference[:, 0] - reference[:, 2]) / 2 / rw
    dy = (boxes[:, 1] + boxes[:, 3] - reference[:, 1] - reference[:, 3]) / 2 / rh
    return torch.stack((weights[0] * dx, weights[1] * dy, weights[2] * torch.log(bw / rw), weights[3] * torch.log(bh / rh)), 1)


def decode(deltas, reference, size, weights=(1.0, 1.0, 1.0, 1.0)):
    """Boxes clipped to size (h, w)."""
    rw, rh = reference[:, 2] - reference[:, 0], reference[:, 3] - reference[:, 1]
    cx = (reference[:, 0] + reference[:, 2]) / 2 + deltas[:, 0] / weights[0] * rw
    cy = (reference[:, 1] + reference[:, 3]) / 2 + deltas[:, 1] / weights[1] * rh
    w = rw * torch.exp((deltas[:, 2] / weights[2]).clamp(max=CLIP))
    h = rh * torch.exp((deltas[:, 3] / weights[3]).clamp(max=CLIP))
    return torch.stack(((cx - w / 2).clamp(0, size[1]), (cy - h / 2).clamp(0, size[0]),
                        (cx + w / 2).clamp(0, size[1]), (cy + h / 2).clamp(0, size[0])), 1)


def area(b):
    return (b[:, 2] - b[:, 0]) * (b[:, 3] - b[:, 1])


def overlap(a, b):
    """(intersection / union, intersection / area of a), each [len(a), len(b)]."""
    lt = torch.max(a[:, None, :2], b[None, :, :2])
    rb = torch.min(a[:, None, 2:], b[None, :, 2:])
    inter = (rb - lt).clamp(min=0).prod(2)
    aa = area(a)[:, None]
    return inter / (aa + area(b)[None] - inter).clamp(min=1e-6), inter / aa.clamp(min=1e-6)


def level_of(boxes, thresholds):
    s = area(boxes).clamp(min=0).sqrt()
    return sum((s >= t).long() for t in thresholds)
