"""Training losses. Regions marked to be ignored count neither as object nor as background anywhere."""
import torch
import torch.nn.functional as F
from torchvision.ops import roi_align

from . import boxes, classes
from .model import MaskRcnn

WEIGHTS = {"box": 1.5, "mask": 1.5}        # of 1: boxes and masks are what held-out persons lose most by
ANCHORS_PER_IMAGE, ROIS_PER_IMAGE, MASKS_PER_IMAGE = 256, 96, 16


def choose(pos, neg, total, share):
    """Random indices: at most total * share of the positive ones, the rest negative ones."""
    pos = pos[torch.randperm(len(pos))[:int(total * share)]]
    neg = neg[torch.randperm(len(neg))[:total - len(pos)]]
    return pos, neg


def rpn_losses(obj, deltas, anchors, targets):
    flat = torch.cat([o.float().permute(0, 2, 3, 1).flatten(1) for o in obj], 1)
    delta = torch.cat([d.float().unflatten(1, (boxes.PER_CELL, 4)).permute(0, 3, 4, 1, 2).reshape(len(d), -1, 4) for d in deltas], 1)
    a = torch.cat(anchors)
    cls, reg, n = 0.0, 0.0, 0
    for b, t in enumerate(targets):
        gt = t["boxes"]
        best = torch.zeros(len(a))
        if len(gt):
            iou, _ = boxes.overlap(a, gt)
            best, which = iou.max(1)
            pos = best >= 0.6
            top = iou.max(0).values.clamp(min=0.2)                  # every object gets its best anchors, if they are any good
            pos |= (iou >= top[None] - 1e-4).any(1)
        else:
            pos = torch.zeros(len(a), dtype=torch.bool)
        neg = (best < 0.3) & ~pos
        if len(t["ignored"]):
            neg &= (boxes.overlap(a, t["ignored"])[1] < 0.5).all(1)
        p, q = choose(pos.nonzero()[:, 0], neg.nonzero()[:, 0], ANCHORS_PER_IMAGE, 0.5)
        i = torch.cat((p, q))
        y = torch.zeros(len(i))
        y[:len(p)] = 1
        cls = cls + F.binary_cross_entropy_with_logits(flat[b, i], y, reduction="sum")
        n += len(i)
        if len(p):
            reg = reg + F.smooth_l1_loss(delta[b, p], boxes.encode(gt[which[p]], a[p]), beta=1 / 9, reduction="sum")
    return cls / max(n, 1), reg / max(n, 1)


def sample_rois(proposals, targets):
    rois, labels, gts, matched = [], [], [], []
    for b, (prop, t) in enumerate(zip(proposals, targets)):
        gt = t["boxes"]
        r = torch.cat((prop, gt))
        if len(gt):
            best, which = boxes.overlap(r, gt)[0].max(1)
        else:
            best, which = torch.zeros(len(r)), torch.zeros(len(r), dtype=torch.long)
        neg = best < 0.5
        if len(t["ignored"]):
            neg &= (boxes.overlap(r, t["ignored"])[1] < 0.5).all(1)
        p, q = choose((best >= 0.5).nonzero()[:, 0], neg.nonzero()[:, 0], ROIS_PER_IMAGE, 0.3)
        i = torch.cat((p, q))
        rois.append(torch.cat((torch.full((len(i), 1), float(b)), r[i]), 1))
        lab = torch.zeros(len(i), dtype=torch.long)
        if len(p):
            lab[:len(p)] = t["labels"][which[p]]
        labels.append(lab)
        matched.append(which[i])
        gts.append(gt[which[i]] if len(gt) else torch.zeros((len(i), 4)))
    return torch.cat(rois), torch.cat(labels), torch.cat(gts), matched


def dice(p, y, w=None):
    """1 - soft overlap, per row of the flattened last dimension."""
    if w is not None:
        p, y = p * w, y * w
    return 1 - (2 * (p * y).sum(-1) + 1) / ((p * p).sum(-1) + (y * y).sum(-1) + 1)


