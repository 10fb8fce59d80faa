#!/usr/bin/env python3
"""Reference inference with the exported graphs: exactly the steps that the C++ side repeats (see README.md).

usage: infer.py MODEL_DIR IMAGE... --out DIR [--score 0.45] [--threads 2]
Writes an overlay (PNG) and prints the instances of every image.
"""
import argparse
import json
import math
import os
import time

import cv2
import numpy as np

STRIDES = (8, 16, 32)
SIZES = ((32.0, 56.0), (96.0, 160.0), (256.0, 416.0))
RATIOS = (0.5, 1.0, 2.0)
CLIP = math.log(1000.0 / 16.0)
BOX_WEIGHTS = np.array((10.0, 10.0, 5.0, 5.0), np.float32)
BOX_LEVELS, MASK_LEVELS = (112.0, 336.0), (224.0,)
GREY = 127
PROPOSALS_PER_LEVEL, PROPOSALS = 300, 100
RPN_NMS, BOX_NMS, MOST = 0.7, 0.5, 50
SEMANTIC_SHARE, MASK_THRESHOLD = 0.35, 0.44     # of persons' masks
REFINE_SIDE, REFINE_MARGIN = 56, 1 / 14         # cells of a refined mask; what it sees around a box, as a share of its sides
REFINE_STEP, REFINE_LEAST = 8, 24               # in narrower inputs these cells stay as large: fewer of them, multiples of so many
LEAST_PROBABILITY = 1e-3                        # of a mask's cell, as the refinement sees it
SURE = 0.45                                     # least score beside a camera: even odds, and a mask as sure as good ones are (0.9)
SURE_OF_STILLS = 0.55                           # of single pictures: nothing comes after it that would see a false person


def refine_side(width, trained_width):
    return min(REFINE_SIDE, max(REFINE_LEAST, math.ceil(REFINE_SIDE * width / trained_width / REFINE_STEP) * REFINE_STEP))


def size_of(text):
    """'480x640' -> (480, 640), height first; None of nothing."""
    return tuple(int(v) for v in text.split("x")) if text else None


def letterbox(bgr, size):
    """Resized to fit size (h, w), placed at the top left, grey elsewhere. Returns RGB uint8 and the two scales."""
    H, W = size
    h, w = bgr.shape[:2]
    f = min(H / h, W / w)
    nh, nw = min(H, max(1, round(h * f))), min(W, max(1, round(w * f)))
    small = cv2.resize(bgr, (nw, nh), interpolation=cv2.INTER_AREA if f < 0.5 else cv2.INTER_LINEAR)
    out = np.full((H, W, 3), GREY, np.uint8)
    out[:nh, :nw] = small[:, :, ::-1]
    return out, nw / w, nh / h


def anchors(level, h, w, sizes):
    s = STRIDES[level]
    cell = np.array([[-a / math.sqrt(r) / 2, -a * math.sqrt(r) / 2, a / math.sqrt(r) / 2, a * math.sqrt(r) / 2]
                     for a in sizes[level] for r in RATIOS], np.float32)
    x, y = np.meshgrid((np.arange(w) + 0.5) * s, (np.arange(h) + 0.5) * s)
    c = np.stack((x, y, x, y), -1).reshape(-1, 1, 4).astype(np.float32)
    return (c + cell[None]).reshape(-1, 4)


def decode(d, ref, size):
    w, h = ref[:, 2] - ref[:, 0], ref[:, 3] - ref[:, 1]
    cx = (ref[:, 0] + ref[:, 2]) / 2 + d[:, 0] * w
    cy = (ref[:, 1] + ref[:, 3]) / 2 + d[:, 1] * h
    bw, bh = w * np.exp(np.minimum(d[:, 2], CLIP)), h * np.exp(np.minimum(d[:, 3], CLIP))
    b = np.stack((cx - bw / 2, cy - bh / 2, cx + bw / 2, cy + bh / 2), 1)
    return np.clip(b, 0, np.array([size[1], size[0], size[1], size[0]], np.float32))


