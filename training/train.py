#!/usr/bin/env python3
"""Trains the network. The learning rate follows the clock, so that it always ends annealed on time. See README.md."""
import argparse
import copy
import itertools
import json
import math
import os
import time
from datetime import datetime, timezone

import torch
import torch.distributed as dist

from segnet import backbones, dataset, exported, losses, model, transplant


EMA_EVERY = 4
TRANSPLANT_BATCHES = 100
STATISTICS_BATCHES = 24    # for batch normalisation, when the start weights come from exported graphs


def arguments():
    a = argparse.ArgumentParser(description=__doc__)
    a.add_argument("--train", required=True, help="COCO JSON")
    a.add_argument("--images", required=True, help="folder that the JSON's file names are relative to")
    a.add_argument("--also", nargs=3, action="append", default=[], metavar=("JSON", "IMAGES", "SHARE"),
                   help="more data of the same classes, and the share of all pictures that is to come from it")
    a.add_argument("--out", required=True, help="folder for check points and the log; an old check point there is continued")
    a.add_argument("--backbone", default="mobilenet_v2")
    a.add_argument("--start", help="start weights of the backbone (.npz by torchvision's layer names); with --init, the rest is fitted to it")
    a.add_argument("--init", help="check point, or folder of exported graphs such as ../models, to start from (weights only)")
    a.add_argument("--until", help="UTC time of the day HH:MM to end at")
    a.add_argument("--minutes", type=float, default=60, help="how long, without --until")
    a.add_argument("--lr", type=float, default=7e-4)
    a.add_argument("--backbone-lr", type=float, default=0.3, help="as a share of --lr")
    a.add_argument("--freeze", type=int, default=5, help="leading backbone blocks that keep their start weights")
    a.add_argument("--processes", type=int, default=2, help="each takes its share of every batch; faster on CPUs than threads")
    a.add_argument("--threads", type=int, default=1, help="per process")
    a.add_argument("--workers", type=int, default=1, help="loaders per process")
    a.add_argument("--port", type=int, default=29517, help="of this machine, for the processes to exchange gradients")
    a.add_argument("--seed", type=int, default=1)
    a.add_argument("--save-every", type=float, default=300, help="seconds")
    return a.parse_args()


def rate(progress, step):
    return min(1.0, (step + 1) / 200) * (0.01 + 0.99 * 0.5 * (1 + math.cos(math.pi * min(1.0, progress))))


