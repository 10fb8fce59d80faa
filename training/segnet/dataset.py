"""COCO-format data: pictures kept decoded in memory, augmented into batches of one canvas size."""
import json
import os
import time

import cv2
import numpy as np
import torch

from . import augment, classes

GREY = 127          # outside the picture: 0 after normalisation
SMALLEST = 8        # px; anything smaller on its longer side is neither object nor background


def load(json_path):
    with open(json_path) as f:
        coco = json.load(f)
    names, ids = classes.of_dataset(coco)
    index = {c: i + 1 for i, c in enumerate(ids)}
    anns = {}
    for a in coco["annotations"]:
        if a["category_id"] not in index or not isinstance(a.get("segmentation"), list) or not a["segmentation"]:
            continue
        polygons = [np.asarray(p, np.float64).reshape(-1, 2) for p in a["segmentation"] if len(p) >= 6]
        if polygons:
            anns.setdefault(a["image_id"], []).append((index[a["category_id"]], bool(a.get("iscrowd") or a.get("ignore")), polygons))
    return names, coco["images"], anns


class Batches(torch.utils.data.IterableDataset):
    """Endless batches: pictures [B,3,H,W] uint8 RGB and per picture a dict of boxes, labels, masks, ignored boxes and mask."""

    def __init__(self, sources, seed, begin, end, canvases=((256, 352, 3), (320, 416, 2), (384, 512, 2))):
        """sources: (COCO JSON, folder of its pictures, share of all pictures drawn; None = what the others leave)."""
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
        self.bodies = [(i, k) for i, anns in enumerate(self.labels) for k, (c, crowd, pol) in enumerate(anns)
                       if c == 1 and not crowd and np.ptp(np.concatenate(pol), 0).min() > 40]
        with_person = np.array([any(c == 1 and not crowd for c, crowd, _ in a) for a in self.labels])
        rare = np.array([any(c != 1 and not crowd for c, crowd, _ in a) for a in self.labels])
        weight = np.where(with_person, 1.0, 0.7) + 0.3 * rare
        rest = 1 - sum(float(share) for *_, share in sources if share is not None)
        for n, (*_, share) in enumerate(sources):
            own = np.array(source) == n
            weight[own] *= (rest if share is None else float(share)) / weight[own].sum()
        self.weight = weight

    def place(self, rng, i, canvas, out, region, objects):
        """Warps picture i into `region` (y0 x0 y1 x1) of `out` and adds its objects."""
        y0, x0, y1, x1 = region
        src, anns = self.pixels[i], self.labels[i]
        persons = [np.r_[np.concatenate(p).min(0), np.concatenate(p).max(0)] for c, crowd, p in anns if c == 1 and not crowd]
        m = augment.random_affine(rng, src.shape[:2], (y1 - y0, x1 - x0), persons)
        h, w = y1 - y0, x1 - x0
        fill = (GREY,) * 3 if rng.random() < 0.7 else tuple(int(v) for v in rng.integers(0, 256, 3))
        interp = cv2.INTER_AREA if np.linalg.det(m[:, :2]) ** 2 < 0.2 else cv2.INTER_LINEAR
        out[y0:y1, x0:x1] = cv2.warpAffine(src, m, (w, h), flags=interp, borderMode=cv2.BORDER_CONSTANT, borderValue=fill)
        for c, crowd, polygons in anns:
            mask = np.zeros((h, w), np.uint8)
            for p in polygons:
                cv2.fillPoly(mask, [np.round((p @ m[:, :2].T + m[:, 2] - 0.5) * 16).astype(np.int32)], 1, cv2.LINE_8, 4)
            if mask.any():
                full = np.zeros(canvas, np.uint8)
                full[y0:y1, x0:x1] = mask
                objects.append([c, crowd, full])

    def sample(self, rng, canvas):
        H, W = canvas
        out = np.full((H, W, 3), GREY, np.uint8)
        objects = []
        pick = lambda: int(rng.choice(len(self.pixels), p=self.weight))
        if rng.random() < 0.12:
            cy, cx = int(H * rng.uniform(0.3, 0.7)), int(W * rng.uniform(0.3, 0.7))
            for r in ((0, 0, cy, cx), (0, cx, cy, W), (cy, 0, H, cx), (cy, cx, H, W)):
                self.place(rng, pick(), canvas, out, r, objects)
        else:
            self.place(rng, pick(), canvas, out, (0, 0, H, W), objects)
        if self.bodies and rng.random() < 0.3:
            for _ in range(int(rng.integers(1, 3))):
                i, k = self.bodies[rng.integers(len(self.bodies))]
                body = augment.paste(rng, out, [o[2] for o in objects], self.pixels[i], self.labels[i][k][2], 1)
                if body is not None:
                    objects.append([1, False, body])
        out = augment.photometric(rng, out)
        return out, self.targets(objects, canvas)

    @staticmethod
    def targets(objects, canvas):
        boxes, labels, masks, ignored = [], [], [], []
        unsure = np.zeros(canvas, np.uint8)
        for c, crowd, mask in objects:
            if not mask.any():
                continue
            x, y, w, h = cv2.boundingRect(mask)
            if crowd or max(w, h) < SMALLEST or min(w, h) < 3:
                ignored.append([x, y, x + w, y + h])
                unsure |= mask
            else:
                boxes.append([x, y, x + w, y + h])
                labels.append(c)
                masks.append(mask)
        t = lambda a, s: torch.from_numpy(np.asarray(a, np.float32).reshape(s))
        return {"boxes": t(boxes, (-1, 4)), "ignored": t(ignored, (-1, 4)), "labels": torch.tensor(labels, dtype=torch.long),
                "masks": torch.from_numpy(np.stack(masks) if masks else np.zeros((0, *canvas), np.uint8)), "unsure": torch.from_numpy(unsure)}

    def __iter__(self):
        info = torch.utils.data.get_worker_info()
        cv2.setNumThreads(0)
        rng = np.random.default_rng([*self.seed, info.id if info else 0])
        while True:
            late = (time.time() - self.begin) / max(1.0, self.end - self.begin) > 0.6
            p = (0.1, 0.4, 0.5) if late else (0.4, 0.4, 0.2)        # small pictures first: more of them an hour
            H, W, n = self.canvases[rng.choice(3, p=p)]
            batch = [self.sample(rng, (H, W)) for _ in range(n)]
            yield torch.from_numpy(np.stack([b[0] for b in batch])).permute(0, 3, 1, 2), [b[1] for b in batch]
