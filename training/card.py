#!/usr/bin/env python3
"""Writes the model card from model.json, the training logs and what evaluate.py measured, so that no number is typed by hand.

usage: card.py MODEL_DIR SCORES.json TRAINING_LOG.jsonl... [--rendered JSON]    a log per run, in their order
"""
import argparse
import json
import os

PICTURES = 3716                 # of the people data that is trained on
TARGETS = {"kitchen_walk": "0.90 / 0.93", "kitchen_walk_static": "0.75 / 0.93", "kitchen_sit": "0.82 / 0.93"}


def read_rows(path):
    with open(path) as f:
        return [json.loads(line) for line in f]


def num(x):
    return "-" if x is None else f"{x:.3f}"


def sequence_table(scores, wanted):
    """Of the sequences among the scores."""
    rows = "".join(f"| {name} | {v['frames']} | {num(v['recall_median'])} | {num(v['precision_median'])} | {wanted.get(name, '')} | "
                   f"{v['clear_frames_with_false_person']} of {v['clear_frames']} |\n"
                   for name, v in scores.items() if isinstance(v, dict) and "recall_median" in v)
    return f"""
| sequence | frames | recall | precision | wanted | empty frames with a false person |
|---|---|---|---|---|---|
{rows}"""


def other_input(kind, c):
    """Table row of another kind of trunk or width."""
    return (f"| {kind} | {c['person_segm_ap50']:.3f} | {c['person_pixel_iou']:.3f} | {c['near_person_recall']:.3f}, "
            f"{c['near_person_mean_iou']:.3f} |")


