#!/usr/bin/env python3
"""Scores exported graphs (or a check point): COCO mask AP, person pixels, near persons; composed sequences.

usage: evaluate.py MODEL_DIR|CHECKPOINT --coco JSON IMAGES [--drawn N] [--sequence DIR ...] [--score S] [--json OUT]
"""
import argparse
import contextlib
import glob
import io
import json
import os

import cv2
import numpy as np

import infer


class Torch:
    """The check point's network behind the same three calls as the exported graphs."""

    def __init__(self, path, size):
        import torch

        import export
        torch.set_num_threads(2)
        net, state = export.load(path)
        self.torch, self.size, self.names = torch, size, state["names"]
        self.parts = [export.Trunk(net), export.Box(net), export.Mask(net)]
        self.outs, self.refines = export.TRUNK_OUT, False

    def call(self, k, x):
        with self.torch.no_grad():
            return self.parts[k](self.torch.from_numpy(np.ascontiguousarray(x, np.float32)))

    def trunk(self, x):
        return {k: v.contiguous().numpy() for k, v in zip(self.outs, self.call(0, x))}

    def box(self, x):
        p, d = self.call(1, x)
        return {"probabilities": p.numpy(), "deltas": d.numpy()}

    def mask(self, x):
        return {"masks": self.call(2, x).numpy()}


def open_model(path, size, int8=False, threads=2, refine=True, box_energy=1.0):
    size = infer.size_of(size)
    if path.endswith(".pt"):
        t = Torch(path, size or (480, 640))
        return infer.Segmenter(t), t.names
    # f32, for scores that do not depend on the processor: OpenVINO takes bfloat16 wherever it exists.
    seg, m = infer.open_model(path, threads, "f32", int8, size, refine, box_energy)
    return seg, m["classes"]


def iou(a, b):
    return (a & b).sum() / max(1, (a | b).sum())


def drawn_by_people(coco, person):
    """Ids of the pictures with a person whose mask people drew."""
    return [i for i in sorted(coco.getImgIds()) if any(a["category_id"] == person and not a.get("iscrowd") and a.get("source") in ("coco", "ground-truth")
                                                       for a in coco.loadAnns(coco.getAnnIds(i)))]


def score_coco(seg, names, json_path, images, threshold, drawn=0):
    """drawn: of so many pictures alone, the first in which people drew a person; 0 = all."""
    from pycocotools import mask as rle
    from pycocotools.coco import COCO
    from pycocotools.cocoeval import COCOeval
    with contextlib.redirect_stdout(io.StringIO()):
        coco = COCO(json_path)
    ids = {c["name"]: c["id"] for c in coco.loadCats(coco.getCatIds())}
    chosen = drawn_by_people(coco, ids["person"])[:drawn] if drawn else coco.getImgIds()
    results, inter, union, tp_px, truth_px = [], 0, 0, 0, 0
    found_iou, near = [], 0
    for image_id in chosen:
        info = coco.loadImgs(image_id)[0]
        bgr = cv2.imread(os.path.join(images, info["file_name"]))
        size = bgr.shape[:2]
        found = seg(bgr, 0.02)
        masks = [infer.full_mask(i, size) for i in found]
        for i, m in zip(found, masks):
            r = rle.encode(np.asfortranarray(m.astype(np.uint8)))
            r["counts"] = r["counts"].decode()
            results.append({"image_id": image_id, "category_id": ids[names[i["class"]]], "score": i["score"], "segmentation": r,
                            "bbox": [float(v) for v in (*i["box"][:2], *(i["box"][2:] - i["box"][:2]))]})
        persons = [m for i, m in zip(found, masks) if i["class"] == 0 and i["score"] >= threshold]
        anns = [a for a in coco.loadAnns(coco.getAnnIds(image_id)) if a["category_id"] == ids["person"]]
        crowd = np.zeros(size, bool)
        truth = []
        for a in anns:
            m = coco.annToMask(a).astype(bool)
            if a.get("iscrowd"):
                crowd |= m
            else:
                truth.append(m)
        pred_all = np.any(persons, 0) if persons else np.zeros(size, bool)
        true_all = np.any(truth, 0) if truth else np.zeros(size, bool)
        use = ~crowd | true_all                           # crowd regions count neither way
        inter += (pred_all & true_all & use).sum()
        union += ((pred_all | true_all) & use).sum()
        truth_px += true_all.sum()
        tp_px += (pred_all & use).sum()
        free = list(range(len(persons)))
        for t in sorted(truth, key=lambda m: -m.sum()):
            if t.sum() <= 96 * 96:
                continue
            near += 1
            best = max(free, key=lambda k: iou(persons[k], t), default=None)
            if best is not None and iou(persons[best], t) >= 0.5:
                found_iou.append(iou(persons[best], t))
                free.remove(best)
    out = {"images": len(chosen), "score_threshold": threshold, "person_pixel_iou": inter / max(1, union),
           "person_pixel_recall": inter / max(1, truth_px), "person_pixel_precision": inter / max(1, tp_px),
           "near_persons": near, "near_person_recall": len(found_iou) / max(1, near), "near_person_mean_iou": float(np.mean(found_iou)) if found_iou else 0.0}
    with contextlib.redirect_stdout(io.StringIO()):
        shown = coco.loadRes(results)
        for kind in ("segm", "bbox"):
            for which, cats in (("person", [ids["person"]]), ("all", [ids[n] for n in names])):
                e = COCOeval(coco, shown, kind)
                e.params.catIds, e.params.imgIds = cats, chosen
                e.evaluate()
                e.accumulate()
                e.summarize()
                out[f"{which}_{kind}_ap"], out[f"{which}_{kind}_ap50"] = float(e.stats[0]), float(e.stats[1])
    return out


