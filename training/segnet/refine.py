"""Sharpens a mask with features at stride 4, which the pyramid that masks are made of does not have.

After A. Kirillov et al., PointRend (2020), and G. Zhang et al., RefineMask (2021): coarse masks know what is there, early features of the
backbone where it ends. Here a few convolutions over the whole region do, on frozen features, small enough for every object of every frame.
"""
import torch
import torch.nn.functional as F
from torch import nn

WIDTH, LAYERS = 24, 4
LEAN = 0.2          # added to the logits in use: inside from 0.45 on, as beside a camera a missed limb costs more than a rim


class Refine(nn.Module):
    """logits [n, S, S] of the mask head's mask, features [n, S, S, channels] -> probabilities [n, S, S]; nothing is
    changed to begin with but for LEAN."""

    def __init__(self, channels):
        super().__init__()
        self.convs = nn.ModuleList(nn.Conv2d(WIDTH if k else 1 + channels, WIDTH, 3, padding=1) for k in range(LAYERS))
        self.last = nn.Conv2d(WIDTH, 1, 1)
        nn.init.zeros_(self.last.weight)
        nn.init.zeros_(self.last.bias)
        self.register_buffer("scale", torch.ones(1, 1 + channels, 1, 1))

    def normalise(self, features):
        """Inputs of about 1: the logits by a quarter, the features [n, S, S, channels] by their standard deviation."""
        self.scale[0, 0] = 0.25
        self.scale[0, 1:, 0, 0] = 1 / features.float().flatten(0, 2).std(0).clamp(min=1e-3)

    def logits(self, logits, features):
        x = torch.cat((logits[:, None], features.permute(0, 3, 1, 2)), 1) * self.scale
        for c in self.convs:
            x = F.relu(c(x))
        return logits + self.last(x).squeeze(1)

    def forward(self, logits, features):
        return (self.logits(logits, features) + LEAN).sigmoid()
