"""ROI-align as one sparse matrix product: the numbers of torchvision's (aligned, 2x2 samples a cell), 6 times faster on CPUs."""
import warnings

import numpy as np
import torch

from . import boxes

warnings.filterwarnings("ignore", message="Sparse CSR tensor support is in beta")


def axis(lo, hi, size, cells):
    """Taps and weights of every cell along one axis. lo, hi [n] in feature pixels; size [n] of the level."""
    step = (torch.arange(cells * 2) + 0.5) / (cells * 2)
    at = lo[:, None] + (hi - lo)[:, None] * step[None]
    size = size[:, None].float()
    inside = ((at >= -1) & (at <= size)).float()
    at = torch.minimum(at.clamp(min=0), size - 1)
    i = torch.minimum(at.floor(), size - 1)
    f = at - i
    j = torch.minimum(i + 1, size - 1)
    taps = torch.stack((i, j), -1).long()
    weights = torch.stack((1 - f, f), -1) * inside[..., None] * 0.5
    return taps.view(len(lo), cells, 4), weights.view(len(lo), cells, 4)


class Product(torch.autograd.Function):
    @staticmethod
    def forward(ctx, table, index, weight):
        n = len(index)
        ctx.save_for_backward(index, weight)
        ctx.rows = len(table)
        rows = torch.arange(0, n * 16 + 1, 16)
        with torch.autocast("cpu", enabled=False):         # there is no sparse product in bfloat16
            return torch.sparse_csr_tensor(rows, index.reshape(-1), weight.reshape(-1), (n, len(table)), check_invariants=False) @ table

    @staticmethod
    def backward(ctx, grad):
        index, weight = ctx.saved_tensors
        flat = index.reshape(-1)
        # 16 bit keys: radix sort, several times faster.
        keys = flat.numpy().astype(np.uint16) if ctx.rows < 65536 else flat.numpy()
        order = torch.from_numpy(np.argsort(keys, kind="stable"))
        rows = torch.zeros(ctx.rows + 1, dtype=torch.long)
        rows[1:] = torch.bincount(flat, minlength=ctx.rows).cumsum(0)
        columns = torch.div(order, 16, rounding_mode="floor")
        back = torch.sparse_csr_tensor(rows, columns, weight.reshape(-1)[order], (ctx.rows, len(index)), check_invariants=False)
        return back @ grad.contiguous(), None, None


def align(levels, rois, cells, thresholds):
    """levels: [B,C,H,W] float32 each; rois [N,5] (picture, x0, y0, x1, y1) -> [N, cells, cells, C]."""
    level = boxes.level_of(rois[:, 1:], thresholds)
    h = torch.tensor([p.shape[2] for p in levels])[level]
    w = torch.tensor([p.shape[3] for p in levels])[level]
    first = torch.tensor([0] + [p.shape[0] * p.shape[2] * p.shape[3] for p in levels]).cumsum(0)[level]
    scale = 1.0 / torch.tensor(boxes.STRIDES, dtype=torch.float32)[level]
    b = rois[:, 1:] * scale[:, None] - 0.5
    ix, wx = axis(b[:, 0], b[:, 2], w, cells)
    iy, wy = axis(b[:, 1], b[:, 3], h, cells)
    base = first + rois[:, 0].long() * h * w
    index = base[:, None, None, None, None] + iy[:, :, None, :, None] * w[:, None, None, None, None] + ix[:, None, :, None, :]
    weight = wy[:, :, None, :, None] * wx[:, None, :, None, :]
    table = torch.cat([p.permute(0, 2, 3, 1).reshape(-1, p.shape[1]) for p in levels])
    out = Product.apply(table, index.reshape(-1, 16), weight.reshape(-1, 16))
    return out.view(len(rois), cells, cells, -1)