def main():
    o = arguments()
    os.makedirs(o.out, exist_ok=True)
    torch.manual_seed(o.seed)
    torch.set_num_threads(o.threads)
    last = os.path.join(o.out, "last.pt")
    state = torch.load(last, weights_only=False) if os.path.exists(last) else None
    begin = state["begin"] if state else time.time()
    end = state["end"] if state else begin + 60 * o.minutes
    if o.until:
        now = datetime.now(timezone.utc)
        h, m = map(int, o.until.split(":"))
        end = now.replace(hour=h, minute=m, second=0).timestamp()
        if end < now.timestamp():
            end += 86400
    data = dataset.Batches([(o.train, o.images, None)] + o.also, [o.seed, state["step"] if state else 0], begin, end)
    rank = 0
    while rank + 1 < o.processes and os.fork() == 0:       # forked after loading: the pictures are shared
        rank += 1
    if o.processes > 1:
        dist.init_process_group("gloo", f"tcp://127.0.0.1:{o.port}", rank=rank, world_size=o.processes)
    torch.manual_seed(o.seed)                              # of the first weights
    net = model.MaskRcnn(o.backbone, len(data.names))
    if rank == 0 and not state:
        if o.init and os.path.isdir(o.init):
            exported.load(net, o.init, data.names, itertools.islice(data, STATISTICS_BATCHES))
        elif o.init:
            net.load_state_dict(torch.load(o.init, weights_only=False)["ema"])
        if o.start and o.init:
            shares = transplant.backbone(net, o.start, itertools.islice(data, TRANSPLANT_BATCHES))
            print("new backbone; of the lateral convolutions' variance explained:", *(f"{s:.2f}" for s in shares), flush=True)
        elif o.start:
            net.backbone.load_folded(o.start)
    if o.processes > 1:                                    # the same for all: what was fitted depends on the clock
        for t in net.state_dict().values():
            dist.broadcast(t, 0)
    net.backbone.freeze(o.freeze)
    net = net.to(memory_format=torch.channels_last)
    back = [p for p in net.backbone.parameters() if p.requires_grad]
    rest = [p for n, p in net.named_parameters() if not n.startswith("backbone.")]
    groups = []
    for ps, share in ((back, o.backbone_lr), (rest, 1.0)):
        groups += [{"params": [p for p in ps if p.ndim > 1], "share": share, "weight_decay": 0.02},
                   {"params": [p for p in ps if p.ndim <= 1], "share": share, "weight_decay": 0.0}]
    opt = torch.optim.AdamW(groups, lr=o.lr, betas=(0.9, 0.99), fused=True)
    ema = copy.deepcopy(net).eval()
    step, seen = 0, 0
    if state:
        net.load_state_dict(state["net"])
        ema.load_state_dict(state["ema"])
        opt.load_state_dict(state["opt"])
        step, seen = state["step"], state["seen"]
    log = open(os.path.join(o.out, "log.jsonl"), "a", buffering=1)

    torch.manual_seed(o.seed * 1000 + rank + 7919 * step)
    data.seed = [*data.seed, rank]
    short = torch.ops.mkldnn._is_mkldnn_bf16_supported()   # elsewhere bfloat16 is emulated, and several times slower
    frozen = None
    if o.freeze and o.backbone == "mobilenet_v2":
        try:
            frozen = backbones.Frozen(net.backbone, o.threads, short)
        except ImportError:
            pass
    trained = [p for g in opt.param_groups for p in g["params"]]

    def save():
        if rank:
            return
        torch.save({"net": net.state_dict(), "ema": ema.state_dict(), "opt": opt.state_dict(), "step": step, "seen": seen, "begin": begin,
                    "end": end, "names": data.names, "backbone": o.backbone, "options": vars(o)}, last + ".part")
        os.replace(last + ".part", last)

    loader = torch.utils.data.DataLoader(data, batch_size=None, num_workers=o.workers, prefetch_factor=6 if o.workers else None)
    mean, saved, clock, busy = {}, time.time(), time.time(), time.process_time()
    net.train()
    for x, targets in loader:
        size = tuple(x.shape[-2:])
        x = (x.float() / 127.5 - 1).contiguous(memory_format=torch.channels_last)
        if frozen:
            x = frozen(x)
        with torch.autocast("cpu", torch.bfloat16, enabled=short):
            loss, parts = losses.losses(net, x, targets, size, frozen.done if frozen else 0)
        opt.zero_grad(set_to_none=True)
        loss.backward()
        clock_now = torch.tensor([(time.time() - begin) / (end - begin), float(torch.isfinite(loss)), float(len(x))])
        flat = torch.cat([torch.zeros(p.numel()) if p.grad is None else p.grad.flatten() for p in trained] + [clock_now])
        if o.processes > 1:
            dist.all_reduce(flat)
            flat /= o.processes
        progress, finite, count = flat[-3:].tolist()       # averages: every process decides alike
        if progress >= 1:
            break
        if finite < 1:
            log.write(json.dumps({"step": step, "skipped": "loss not finite"}) + "\n")
            continue
        for g in opt.param_groups:
            g["lr"] = o.lr * g["share"] * rate(progress, step)
        for p, g in zip(trained, flat[:-3].split([p.numel() for p in trained])):
            p.grad = g.view_as(p)
        torch.nn.utils.clip_grad_norm_(trained, 10.0)
        opt.step()
        step, seen = step + 1, seen + round(count * o.processes)
        if rank:
            continue
        if step % EMA_EVERY == 0:
            d = min(0.997 ** EMA_EVERY, (1 + step) / (10 + step))
            with torch.no_grad():
                mine, avg = list(net.state_dict().values()), list(ema.state_dict().values())
                f = [i for i, p in enumerate(avg) if p.is_floating_point()]
                torch._foreach_lerp_([avg[i] for i in f], [mine[i] for i in f], 1 - d)
        for k, v in {**parts, "all": loss}.items():
            v = float(torch.as_tensor(v).detach())          # a batch without objects has plain zeros
            mean[k] = mean[k] * 0.98 + 0.02 * v if k in mean else v
        if step % 50 == 0 and rank == 0:
            now = time.time()
            row = {"step": step, "seen": seen, "progress": round(progress, 4), "s_per_step": round((now - clock) / 50, 3), "cpu_s_per_step": round((time.process_time() - busy) / 50, 3),
                   "lr": opt.param_groups[-1]["lr"], **{k: round(v, 4) for k, v in mean.items()}}
            log.write(json.dumps(row) + "\n")
            clock, busy = now, time.process_time()
        if rank == 0 and time.time() - saved > o.save_every:
            save()
            saved = time.time()
    save()
    if rank == 0:
        log.write(json.dumps({"step": step, "seen": seen, "finished": True}) + "\n")
    os._exit(0)                                            # loaders and peers end with us


if __name__ == "__main__":
    main()