def nms(boxes, scores, threshold, most):
    """Indices kept, best first. Equal scores: the earlier one first. IoU above the threshold removes."""
    order = np.argsort(-scores, kind="stable")
    area = (boxes[:, 2] - boxes[:, 0]) * (boxes[:, 3] - boxes[:, 1])
    keep = []
    while len(order) and len(keep) < most:
        i, rest = order[0], order[1:]
        keep.append(i)
        w = np.minimum(boxes[i, 2], boxes[rest, 2]) - np.maximum(boxes[i, 0], boxes[rest, 0])
        h = np.minimum(boxes[i, 3], boxes[rest, 3]) - np.maximum(boxes[i, 1], boxes[rest, 1])
        inter = np.maximum(w, 0) * np.maximum(h, 0)
        order = rest[inter <= threshold * (area[i] + area[rest] - inter)]
    return np.array(keep, int)


def axis(lo, hi, size, cells):
    """Two samples a cell; a sample outside [-1, size] counts 0, else it is clamped into the map."""
    at = lo[:, None] + (hi - lo)[:, None] * ((np.arange(cells * 2, dtype=np.float32) + 0.5) / (cells * 2))[None]
    inside = (at >= -1) & (at <= size)
    at = np.clip(at, 0, size - 1)
    i = np.floor(at).astype(int)
    f = (at - i).astype(np.float32)
    return i, np.minimum(i + 1, size - 1), np.where(inside, 1 - f, 0), np.where(inside, f, 0)


def roi_align(levels, boxes, cells, thresholds, strides=STRIDES):
    """levels: [H, W, C] each; boxes [N, 4] in input pixels -> [N, cells, cells, C]."""
    s = np.sqrt(np.maximum((boxes[:, 2] - boxes[:, 0]) * (boxes[:, 3] - boxes[:, 1]), 0))
    level = sum(((s >= t).astype(int) for t in thresholds), np.zeros(len(boxes), int))
    out = np.zeros((len(boxes), cells, cells, levels[0].shape[2]), np.float32)
    for l in range(len(thresholds) + 1):
        n = np.nonzero(level == l)[0]
        if not len(n):
            continue
        f, b = levels[l], boxes[n] / strides[l] - 0.5
        i0, i1, a0, a1 = axis(b[:, 1], b[:, 3], f.shape[0], cells)
        j0, j1, b0, b1 = axis(b[:, 0], b[:, 2], f.shape[1], cells)
        v = 0.0
        for i, a in ((i0, a0), (i1, a1)):
            for j, c in ((j0, b0), (j1, b1)):
                v = v + f[i[:, :, None], j[:, None, :]] * (a[:, :, None] * c[:, None, :])[..., None]
        out[n] = v.reshape(len(n), cells, 2, cells, 2, -1).mean((2, 4))
    return out


def bilinear(table, v, u):
    """table [h, w] read at rows v, columns u, clamped to the edges."""
    h, w = table.shape
    u, v = np.clip(u, 0, w - 1), np.clip(v, 0, h - 1)
    iu, iv = np.minimum(np.floor(u).astype(int), w - 2), np.minimum(np.floor(v).astype(int), h - 2)
    fu, fv = (u - iu).astype(np.float32)[None, :], (v - iv).astype(np.float32)[:, None]
    rows0, rows1 = table[iv], table[iv + 1]
    top = rows0[:, iu] * (1 - fu) + rows0[:, iu + 1] * fu
    low = rows1[:, iu] * (1 - fu) + rows1[:, iu + 1] * fu
    return top * (1 - fv) + low * fv


def read_mask(prob, box, x, y, semantic=None, scale=(1.0, 1.0), share=0.0):
    """Mask probabilities [n, n], stretched over a box, at the places x, y [columns], [rows]: bilinear, 0 beyond the cells.

    With `semantic` [h, w] at stride 8 of the input (`scale`: its pixels per unit of box, x and y) the two are mixed by `share`.
    """
    n = prob.shape[0]
    u = ((x - box[0]) / max(box[2] - box[0], 1e-3) * n - 0.5).astype(np.float32)
    v = ((y - box[1]) / max(box[3] - box[1], 1e-3) * n - 0.5).astype(np.float32)
    padded = np.zeros((n + 2, n + 2), np.float32)
    padded[1:-1, 1:-1] = prob
    p = bilinear(padded, v + 1, u + 1)
    if semantic is not None:
        s = bilinear(semantic, y * scale[1] / STRIDES[0] - 0.5, x * scale[0] / STRIDES[0] - 0.5)
        p = (1 - share) * p + share * s
    return p


