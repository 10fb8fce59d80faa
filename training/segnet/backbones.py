"""Backbones. Each gives three feature maps, at strides 8, 16 and 32.

Only `mobilenet_v2` has weights here and is trained; the others exist to compare cost (the paper's Table II).
"""
import numpy as np
import torch
import torch.nn.functional as F
from torch import nn


class SameConv(nn.Conv2d):
    """Convolution with TensorFlow's SAME padding for even input sizes: stride 2 pads right and bottom only.

    The start weights were trained so; symmetric padding would shift every feature map by half a cell.
    """

    def __init__(self, cin, cout, k, stride=1, groups=1):
        super().__init__(cin, cout, k, stride, padding=0 if stride == 2 else k // 2, groups=groups, bias=True)
        self.tail = (k // 2) if stride == 2 else 0

    def forward(self, x):
        if not self.tail:
            return super().forward(x)
        if self.groups > 1 and self.weight.requires_grad and torch.is_grad_enabled():
            # The same numbers; the gradient of a strided depth-wise convolution in bfloat16 is 10 times slower on CPUs.
            return F.conv2d(x, self.weight, self.bias, 1, 1, 1, self.groups)[:, :, 1::2, 1::2]
        return super().forward(F.pad(x, (0, self.tail, 0, self.tail)))


def conv6(cin, cout, k, stride=1, groups=1):
    return nn.Sequential(SameConv(cin, cout, k, stride, groups), nn.ReLU6(inplace=True))


class InvertedResidual(nn.Module):
    def __init__(self, cin, cout, stride, expand):
        super().__init__()
        mid = cin * expand
        layers = [conv6(cin, mid, 1)] if expand != 1 else []
        layers += [conv6(mid, mid, 3, stride, groups=mid), SameConv(mid, cout, 1)]
        self.conv = nn.Sequential(*layers)
        self.add = stride == 1 and cin == cout

    def forward(self, x):
        y = self.conv(x)
        return x + y if self.add else y


class MobileNetV2(nn.Module):
    """Width 1.0, batch normalisation folded into the convolutions (the start weights come so)."""

    channels = (32, 96, 320)

    def __init__(self):
        super().__init__()
        blocks, cin = [conv6(3, 32, 3, 2)], 32
        for t, c, n, s in ((1, 16, 1, 1), (6, 24, 2, 2), (6, 32, 3, 2), (6, 64, 4, 2), (6, 96, 3, 1), (6, 160, 3, 2), (6, 320, 1, 1)):
            for i in range(n):
                blocks.append(InvertedResidual(cin, c, s if i == 0 else 1, t))
                cin = c
        self.features = nn.Sequential(*blocks)
        self.frozen = 0                                    # so many leading blocks are not trained

    def freeze(self, blocks):
        self.frozen = blocks
        for p in self.features[:blocks].parameters():
            p.requires_grad_(False)

    def load_folded(self, path):
        """Weights by torchvision's layer names (`features.1.conv.0.0.weight`), in network order."""
        stored = np.load(path)
        own = [(n, m) for n, m in self.named_modules() if isinstance(m, nn.Conv2d)]
        names = [k[:-7] for k in stored.files if k.startswith("features.") and k.endswith(".weight")]
        names.sort(key=lambda n: [int(p) for p in n.split(".") if p.isdigit()])
        for (own_name, m), name in zip(own, names):
            w, b = stored[name + ".weight"], stored[name + ".bias"]
            if tuple(w.shape) != tuple(m.weight.shape):
                raise ValueError(f"{path}: {name} has shape {w.shape}, {own_name} needs {tuple(m.weight.shape)}")
            m.weight.data.copy_(torch.from_numpy(w))
            m.bias.data.copy_(torch.from_numpy(b))

    def forward(self, x, done=0):
        """done: so many leading blocks (at most 7, the first output) were already applied to x, see Frozen."""
        out = [x] if done == 7 else []
        for i, block in enumerate(self.features):
            if i < done:
                continue
            if i < self.frozen:
                with torch.no_grad():
                    x = block(x)
            else:
                x = block(x)
            if i in (6, 13, 17):
                out.append(x)
        return out


class Frozen:
    """The frozen leading blocks run by OpenVINO, which takes a third of PyTorch's time for them. short: in bfloat16."""

    def __init__(self, backbone, threads, short):
        import openvino as ov
        self.done, self.compiled, self.ov = backbone.frozen, {}, ov
        self.part = nn.Sequential(*(b for b in backbone.features[:backbone.frozen])).to(memory_format=torch.contiguous_format)
        self.type = torch.bfloat16 if short else torch.float32
        self.options = {"INFERENCE_NUM_THREADS": threads, "NUM_STREAMS": 1, "INFERENCE_PRECISION_HINT": "bf16" if short else "f32"}

    def __call__(self, x):
        key = tuple(x.shape)
        if key not in self.compiled:
            with torch.no_grad():
                traced = torch.jit.trace(self.part, torch.zeros(key), check_trace=False)
            m = self.ov.convert_model(traced, example_input=torch.zeros(key))
            m.reshape(list(key))
            self.compiled[key] = self.ov.Core().compile_model(m, "CPU", self.options).create_infer_request()
        r = self.compiled[key]
        r.infer([x.contiguous().numpy()], share_inputs=True)
        return torch.from_numpy(r.get_output_tensor(0).data.copy()).to(self.type).contiguous(memory_format=torch.channels_last)


class Sliced(nn.Module):
    """A torchvision classifier's trunk cut after three of its stages."""

    def __init__(self, stages, channels):
        super().__init__()
        self.stages, self.channels = nn.ModuleList(stages), channels

    def freeze(self, blocks):
        for p in self.stages[0][:blocks].parameters():
            p.requires_grad_(False)

    def forward(self, x):
        out = []
        for s in self.stages:
            x = s(x)
            out.append(x)
        return out


def mobilenet_v3_large():
    import torchvision
    f = torchvision.models.mobilenet_v3_large(weights=None).features
    return Sliced([f[:7], f[7:13], f[13:16]], (40, 112, 160))


def resnet(depth):
    import torchvision
    r = getattr(torchvision.models, f"resnet{depth}")(weights=None)
    stem = nn.Sequential(r.conv1, r.bn1, r.relu, r.maxpool, r.layer1)
    return Sliced([nn.Sequential(*stem, *r.layer2), r.layer3, r.layer4], (512, 1024, 2048))


class GhostModule(nn.Module):
    """Half the channels by a point-wise convolution, the other half from them by a cheap depth-wise one."""

    def __init__(self, cin, cout, act=True):
        super().__init__()
        half = cout // 2
        relu = (lambda: nn.ReLU(inplace=True)) if act else nn.Identity
        self.primary = nn.Sequential(nn.Conv2d(cin, half, 1, bias=False), nn.BatchNorm2d(half), relu())
        self.cheap = nn.Sequential(nn.Conv2d(half, half, 3, 1, 1, groups=half, bias=False), nn.BatchNorm2d(half), relu())

    def forward(self, x):
        a = self.primary(x)
        return torch.cat((a, self.cheap(a)), 1)


class GhostBlock(nn.Module):
    def __init__(self, cin, mid, cout, k, stride, se):
        super().__init__()
        from torchvision.ops import SqueezeExcitation
        layers = [GhostModule(cin, mid)]
        if stride > 1:
            layers += [nn.Conv2d(mid, mid, k, stride, k // 2, groups=mid, bias=False), nn.BatchNorm2d(mid)]
        if se:
            layers.append(SqueezeExcitation(mid, max(8, mid // 4), scale_activation=nn.Hardsigmoid))
        layers.append(GhostModule(mid, cout, act=False))
        self.body = nn.Sequential(*layers)
        self.short = nn.Sequential() if stride == 1 and cin == cout else nn.Sequential(
            nn.Conv2d(cin, cin, k, stride, k // 2, groups=cin, bias=False), nn.BatchNorm2d(cin),
            nn.Conv2d(cin, cout, 1, bias=False), nn.BatchNorm2d(cout))

    def forward(self, x):
        return self.body(x) + self.short(x)


def ghostnet():
    """GhostNet 1.0 (Han et al. 2020), its table of layers."""
    stem = [nn.Conv2d(3, 16, 3, 2, 1, bias=False), nn.BatchNorm2d(16), nn.ReLU(inplace=True)]
    table = [(3, 16, 16, 0, 1), (3, 48, 24, 0, 2), (3, 72, 24, 0, 1), (5, 72, 40, 1, 2), (5, 120, 40, 1, 1),
             (3, 240, 80, 0, 2), (3, 200, 80, 0, 1), (3, 184, 80, 0, 1), (3, 184, 80, 0, 1), (3, 480, 112, 1, 1), (3, 672, 112, 1, 1),
             (5, 672, 160, 1, 2), (5, 960, 160, 0, 1), (5, 960, 160, 1, 1), (5, 960, 160, 0, 1), (5, 960, 160, 1, 1)]
    blocks, cin = [], 16
    for k, mid, cout, se, stride in table:
        blocks.append(GhostBlock(cin, mid, cout, k, stride, se))
        cin = cout
    return Sliced([nn.Sequential(*stem, *blocks[:5]), nn.Sequential(*blocks[5:11]), nn.Sequential(*blocks[11:])], (40, 112, 160))


MAKERS = {"mobilenet_v2": MobileNetV2, "mobilenet_v3_large": mobilenet_v3_large, "resnet50": lambda: resnet(50),
          "resnet101": lambda: resnet(101), "ghostnet": ghostnet}


def make(name):
    if name not in MAKERS:
        raise ValueError(f"unknown backbone {name!r}; known: {', '.join(MAKERS)}")
    return MAKERS[name]()
