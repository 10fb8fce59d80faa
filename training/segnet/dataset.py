"""COCO-format data: pictures kept decoded in memory, augmented into batches of one canvas size."""
import json
import os
import time

import cv2
import numpy as np
import torch
from pycocotools import mask as rle

from . import augment, classes

GREY = 127          # outside the picture: 0 after normalisation
OBJECT, BOX, IGNORED = 0, 1, 2      # kinds of annotation: with mask, only its box is known, neither object nor background
WITHOUT_PERSON = 3.5 # how much more often than others a picture without persons is drawn: they are few, and bear the false persons
CLEAR = 0.1         # this share of the pictures with persons shows a part that holds none
THINGS = 0.12       # this share gets things cut from other pictures pasted in, animals for the most part
TEACHER = 0.5       # weight of a mask that another network predicted beside one that was drawn
SMALLEST = 8        # px; anything smaller on its longer side is neither object nor background


def drawn_mask(polygons, size):
    """Mask of the pixels whose centres the polygons hold, as COCO's own tools draw them: no outline is added, which small bodies feel."""
    h, w = size
    return np.ascontiguousarray(rle.decode(rle.merge(rle.frPyObjects([p.ravel().tolist() for p in polygons], h, w))))


def kind_of(a, boxes):
    if not (a.get("iscrowd") or a.get("ignore")):
        return OBJECT
    return BOX if box_only(a, boxes) else IGNORED


def contained(box, others):
    """How many of the other boxes (x y w h) lie mostly within `box`."""
    x, y, w, h = box
    inside = lambda X, Y, W, H: max(0, min(x + w, X + W) - max(x, X)) * max(0, min(y + h, Y + H) - max(y, Y)) > 0.7 * W * H
    return sum(inside(*o) for o in others)


def box_only(a, boxes):
    """A person whose box was drawn but who has no mask; boxes that hold two others are groups."""
    return a.get("source") == "coco-box" and contained(a["bbox"], boxes) < 3          # itself is one of them


def load(json_path):
    """Class names in the network's order, the images, and per image id a list of (class, kind, polygons, weight of the mask)."""
    with open(json_path) as f:
        coco = json.load(f)
    names, ids = classes.of_dataset(coco)
    index = {c: i + 1 for i, c in enumerate(ids)}
    anns, boxes = {}, {}
    for a in coco["annotations"]:
        boxes.setdefault((a["image_id"], a["category_id"]), []).append(a["bbox"])
    for a in coco["annotations"]:
        if a["category_id"] not in index or not isinstance(a.get("segmentation"), list) or not a["segmentation"]:
            continue
        polygons = [np.asarray(p, np.float64).reshape(-1, 2) for p in a["segmentation"] if len(p) >= 6]
        if polygons:
            anns.setdefault(a["image_id"], []).append((index[a["category_id"]], kind_of(a, boxes[a["image_id"], a["category_id"]]), polygons,
                                                     TEACHER if a.get("source", "").startswith("teacher") else 1.0))
    return names, coco["images"], anns