def paste(prob, box, size, threshold=0.5, semantic=None, scale=(1.0, 1.0), share=0.0):
    """Mask probabilities [n, n] of a box -> (x0, y0, bool window) of the image, and the mask's certainty: the mean probability of
    its pixels. The mixing: see read_mask."""
    x0, y0 = max(0, math.floor(box[0])), max(0, math.floor(box[1]))
    x1, y1 = min(size[1], math.ceil(box[2])), min(size[0], math.ceil(box[3]))
    if x1 <= x0 or y1 <= y0:
        return (0, 0, np.zeros((0, 0), bool)), 0.0
    p = read_mask(prob, box, np.arange(x0, x1) + 0.5, np.arange(y0, y1) + 0.5, semantic, scale, share)
    return (x0, y0, p >= threshold), mean_inside(p, threshold)


def grown(boxes, share):
    """Boxes [n, 4] with a share of their width and height added on each side."""
    d = (boxes[:, 2:] - boxes[:, :2]) * np.float32(share)
    return np.concatenate((boxes[:, :2] - d, boxes[:, 2:] + d), 1)


def bent(p, threshold):
    """Logits that are 0 at the threshold."""
    p = np.clip(p, LEAST_PROBABILITY, 1 - LEAST_PROBABILITY)
    return (np.log(p / (1 - p)) - math.log(threshold / (1 - threshold))).astype(np.float32)


def on_region(prob, box, region, semantic=None, share=0.0, side=REFINE_SIDE):
    """The mask at the cells' centres of the region, [side, side]. Everything in pixels of the network's input."""
    at = lambda low, high: low + (high - low) / side * (np.arange(side, dtype=np.float32) + 0.5)
    return read_mask(prob, box, at(region[0], region[2]), at(region[1], region[3]), semantic, share=share)


def mean_inside(p, threshold):
    inside = p >= threshold
    return float(p[inside].mean()) if inside.any() else 0.0


def shorten_largest_product(model, energy):
    """The largest product with a constant matrix as two that keep this share of its sum of squares (the program's low_rank.h)."""
    from openvino import opset8
    from openvino.utils import replace_node
    products = [n for n in model.get_ordered_ops() if n.get_type_name() == "MatMul" and n.input_value(1).get_node().get_type_name() == "Constant"]
    largest = max(products, key=lambda n: n.input_value(1).get_node().data.size)
    weights = np.array(largest.input_value(1).get_node().data)
    values, vectors = np.linalg.eigh((weights @ weights.T).astype(np.float64))
    squares = np.maximum(values[::-1], 0)
    rank = int(np.searchsorted(np.cumsum(squares), energy * squares.sum())) + 1
    high = vectors[:, ::-1][:, :rank].astype(np.float32)
    times = lambda left, right: opset8.matmul(left, opset8.constant(np.ascontiguousarray(right)), False, True)
    replace_node(largest, times(times(largest.input_value(0), high.T @ weights), high))


class OpenVino:
    """The exported graphs. refine may be None. size: (h, w) of the trunk's input, multiples of 32; None = as it was exported.
    box_energy: see shorten_largest_product; 1 = the box head as it is."""

    def __init__(self, folder, threads, precision, trunk, box, mask, refine, size=None, box_energy=1.0):
        import openvino as ov
        core = ov.Core()
        options = {"INFERENCE_NUM_THREADS": threads, "NUM_STREAMS": 1}
        if precision:
            options["INFERENCE_PRECISION_HINT"] = precision
        models = [core.read_model(os.path.join(folder, f)) for f in (trunk, box, mask, refine) if f]
        self.refines, self.side = refine is not None, REFINE_SIDE
        if size:
            trained_width = models[0].input(0).partial_shape[3].get_length()
            models[0].reshape([1, 3, *size])
            self.side = refine_side(size[1], trained_width)
        if self.refines and self.side != REFINE_SIDE:
            models[3].reshape({i: [-1, self.side, self.side, *list(i.partial_shape)[3:]] for i in models[3].inputs})
        if box_energy < 1:
            shorten_largest_product(models[1], box_energy)
        self.graphs = [core.compile_model(m, "CPU", options).create_infer_request() for m in models]
        self.size = tuple(self.graphs[0].get_compiled_model().input(0).shape)[2:]

    def run(self, graph, *inputs):
        r = self.graphs[graph]
        r.infer(inputs, share_inputs=True)
        return {p.get_any_name(): r.get_tensor(p).data for p in r.get_compiled_model().outputs}

    def trunk(self, x):
        return self.run(0, x)

    def box(self, x):
        return self.run(1, x)

    def mask(self, x):
        return self.run(2, x)

    def refine(self, logits, features):
        return self.run(3, logits, features)


