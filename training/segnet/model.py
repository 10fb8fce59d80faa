"""Mask R-CNN with a light pyramid and light heads."""
import torch
import torch.nn.functional as F
from torch import nn
from torchvision.ops import nms

from . import backbones, boxes
from .align import align

CHANNELS = 96


def conv_bn(cin, cout, k=3):
    return nn.Sequential(nn.Conv2d(cin, cout, k, padding=k // 2, bias=False), nn.BatchNorm2d(cout, momentum=0.02), nn.ReLU(inplace=True))


class Pyramid(nn.Module):
    """Three levels top-down, plus the whole picture's mean as context (bodies may be larger than any receptive field)."""

    def __init__(self, cins):
        super().__init__()
        self.lateral = nn.ModuleList(nn.Conv2d(c, CHANNELS, 1) for c in cins)
        self.context = nn.Conv2d(cins[2], CHANNELS, 1)
        self.out = nn.ModuleList(conv_bn(CHANNELS, CHANNELS) for _ in cins)

    def forward(self, c):
        top = self.lateral[2](c[2]) + self.context(c[2].mean((2, 3), keepdim=True))
        mid = self.lateral[1](c[1]) + F.interpolate(top, scale_factor=2.0, mode="nearest")
        low = self.lateral[0](c[0]) + F.interpolate(mid, scale_factor=2.0, mode="nearest")
        return [f(x) for f, x in zip(self.out, (low, mid, top))]


class Rpn(nn.Module):
    def __init__(self):
        super().__init__()
        self.conv = conv_bn(CHANNELS, CHANNELS)
        self.objectness = nn.Conv2d(CHANNELS, boxes.PER_CELL, 1)
        self.deltas = nn.Conv2d(CHANNELS, boxes.PER_CELL * 4, 1)

    def forward(self, p):
        x = self.conv(p)
        return self.objectness(x), self.deltas(x)


class BoxHead(nn.Module):
    """[N, 7*7*96] in (y, x, channel) order -> class logits [N, 1 + classes], deltas [N, 4] (one box for all classes)."""

    def __init__(self, classes, width=384):
        super().__init__()
        self.fc = nn.Sequential(nn.Linear(49 * CHANNELS, width), nn.ReLU(inplace=True), nn.Linear(width, width), nn.ReLU(inplace=True))
        self.score, self.deltas = nn.Linear(width, classes + 1), nn.Linear(width, 4)

    def forward(self, x):
        x = self.fc(x)
        return self.score(x), self.deltas(x)


class MaskHead(nn.Module):
    """[M, 96, 14, 14] -> logits [M, 2, 28, 28]: channel 0 for persons, 1 for every other class.

    Two channels and not one per class: most of the rare classes have too few drawn masks to learn a channel of their own.
    """

    def __init__(self):
        super().__init__()
        self.convs = nn.Sequential(*[conv_bn(CHANNELS, CHANNELS) for _ in range(4)])
        # Twice the size: what a 2x2 transposed convolution of stride 2 does, whose gradient is slow on CPUs.
        self.up = nn.Sequential(nn.Conv2d(CHANNELS, 64 * 4, 1), nn.PixelShuffle(2))
        self.logits = nn.Conv2d(64, 2, 1)

    def forward(self, x):
        return self.logits(F.relu(self.up(self.convs(x))))


class MaskRcnn(nn.Module):
    def __init__(self, backbone="mobilenet_v2", classes=22):
        super().__init__()
        self.backbone = backbones.make(backbone)
        self.pyramid = Pyramid(self.backbone.channels)
        self.rpn = Rpn()
        self.box = BoxHead(classes)
        self.mask = MaskHead()
        self.semantic = nn.Conv2d(CHANNELS, 3, 1)     # stride 8: person, other mover, movable; sharpens the pyramid
        for m in (self.rpn.objectness, self.rpn.deltas, self.box.deltas):
            nn.init.normal_(m.weight, std=0.01)
            nn.init.zeros_(m.bias)
        nn.init.constant_(self.rpn.objectness.bias, -3.0)
        nn.init.normal_(self.box.score.weight, std=0.01)
        nn.init.constant_(self.semantic.bias, -2.0)
        self.classes = classes

    def trunk(self, x, done=0):
        """x: RGB in [-1, 1]. Pyramid levels, objectness and deltas per level, semantic logits."""
        p = self.pyramid(self.backbone(x, done) if done else self.backbone(x))
        r = [self.rpn(q) for q in p]
        return p, [a for a, _ in r], [b for _, b in r], self.semantic(p[0])

    @staticmethod
    def anchors(objectness):
        return [boxes.anchors(i, *o.shape[-2:]) for i, o in enumerate(objectness)]

    @staticmethod
    @torch.no_grad()
    def proposals(objectness, deltas, anchors, size, before=300, after=100, threshold=0.7):
        """Per picture: best `before` of each level, decoded, NMS over all levels together, best `after`."""
        out = []
        for b in range(objectness[0].shape[0]):
            picked, scores = [], []
            for o, d, a in zip(objectness, deltas, anchors):
                s = o[b].float().permute(1, 2, 0).reshape(-1)
                d = d[b].float().reshape(boxes.PER_CELL, 4, *d.shape[-2:]).permute(2, 3, 0, 1).reshape(-1, 4)
                s, i = s.topk(min(before, len(s)))
                picked.append(boxes.decode(d[i], a[i], size))
                scores.append(s)
            box, s = torch.cat(picked), torch.cat(scores)
            ok = (box[:, 2] - box[:, 0] >= 4) & (box[:, 3] - box[:, 1] >= 4)
            box, s = box[ok], s[ok]
            keep = nms(box, s, threshold)[:after]
            out.append((box[keep], s[keep]))
        return out

    def box_head(self, p, rois):
        return self.box(align(p, rois, 7, boxes.BOX_LEVELS).flatten(1))

    def mask_head(self, p, rois):
        return self.mask(align(p, rois, 14, boxes.MASK_LEVELS).permute(0, 3, 1, 2))

    @torch.no_grad()
    def detect(self, x, score=0.05, nms_threshold=0.5, most=50):
        """Per picture: boxes, labels (1 = first class), scores, mask probabilities [n, 28, 28], in the input's pixels."""
        size = x.shape[-2:]
        p, obj, deltas, semantic = self.trunk(x)
        p = [q.float().contiguous() for q in p]
        out = []
        for b, (prop, _) in enumerate(self.proposals(obj, deltas, self.anchors(obj), size)):
            logits, d = self.box_head(p, torch.cat((torch.full((len(prop), 1), float(b)), prop), 1))
            prob = logits.float().softmax(1)
            box = boxes.decode(d.float(), prop, size, boxes.BOX_WEIGHTS)
            i, c = (prob[:, 1:] >= score).nonzero(as_tuple=True)
            bb, ss, cc = box[i], prob[i, c + 1], c + 1
            ok = (bb[:, 2] - bb[:, 0] >= 2) & (bb[:, 3] - bb[:, 1] >= 2)
            bb, ss, cc = bb[ok], ss[ok], cc[ok]
            keep = nms(bb + cc[:, None].float() * 4096.0, ss, nms_threshold)[:most]
            bb, ss, cc = bb[keep], ss[keep], cc[keep]
            if len(bb):
                m = self.mask_head(p, torch.cat((torch.full((len(bb), 1), float(b)), bb), 1)).float().sigmoid()
                m = m[torch.arange(len(bb)), (cc != 1).long()]
            else:
                m = torch.zeros((0, 28, 28))
            out.append({"boxes": bb, "labels": cc, "scores": ss, "masks": m, "semantic": semantic[b].float().sigmoid()})
        return out
