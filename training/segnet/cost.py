"""What the network computes, in multiply-adds of its convolutions and matrix products."""
import torch

from . import model


def multiply_adds(net, size):
    """{"trunk": of one picture, "box": of one region, "mask": of one region}"""
    total = [0]

    def count(m, _, out):
        total[0] += out.numel() * m.weight.numel() // m.weight.shape[0]

    hooks = [m.register_forward_hook(count) for m in net.modules() if isinstance(m, (torch.nn.Conv2d, torch.nn.Linear))]
    out = {}
    with torch.no_grad():
        for name, run in (("trunk", lambda: net.trunk(torch.zeros(1, 3, *size))), ("box", lambda: net.box(torch.zeros(1, 49 * model.CHANNELS))),
                          ("mask", lambda: net.mask(torch.zeros(1, model.CHANNELS, 14, 14)))):
            total[0] = 0
            run()
            out[name] = total[0]
    for h in hooks:
        h.remove()
    return out


def gflops(net, size):
    """The same in 10^9 operations, two to a multiply-add."""
    return {k: round(2e-9 * v, 6) for k, v in multiply_adds(net, size).items()}