def main():
    a = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    a.add_argument("folder")
    a.add_argument("scores")
    a.add_argument("logs", nargs="+")
    a.add_argument("--rendered", help="COCO JSON of the second stage's rendered frames")
    o = a.parse_args()
    folder = o.folder
    with open(os.path.join(folder, "model.json")) as f:
        m = json.load(f)
    with open(o.scores) as f:
        s = json.load(f)
    with open(o.rendered) as f:
        rendered = len(json.load(f)["images"])
    runs = [read_rows(path) for path in o.logs]
    rows = [r for r in runs[-1] if "all" in r]
    steps, seen = (sum(max(r[k] for r in run if k in r) for run in runs) for k in ("step", "seen"))
    last_seen = max(r["seen"] for r in rows)
    c, head, refine = s["coco"], m["training"]["mask_head"], m["training"]["refine"]
    size = m["input"]
    out = f"""# The segmentation network

{m['name']}: Mask R-CNN with MobileNetV2 for images of {size['width']}x{size['height']} px (others are fitted in), {len(m['classes'])} classes:
{', '.join(m['classes'])}.

| file | what |
|---|---|
| `model.json` | describes the graphs; what the program reads first |
| `trunk.onnx`, `box.onnx`, `mask.onnx`, `refine.onnx` | the four graphs, float32; tensors and every step after them: `training/README.md` |
| `trunk.int8.xml`, `trunk.int8.bin` | the first graph in eight bits, for OpenVINO on processors without fast 16-bit floats |
| `scores.json`, `training_log.jsonl` | what `evaluate.py` measured; losses during the training |
| `golden/` | a synthetic picture, what the reference inference makes of it, a frame of our renderer (`people.jpg`), COCO scoring cases: for tests |

## Data and licence
The weights were trained by this project and are under Apache-2.0 like the rest of it. The backbone started from the MobileNetV2 of an
SSDLite detector trained on COCO (TensorFlow's, Apache-2.0; `coco_backbone.py`). Training pictures: about 3,700 from subsets of COCO
2017 (annotations CC BY 4.0; photographs under their own terms, they are not part of this repository), Borrat classroom (CC BY 4.0),
Clothing Co-Parsing and a human-segmentation set; many masks were predicted by another network from drawn boxes. No picture of
the composed sequences' room was trained on, nor those that their person actors were cut from (the pictures of the carried chair and
suitcase are among the training pictures). Frames of rooms with people drawn by our own renderer (`render_people.py`) came with the
second stage: 636 up to the fourth run, 371 of other seeds in the fifth, {rendered} in the last; their chairs, books and cups are not labelled.

## Training
{steps} steps, {seen} augmented pictures seen (about {seen / PICTURES:.0f} passes) in {len(runs)} runs on two CPU cores, learning rate annealed by the
clock in each. From the middle of the second run on a part of the pictures is rendered (a tenth to a quarter). The first four runs had
another backbone (of a DeepLabv3 trained on PASCAL VOC); the fourth had larger pictures, masks drawn by COCO's rule, persons of whom only
a box was drawn, and milder augmentation. In the fifth the COCO detector's backbone took its place: the lateral convolutions of the
pyramid were fitted to it, so that pyramid and heads went on from what they had learnt (`training/README.md`). The last run ({last_seen}
pictures) saw more of what is no person: parts of pictures without the persons in them, animals and things pasted in; predicted masks
weighed half. The leading five blocks of the backbone (up to the first at stride 8) keep their start weights, before the fourth run the
leading seven. The graphs' weights have seven bits of mantissa, as bfloat16.

Then the mask head alone went on, and got a fourth layer, on the features of {head['objects']} objects in augmented pictures, a third of them
rendered ({head['steps']} steps; `tune_mask.py`): mean IoU of persons' masks in other pictures of that kind {head['held_out_iou'][0]:.3f} before, {head['held_out_iou'][1]:.3f} after.
Its weights lie on a grid of seven bits, as do those of the last graph, the refinement of masks with the backbone's features at stride 4. That
was trained on {refine['objects']} objects of the same kinds of pictures ({refine['steps']} steps; `tune_refine.py`): mean IoU of persons' masks in other pictures,
with a margin around their boxes, {refine['held_out_iou'][0]:.3f} before, {refine['held_out_iou'][1]:.3f} after.

## Scores (training/evaluate.py, OpenVINO in float32; person pixels at score >= {c['score_threshold']})
Held-out pictures drawn by people (`val.json`, {c['images']} images), seen 768 px wide, as `segment` and `eval-seg` do:

| | measured | wanted |
|---|---|---|
| person mask AP50 | {c['person_segm_ap50']:.3f} | 0.60 |
| person mask AP | {c['person_segm_ap']:.3f} | |
| person pixel IoU | {c['person_pixel_iou']:.3f} | 0.72 |
| person pixel recall / precision | {c['person_pixel_recall']:.3f} / {c['person_pixel_precision']:.3f} | |
| persons above 96x96 px ({c['near_persons']}): found | {c['near_person_recall']:.3f} | 0.90 |
| the found ones' mean mask IoU | {c['near_person_mean_iou']:.3f} | 0.80 |
| person box AP50 | {c['person_bbox_ap50']:.3f} | |
| all classes, mask AP50 / AP | {c['all_segm_ap50']:.3f} / {c['all_segm_ap']:.3f} | |

Other widths, and eight bits as processors without fast 16-bit floats run it: `run` takes {size['width']} px in floats and, in eight bits,
512 px with instructions for them (VNNI) and 416 px without, `segment --precision int8` {size['width']} px (near persons: found, mean IoU):

| trunk | AP50 | pixel IoU | near persons |
|---|---|---|---|
{other_input(f"float, {size['width']} px", s['coco_640'])}
{other_input(f"eight bits, {size['width']} px", s['coco_int8'])}
{other_input("eight bits, 512 px", s['coco_int8_512'])}
{other_input("eight bits, 416 px", s['coco_int8_416'])}

Composed RGB-D sequences (real room, cut-out actors), {size['width']} px in float32, person pixels, medians over frames:
{sequence_table(s, TARGETS)}
The same in eight bits at 512 px:
{sequence_table(s["sequences_int8_512"], TARGETS)}
Rendered sequences (other seeds than those trained on: other people, dress, textures, light and camera; the same plan of the room):
{sequence_table(s["rendered"], dict.fromkeys(s["rendered"], "0.90 / 0.90"))}
How the two branches' masks are mixed, and how a score is made of box and mask, was chosen on these held-out pictures and some frames of
the sequences, and the size of the input by both (`training/README.md`): these numbers are therefore a little optimistic. The held-out
pictures are COCO's, and some may have been among those that the start weights' detector was trained on: there the scores may flatter.
The sequences cannot have been.

## Limits
Not all targets on the held-out pictures are reached (crowds, small and unusual persons; false persons on pictures without any; with so few
pictures one of them moves the pixel IoU by some 0.05), nor the recall on one of the rendered sequences (of seated persons the legs between
those of desk and chairs are missing); those on the others and on the composed sequences are.
Trained for persons; the other 21 classes have few drawn masks and are weak. Small persons (under about 40 px) are often missed. Two
detections of one person, or a chair or clothes on a hook taken for a person, occur: `dynamic` checks with motion and depth.

## SHA-256
"""
    out += "".join(f"- `{f}` {h}\n" for f, h in m["sha256"].items())
    last = rows[-1]
    out += f"\nLast losses: {', '.join(f'{k} {last[k]}' for k in ('rpn_obj', 'rpn_box', 'cls', 'box', 'mask', 'sem'))}.\n"
    with open(os.path.join(folder, "README.md"), "w") as f:
        f.write(out)


if __name__ == "__main__":
    main()