def score_sequence(seg, folder, threshold, step):
    """Person pixels against the composed truth: medians over the frames where at least 0.5 % of the picture is a person."""
    with open(os.path.join(folder, "roles.json")) as f:
        roles = json.load(f)
    ids = [r["number"] for r in roles if r["label"] == "person"]
    recall, precision, clear, false = [], [], 0, 0
    for path in sorted(glob.glob(os.path.join(folder, "rgb", "*")))[::step]:
        stem = os.path.splitext(os.path.basename(path))[0]
        bgr = cv2.imread(path)
        truth = np.zeros(bgr.shape[:2], bool)
        if ids:                                            # a sequence without roles has no masks
            truth = np.isin(cv2.imread(os.path.join(folder, "mask", stem + ".png"), cv2.IMREAD_UNCHANGED), ids)
        pred = np.zeros(truth.shape, bool)
        for i in seg(bgr, threshold):
            if i["class"] == 0:
                x, y, m = i["window"]
                pred[y:y + m.shape[0], x:x + m.shape[1]] |= m
        if truth.mean() < 0.005:
            clear += 1
            false += pred.mean() > 0.005
            continue
        hit = (truth & pred).sum()
        recall.append(hit / truth.sum())
        precision.append(hit / pred.sum() if pred.any() else 0.0)
    med = lambda v: float(np.median(v)) if v else None
    return {"frames": len(recall), "recall_median": med(recall), "precision_median": med(precision), "recall_mean": float(np.mean(recall)) if recall else None,
            "recall_p10": float(np.percentile(recall, 10)) if recall else None, "clear_frames": clear, "clear_frames_with_false_person": int(false)}


def main():
    a = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    a.add_argument("model")
    a.add_argument("--coco", nargs=2, metavar=("JSON", "IMAGES"))
    a.add_argument("--drawn", type=int, default=0, metavar="N", help="only the first N pictures in which people drew a person")
    a.add_argument("--sequence", nargs="*", default=[])
    a.add_argument("--step", type=int, default=5, help="every so many frames of a sequence")
    a.add_argument("--score", type=float, help="least score of a person; default: as the program's, of stills and of sequences")
    a.add_argument("--size", help="of the network's input, height x width; default: as exported, 480x640 for a check point")
    a.add_argument("--int8", action="store_true", help="the trunk in INT8")
    a.add_argument("--coarse", action="store_true", help="masks as the mask head gives them, not refined")
    a.add_argument("--box-energy", type=float, default=1.0, metavar="E", help="the box head as beside a camera, where this is 0.88")
    a.add_argument("--json")
    o = a.parse_args()
    seg, names = open_model(o.model, o.size, o.int8, refine=not o.coarse, box_energy=o.box_energy)
    out = {"model": os.path.basename(os.path.normpath(o.model))}
    if o.coco:
        out["coco"] = score_coco(seg, names, *o.coco, o.score or infer.SURE_OF_STILLS, o.drawn)
    for s in o.sequence:
        out[os.path.basename(os.path.normpath(s))] = score_sequence(seg, s, o.score or infer.SURE, o.step)
    print(json.dumps(out, indent=1))
    if o.json:
        with open(o.json, "w") as f:
            json.dump(out, f, indent=1)


if __name__ == "__main__":
    main()