def mask_losses(model, p, rois, labels, matched, targets):
    keep, want, worth, offset = [], [], [], 0
    for b, t in enumerate(targets):
        n = len(matched[b])
        i = (labels[offset:offset + n] > 0).nonzero()[:, 0]
        i = i[t["drawn"][matched[b][i]]]                            # the others have a box only
        i = i[torch.randperm(len(i))[:MASKS_PER_IMAGE]]
        if len(i):
            own, which = matched[b][i].unique(return_inverse=True)
            m = t["masks"][own].float()[:, None]
            r = torch.cat((which.float()[:, None], rois[offset + i][:, 1:]), 1)
            want.append((roi_align(m, r, 28, 1.0, 2, True)[:, 0] >= 0.5).float())
            keep.append(offset + i)
            worth.append(t["worth"][matched[b][i]])
        offset += n
    if not keep:
        return torch.zeros(()), 0
    keep, want, worth = torch.cat(keep), torch.cat(want).flatten(1), torch.cat(worth)
    logits = model.mask_head(p, rois[keep]).float()
    logits = logits[torch.arange(len(keep)), (labels[keep] != 1).long()].flatten(1)
    loss = F.binary_cross_entropy_with_logits(logits, want, reduction="none").mean(1) + 0.5 * dice(logits.sigmoid(), want)
    return (loss * worth).sum() / worth.sum(), len(keep)


def semantic_loss(logits, targets, movers):
    """Which pixels belong to a person, another mover, something movable: shares of a cell as soft targets."""
    want, valid = [], []
    for t in targets:
        groups = torch.zeros((4, *t["unsure"].shape))
        for m, c, drawn in zip(t["masks"], t["labels"], t["drawn"]):
            if not drawn:
                continue
            g = 0 if c == 1 else 1 if c <= movers else 2
            groups[g] = torch.maximum(groups[g], m.float())
        groups[3] = t["unsure"].float() * (1 - groups[:3].amax(0))
        g = F.avg_pool2d(groups[None], boxes.STRIDES[0])[0]
        want.append(g[:3])
        valid.append((g[3:] < 0.25).float().expand(3, -1, -1))
    want, valid = torch.stack(want).flatten(2), torch.stack(valid).flatten(2)
    x = logits.float().flatten(2)
    bce = (F.binary_cross_entropy_with_logits(x, want, reduction="none") * valid).mean()
    d = dice(x.sigmoid(), want, valid)[:, 0]
    return bce * 2.0 + 0.3 * d.mean()


def losses(model, x, targets, size, done=0, movers=classes.MOVERS):
    """Everything; call under autocast. Heads on ROIs run in the autocast type too, ROI-align in float32.

    size: (h, w) of the picture; done: see backbones.MobileNetV2.forward.
    """
    p, obj, deltas, semantic = model.trunk(x, done)
    anchors = MaskRcnn.anchors(obj)
    with torch.autocast("cpu", enabled=False):
        l_obj, l_reg = rpn_losses(obj, deltas, anchors, targets)
        proposals = [b for b, _ in MaskRcnn.proposals(obj, deltas, anchors, size, 200, 120)]
        rois, labels, gt, matched = sample_rois(proposals, targets)
        pf = [q.float().contiguous() for q in p]
    logits, d = model.box_head(pf, rois)
    logits, d = logits.float(), d.float()
    l_cls = F.cross_entropy(logits, labels)
    i = (labels > 0).nonzero()[:, 0]
    want = boxes.encode(gt[i], rois[i][:, 1:], boxes.BOX_WEIGHTS)
    l_box = F.smooth_l1_loss(d[i], want, reduction="sum") / max(len(labels), 1)
    l_mask, _ = mask_losses(model, pf, rois, labels, matched, targets)
    l_sem = semantic_loss(semantic, targets, movers)
    parts = {"rpn_obj": l_obj, "rpn_box": l_reg, "cls": l_cls, "box": l_box, "mask": l_mask, "sem": l_sem}
    return sum(WEIGHTS.get(k, 1.0) * v for k, v in parts.items()), parts