class Batches(torch.utils.data.IterableDataset):
    """Endless batches: pictures [B,3,H,W] uint8 RGB and per picture a dict of boxes, labels, masks, ignored boxes and mask."""

    def __init__(self, sources, seed, begin, end, canvases=((320, 416, 3), (480, 640, 2)), full=(480, 640)):
        """sources: (COCO JSON, folder of its pictures, share of all pictures drawn; None = what the others leave).

        full: the network's input. Smaller canvases are parts of it at the same scale: more bodies for the time that they take.
        """
        self.full = full
        self.seed, self.begin, self.end, self.canvases = seed, begin, end, canvases
        self.names, self.pixels, self.labels, source = None, [], [], []
        for n, (json_path, image_dir, _) in enumerate(sources):
            names, images, anns = load(json_path)
            if self.names not in (None, names):
                raise ValueError(f"{json_path}: has other classes than {sources[0][0]}")
            self.names = names
            for im in images:
                p = cv2.imread(os.path.join(image_dir, im["file_name"]), cv2.IMREAD_COLOR)
                if p is None:
                    raise FileNotFoundError(os.path.join(image_dir, im["file_name"]))
                self.pixels.append(np.ascontiguousarray(p[:, :, ::-1]))
                self.labels.append(anns.get(im["id"], []))
                source.append(n)
        large = [(i, k, c) for i, anns in enumerate(self.labels) for k, (c, kind, pol, _) in enumerate(anns)
                 if kind == OBJECT and np.ptp(np.concatenate(pol), 0).min() > 40]
        self.bodies = [(i, k) for i, k, c in large if c == 1]
        self.things = [(i, k) for i, k, c in large if c != 1]
        with_person = np.array([any(c == 1 for c, *_ in a) for a in self.labels])
        rare = np.array([any(c != 1 and kind == OBJECT for c, kind, *_ in a) for a in self.labels])
        weight = np.where(with_person, 1.0, WITHOUT_PERSON) + 0.3 * rare
        rest = 1 - sum(float(share) for *_, share in sources if share is not None)
        for n, (*_, share) in enumerate(sources):
            own = np.array(source) == n
            weight[own] *= (rest if share is None else float(share)) / weight[own].sum()
        self.weight = weight

    def place(self, rng, i, canvas, out, region, objects, full, plain):
        """Warps picture i into `region` (y0 x0 y1 x1) of `out` and adds its objects."""
        y0, x0, y1, x1 = region
        src, anns = self.pixels[i], self.labels[i]
        h, w = y1 - y0, x1 - x0
        boxes = [(kind, np.r_[np.concatenate(p).min(0), np.concatenate(p).max(0)]) for c, kind, p, _ in anns if c == 1]
        m = None
        if boxes and not plain and rng.random() < CLEAR:
            m = augment.clear_affine(rng, src.shape[:2], (h, w), [b for _, b in boxes], full)
        if m is None:
            m = augment.random_affine(rng, src.shape[:2], (h, w), [b for kind, b in boxes if kind != IGNORED], full, plain)
        fill = (GREY,) * 3 if rng.random() < 0.7 else tuple(int(v) for v in rng.integers(0, 256, 3))
        interp = cv2.INTER_AREA if np.linalg.det(m[:, :2]) ** 2 < 0.2 else cv2.INTER_LINEAR
        out[y0:y1, x0:x1] = cv2.warpAffine(src, m, (w, h), flags=interp, borderMode=cv2.BORDER_CONSTANT, borderValue=fill)
        for c, kind, polygons, worth in anns:
            moved = [p @ m[:, :2].T + m[:, 2] for p in polygons]
            low, high = np.min([p.min(0) for p in moved], 0), np.max([p.max(0) for p in moved], 0)
            if low[0] >= w or low[1] >= h or high[0] <= 0 or high[1] <= 0:
                continue
            mask = drawn_mask(moved, (h, w))
            if mask.any():
                whole = np.zeros(canvas, np.uint8)
                whole[y0:y1, x0:x1] = mask
                objects.append([c, kind, whole, worth])

    def sample(self, rng, canvas, plain):
        """plain: in this share of the cases the picture stays nearly as it is."""
        H, W = canvas
        out = np.full((H, W, 3), GREY, np.uint8)
        objects = []
        pick = lambda: int(rng.choice(len(self.pixels), p=self.weight))
        plain = rng.random() < plain
        if rng.random() < 0.08 and not plain:
            cy, cx = int(H * rng.uniform(0.3, 0.7)), int(W * rng.uniform(0.3, 0.7))
            for r in ((0, 0, cy, cx), (0, cx, cy, W), (cy, 0, H, cx), (cy, cx, H, W)):
                self.place(rng, pick(), canvas, out, r, objects, (r[2] - r[0], r[3] - r[1]), plain)
        else:
            self.place(rng, pick(), canvas, out, (0, 0, H, W), objects, self.full, plain)
        if not plain:
            if self.bodies and rng.random() < 0.25:
                self.paste(rng, out, objects, self.bodies)
            if self.things and rng.random() < THINGS:
                self.paste(rng, out, objects, self.things)
            out = augment.photometric(rng, out)
        return out, self.targets(objects, canvas)

    def paste(self, rng, out, objects, choice):
        """Draws one or two of `choice` (picture, object) onto `out` and adds them to the objects."""
        for _ in range(int(rng.integers(1, 3))):
            i, k = choice[rng.integers(len(choice))]
            c, _, polygons, worth = self.labels[i][k]
            body = augment.paste(rng, out, [o[2] for o in objects], self.pixels[i], polygons)
            if body is not None:
                objects.append([c, OBJECT, body, worth])

    @staticmethod
    def targets(objects, canvas):
        boxes, labels, masks, drawn, worths, ignored = [], [], [], [], [], []
        unsure = np.zeros(canvas, np.uint8)
        for c, kind, mask, worth in objects:
            if not mask.any():
                continue
            x, y, w, h = cv2.boundingRect(mask)
            if kind == IGNORED or max(w, h) < SMALLEST or min(w, h) < 3:
                ignored.append([x, y, x + w, y + h])
                unsure |= mask
            else:
                boxes.append([x, y, x + w, y + h])
                labels.append(c)
                masks.append(mask)
                drawn.append(kind == OBJECT)
                worths.append(worth)
                if kind == BOX:
                    unsure |= mask
        t = lambda a, s: torch.from_numpy(np.asarray(a, np.float32).reshape(s))
        return {"boxes": t(boxes, (-1, 4)), "ignored": t(ignored, (-1, 4)), "labels": torch.tensor(labels, dtype=torch.long), "drawn": torch.tensor(drawn, dtype=torch.bool), "worth": t(worths, -1),
                "masks": torch.from_numpy(np.stack(masks) if masks else np.zeros((0, *canvas), np.uint8)), "unsure": torch.from_numpy(unsure)}

    def __iter__(self):
        info = torch.utils.data.get_worker_info()
        cv2.setNumThreads(0)
        rng = np.random.default_rng([*self.seed, info.id if info else 0])
        while True:
            progress = min(1.0, (time.time() - self.begin) / max(1.0, self.end - self.begin))
            late = progress > 0.7
            p = (0.2, 0.8) if late else (0.6, 0.4)                  # parts first: more bodies an hour
            H, W, n = self.canvases[rng.choice(2, p=p)]
            batch = [self.sample(rng, (H, W), 0.2 + 0.5 * progress) for _ in range(n)]
            yield torch.from_numpy(np.stack([b[0] for b in batch])).permute(0, 3, 1, 2), [b[1] for b in batch]
