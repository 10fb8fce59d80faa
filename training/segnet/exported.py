"""Weights back from exported graphs, to go on training from what ships."""
import json
import os

import torch
from torch import nn

GRAPHS = (("trunk", "net.", ""), ("box", "head.", "box."), ("mask", "head.", "mask."))       # file, its prefix, ours


def weights(folder, graph):
    """Of one of the exported graphs, by the names that they have there."""
    import onnx
    from onnx import numpy_helper
    initializers = onnx.load(os.path.join(folder, graph + ".onnx")).graph.initializer
    return {i.name: torch.from_numpy(numpy_helper.to_array(i).copy()) for i in initializers}


def load(net, folder, names, batches):
    """Fills net from the ONNX graphs of export.py in `folder`.

    Batch normalisation was folded into the convolutions. Each layer gets back the statistics that its input has over
    `batches` (as the loader gives them), with weights so that nothing changes: training then starts where it ended.
    """
    with open(os.path.join(folder, "model.json")) as f:
        classes = json.load(f)["classes"]
    if classes != names:
        raise ValueError(f"{folder}: was trained for {', '.join(classes)}; the data has {', '.join(names)}")
    stored = {}
    for graph, theirs, ours in GRAPHS:
        for name, values in weights(folder, graph).items():
            if name.startswith(theirs):
                stored[ours + name[len(theirs):]] = values
    modules = dict(net.named_modules())
    norms = []
    for name, module in modules.items():
        if isinstance(module, (nn.Conv2d, nn.Linear)):
            module.weight.data.copy_(stored[name + ".weight"])
            if module.bias is not None:
                module.bias.data.copy_(stored[name + ".bias"])
            else:                                          # model.conv_bn: the next of the sequence normalises
                parent, _, place = name.rpartition(".")
                norm = modules[f"{parent}.{int(place) + 1}"]
                norm.running_mean.zero_()
                norm.running_var.fill_(1 - norm.eps)
                norm.weight.data.fill_(1)
                norm.bias.data.copy_(stored[name + ".bias"])
                norms.append(norm)
    with torch.no_grad():
        restore_statistics(net, norms, batches)


def restore_statistics(net, norms, batches):
    moments = {n: [] for n in norms}
    hooks = [n.register_forward_pre_hook(lambda m, given: moments[m].append(torch.var_mean(given[0].float(), (0, 2, 3))))
             for n in norms]
    net.eval()
    for x, targets in batches:
        p, *_ = net.trunk(x.float() / 127.5 - 1)
        rois = [torch.cat((torch.full((len(t["boxes"]), 1), float(b)), t["boxes"]), 1) for b, t in enumerate(targets)]
        if sum(map(len, rois)):
            net.mask_head([q.contiguous() for q in p], torch.cat(rois))
    for h in hooks:
        h.remove()
    for norm, seen in moments.items():
        var, mean = (torch.stack(v).mean(0) for v in zip(*seen))
        norm.running_mean.copy_(mean)
        norm.running_var.copy_(var)
        norm.weight.data.copy_((var + norm.eps).sqrt())
        norm.bias.data.add_(mean)