def open_model(folder, threads=2, precision=None, int8=False, size=None, refine=True, box_energy=1.0):
    """A segmenter with what model.json of the folder says, and that. refine: masks are refined where the model can."""
    with open(os.path.join(folder, "model.json")) as f:
        m = json.load(f)
    graphs = OpenVino(folder, threads, precision, m["trunk_int8" if int8 else "trunk"], m["box"], m["mask"],
                      m.get("refine") if refine else None, size, box_energy)
    return Segmenter(graphs, m["semantic_share"], m["mask_threshold"], m["anchor_sizes"], m.get("fine_stride"), m.get("refine_margin")), m


class Segmenter:
    def __init__(self, graphs, share=SEMANTIC_SHARE, threshold=MASK_THRESHOLD, sizes=SIZES, fine_stride=None, margin=REFINE_MARGIN):
        self.g, self.share, self.threshold, self.fine_stride, self.margin = graphs, share, threshold, fine_stride, margin
        H, W = graphs.size
        self.anchors = [anchors(i, H // s, W // s, sizes) for i, s in enumerate(STRIDES)]
        self.times = {}

    def lap(self, name, since):
        now = time.perf_counter()
        self.times.setdefault(name, []).append((now - since) * 1e3)
        return now

    def proposals(self, t):
        boxes, scores = [], []
        for i, a in enumerate(self.anchors):
            s, d = t[f"objectness{i + 3}"].reshape(-1), t[f"deltas{i + 3}"].reshape(-1, 4)
            top = np.argsort(-s, kind="stable")[:PROPOSALS_PER_LEVEL]
            boxes.append(decode(d[top], a[top], self.g.size))
            scores.append(s[top])
        b, s = np.concatenate(boxes), np.concatenate(scores)
        ok = (b[:, 2] - b[:, 0] >= 4) & (b[:, 3] - b[:, 1] >= 4) & np.isfinite(s)
        b, s = b[ok], s[ok]
        return b[nms(b, s, RPN_NMS, PROPOSALS)]

    def refine_inputs(self, t, masks, boxes, classes, regions):
        """The mask head's masks [n, 2, 28, 28] over the boxes -> logits [n, side, side] over the regions, certainties [n]."""
        semantic = np.ascontiguousarray(t["semantic"][0, :, :, 0])
        logits, certain = [], []
        for m, b, c, r in zip(masks, boxes, classes, regions):
            threshold = self.threshold if c == 0 else 0.5
            p = on_region(m[0], b, r, semantic, self.share, self.g.side) if c == 0 else on_region(m[1], b, r, side=self.g.side)
            logits.append(bent(p, threshold))
            certain.append(mean_inside(p, threshold))
        return np.stack(logits), certain

    def refined(self, t, masks, boxes, classes, regions):
        """Masks [n, side, side] over the regions, certainties [n]."""
        features = roi_align([t["fine"][0]], regions, self.g.side, (), (self.fine_stride,))
        logits, certain = self.refine_inputs(t, masks, boxes, classes, regions)
        return self.g.refine(logits, features)["masks"], certain

    def __call__(self, bgr, least=0.05):
        """Instances, best first: class (0 = person), score, box (x0 y0 x1 y1 in the image), window (x0, y0, mask)."""
        t0 = time.perf_counter()
        rgb, fx, fy = letterbox(bgr, self.g.size)
        x = np.ascontiguousarray(rgb.transpose(2, 0, 1)[None], np.float32) / 127.5 - 1
        t0 = self.lap("prepare", t0)
        t = self.g.trunk(x)
        t0 = self.lap("trunk", t0)
        levels = [t["p3"][0], t["p4"][0], t["p5"][0]]
        prop = self.proposals(t)
        t0 = self.lap("proposals", t0)
        if not len(prop):
            return []
        r = roi_align(levels, prop, 7, BOX_LEVELS)
        t0 = self.lap("align", t0)
        o = self.g.box(r)
        t0 = self.lap("box", t0)
        boxes = decode(o["deltas"] / BOX_WEIGHTS, prop, self.g.size)
        n, c = np.nonzero(o["probabilities"][:, 1:] >= least)
        b, s = boxes[n], o["probabilities"][n, c + 1]
        ok = (b[:, 2] - b[:, 0] >= 2) & (b[:, 3] - b[:, 1] >= 2)
        b, s, c = b[ok], s[ok], c[ok]
        keep = nms(b + c[:, None].astype(np.float32) * 4096, s, BOX_NMS, MOST)      # the offset keeps classes apart
        b, s, c = b[keep], s[keep], c[keep]
        t0 = self.lap("select", t0)
        if not len(b):
            return []
        r = roi_align(levels, b, 14, MASK_LEVELS)
        t0 = self.lap("align", t0)
        m = self.g.mask(r)["masks"]
        t0 = self.lap("mask", t0)
        out = []
        semantic = np.ascontiguousarray(t["semantic"][0, :, :, 0])
        f = np.array([fx, fy, fx, fy], np.float32)
        if self.g.refines:
            regions = grown(b, self.margin)
            refined, certain = self.refined(t, m, b, c, regions)
            t0 = self.lap("refine", t0)
        for i in range(len(b)):
            box = np.minimum(b[i] / f, np.array([bgr.shape[1], bgr.shape[0]] * 2, np.float32))
            if self.g.refines:
                window, certainty = paste(refined[i], regions[i] / f, bgr.shape[:2])[0], certain[i]
            elif c[i] == 0:                                # persons: the two branches of the network vote together
                window, certainty = paste(m[i, 0], box, bgr.shape[:2], self.threshold, semantic, (fx, fy), self.share)
            else:
                window, certainty = paste(m[i, 1], box, bgr.shape[:2])
            score = float(s[i]) * certainty
            if score >= least and window[2].any():
                out.append({"class": int(c[i]), "score": score, "box": box, "window": window})
        out.sort(key=lambda i: -i["score"])
        self.lap("paste", t0)
        return out


def full_mask(instance, size):
    out = np.zeros(size, bool)
    x, y, m = instance["window"]
    out[y:y + m.shape[0], x:x + m.shape[1]] = m
    return out


def overlay(bgr, instances, names):
    out = bgr.copy()
    for k, i in enumerate(instances):
        colour = np.array([(60, 200, 60), (60, 60, 230), (230, 120, 40), (40, 200, 230), (200, 60, 200)][k % 5])
        m = full_mask(i, bgr.shape[:2])
        out[m] = (out[m] * 0.55 + colour * 0.45).astype(np.uint8)
        x0, y0, x1, y1 = (int(v) for v in i["box"])
        cv2.rectangle(out, (x0, y0), (x1, y1), tuple(int(v) for v in colour), 1)
        cv2.putText(out, f"{names[i['class']]} {i['score']:.2f}", (x0 + 2, y0 + 12), cv2.FONT_HERSHEY_SIMPLEX, 0.4, (255, 255, 255), 1)
    return out


def main():
    a = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    a.add_argument("models")
    a.add_argument("images", nargs="+")
    a.add_argument("--out")
    a.add_argument("--score", type=float, default=SURE_OF_STILLS)
    a.add_argument("--threads", type=int, default=2)
    o = a.parse_args()
    s, about = open_model(o.models, o.threads)
    for path in o.images:
        bgr = cv2.imread(path)
        if bgr is None:
            raise SystemExit(f"cannot read {path}")
        found = s(bgr, o.score)
        print(path, [(about["classes"][i["class"]], round(i["score"], 3), [round(float(v), 1) for v in i["box"]]) for i in found])
        if o.out:
            os.makedirs(o.out, exist_ok=True)
            name = os.path.splitext(os.path.basename(path))[0] + ".png"
            cv2.imwrite(os.path.join(o.out, name), overlay(bgr, found, about["classes"]))


if __name__ == "__main__":
    main()
