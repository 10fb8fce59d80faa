#!/usr/bin/env python3
"""Shows whether tracking time and memory grow over a long run.

  long_run.py PROGRAM FOLDER [--frames 10000] [--rendered 1000] [--motion halfsphere] [--size 640x480] [--report BASE]

Renders `--rendered` frames of an empty room into FOLDER, streams them forth and back until `--frames` frames have passed
(so that from the second pass on every place is an old one; --rendered equal to --frames: one long way), runs the program on
them and follows its statistics and its memory. Per 500 frames: milliseconds of tracking (wall clock) and of processor time
(whole process), resident memory, key frames, landmarks. --report writes BASE.json and BASE.svg.
Exit code 1 when the camera was lost, when the last quarter took more than 1.25 times the processor time of the second one
(wall clock tells about the machine's other work, too), or when memory grew by more than a tenth in the second half of a run
over old places."""
import argparse
import json
import math
import os
import pathlib
import shutil
import subprocess
import sys
import time

STEP = 500
MAX_TIME_GROWTH, MAX_MEMORY_GROWTH = 1.25, 0.10


def ping_pong(count, length):
    """0, 1, ..., length-1, length-2, ..., 1, 0, 1, ...: `count` indices."""
    period = max(1, 2 * (length - 1))
    return [min(i % period, period - i % period) if length > 1 else 0 for i in range(count)]


def content_lines(path):
    return [line for line in path.read_text().splitlines() if line and not line.startswith("#")]


def stretch(rendered, folder, count):
    """A recording of `count` frames that reads the rendered images forth and back, with stamps that go on."""
    shutil.rmtree(folder, ignore_errors=True)
    folder.mkdir(parents=True)
    lists = {name: content_lines(rendered / name) for name in ("rgb.txt", "depth.txt", "groundtruth.txt")}
    length = len(lists["rgb.txt"])
    for name in ("rgb", "depth"):
        (folder / name).symlink_to((rendered / name).resolve())
    shutil.copy(rendered / "camera.yaml", folder / "camera.yaml")
    rate = next(float(line.split()[1]) for line in content_lines(folder / "camera.yaml") if line.startswith("fps"))
    order = ping_pong(count, length)
    for name, lines in lists.items():
        with open(folder / name, "w", encoding="ascii") as out:
            for number, index in enumerate(order):
                out.write(f"{1 + number / rate:.6f} {lines[index].split(maxsplit=1)[1]}\n")
    return math.ceil(count / max(1, length - 1))


def resident_mb(pid):
    for line in pathlib.Path(f"/proc/{pid}/status").read_text().splitlines():
        if line.startswith("VmRSS:"):
            return int(line.split()[1]) / 1000
    return math.nan


def follow(program, sequence, out):
    """Runs the program. @return its samples: (frames, tracking ms in all, processor s, memory MB, key frames, landmarks)."""
    shutil.rmtree(out, ignore_errors=True)
    process = subprocess.Popen([program, "run", sequence, "--out", out, "--mode", "orb", "--quiet"])
    samples, last = [], -1
    while process.poll() is None:
        time.sleep(0.2)  # the program renews its statistics about once a second
        try:
            stats = json.loads((out / "stats.json").read_text())
            memory = resident_mb(process.pid)
        except (OSError, ValueError):
            continue
        tracking = stats["stages_ms"].get("tracking")
        if stats["end"] != "running" or stats["frames"] == last or not tracking:
            continue
        last = stats["frames"]
        samples.append((last, tracking["count"] * tracking["mean"], stats["cpu_s"], memory, stats["key_frames"],
                        stats["landmarks"]))
    if process.returncode != 0:
        raise SystemExit(f"long_run: the program ended with {process.returncode}")
    return samples, json.loads((out / "stats.json").read_text())


def at(samples, frames, column):
    """A column at a number of frames, between the samples around it."""
    before = (0, 0, 0, samples[0][3], 0, 0)
    for sample in samples:
        if sample[0] >= frames:
            share = (frames - before[0]) / (sample[0] - before[0])
            return before[column] + share * (sample[column] - before[column])
        before = sample
    return before[column]


def bins(samples):
    rows = []
    for end in range(STEP, samples[-1][0] + 1, STEP):
        rows.append({
            "frames": end,
            "tracking_ms": round((at(samples, end, 1) - at(samples, end - STEP, 1)) / STEP, 3),
            "cpu_ms": round(1000 * (at(samples, end, 2) - at(samples, end - STEP, 2)) / STEP, 3),
            "memory_mb": round(at(samples, end, 3), 1),
            "key_frames": round(at(samples, end, 4)),
            "landmarks": round(at(samples, end, 5)),
        })
    return rows


def chart(rows, keys, title, top, height=190, width=760):
    """One group of SVG elements: lines of `keys` over the number of frames, from zero."""
    left, right, bottom = 70, width - 20, top + height - 30
    most = max(row[key] for row in rows for key, _ in keys) or 1
    tick = 10 ** math.floor(math.log10(most))
    tick = tick if most / tick >= 4 else tick / 2 if most / tick >= 2 else tick / 5
    x = lambda frames: left + (right - left) * frames / rows[-1]["frames"]
    y = lambda value: bottom - (bottom - top - 22) * value / (most * 1.05)
    parts = [f'<text x="{left}" y="{top + 10}" font-weight="bold">{title}</text>']
    for i in range(int(most * 1.05 / tick) + 1):
        parts.append(f'<line x1="{left}" x2="{right}" y1="{y(i * tick):.1f}" y2="{y(i * tick):.1f}" stroke="#ddd"/>'
                     f'<text x="{left - 6}" y="{y(i * tick) + 4:.1f}" text-anchor="end">{i * tick:g}</text>')
    for frames in range(0, rows[-1]["frames"] + 1, max(STEP, rows[-1]["frames"] // 10 // STEP * STEP)):
        parts.append(f'<text x="{x(frames):.1f}" y="{bottom + 16}" text-anchor="middle">{frames}</text>')
    for place, (key, colour) in enumerate(keys):
        points = " ".join(f'{x(row["frames"]):.1f},{y(row[key]):.1f}' for row in rows)
        parts.append(f'<polyline points="{points}" fill="none" stroke="{colour}" stroke-width="2"/>'
                     f'<text x="{right - 130 * place}" y="{top + 10}" text-anchor="end" fill="{colour}">{key}</text>')
    return parts


def draw(rows, title):
    charts = [([("tracking_ms", "#1f5fbf"), ("cpu_ms", "#c06020")], "milliseconds per frame, mean of 500 frames"),
              ([("memory_mb", "#1f5fbf")], "resident memory, MB"),
              ([("landmarks", "#1f5fbf")], "landmarks"),
              ([("key_frames", "#1f5fbf")], "key frames")]
    parts = ['<svg xmlns="http://www.w3.org/2000/svg" width="780" height="830" font-family="sans-serif" font-size="12">',
             '<rect width="780" height="830" fill="white"/>', f'<text x="20" y="22" font-size="15">{title}</text>']
    for number, (keys, name) in enumerate(charts):
        parts += chart(rows, keys, name, 44 + 196 * number)
    return "\n".join(parts + ["</svg>", ""])


def judge(rows, stats, passes):
    """What is wrong; nothing when all is well."""
    quarter, faults = max(1, len(rows) // 4), []
    if stats["tracked"] != stats["frames"]:
        faults.append(f"{stats['frames'] - stats['tracked']} frames were not tracked")
    for key in ("tracking_ms", "cpu_ms"):
        growth = sum(row[key] for row in rows[-quarter:]) / sum(row[key] for row in rows[quarter:2 * quarter])
        print(f"{key}: last quarter / second quarter = {growth:.2f}")
    if growth > MAX_TIME_GROWTH:
        faults.append("time per frame grows")
    half, end = rows[len(rows) // 2], rows[-1]
    growth = end["memory_mb"] / half["memory_mb"] - 1
    print(f"memory over the second half: {half['memory_mb']} MB -> {end['memory_mb']} MB ({100 * growth:+.1f} %)")
    if passes > 3 and growth > MAX_MEMORY_GROWTH:
        faults.append("memory grows although all places are old")
    return faults


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("program", type=pathlib.Path)
    parser.add_argument("folder", type=pathlib.Path)
    parser.add_argument("--frames", type=int, default=10000)
    parser.add_argument("--rendered", type=int, default=1000)
    parser.add_argument("--motion", default="halfsphere")
    parser.add_argument("--size", default="640x480")
    parser.add_argument("--report", type=pathlib.Path)
    a = parser.parse_args()
    a.program = a.program.resolve()
    rendered = a.folder / f"rendered_{a.motion}_{a.rendered}_{a.size}"
    if not rendered.exists():
        a.folder.mkdir(parents=True, exist_ok=True)
        subprocess.run([a.program, "render", "--people", "none", "--motion", a.motion, "--frames", str(a.rendered),
                        "--size", a.size, "--out", rendered, "--threads", str(os.cpu_count() or 1)], check=True)
    passes = stretch(rendered, a.folder / "sequence", a.frames)
    samples, stats = follow(a.program, a.folder / "sequence", a.folder / "out")
    rows = bins(samples)
    error = json.loads((a.folder / "out" / "evaluation.json").read_text())["estimate"]["ate_m"]["rmse"]
    for row in rows:
        print("  ".join(f"{key} {value:>8}" for key, value in row.items()))
    way = f"{a.rendered} frames forth and back" if passes > 1 else "one way"
    title = f"{stats['frames']} rendered frames {a.size}, camera {a.motion}, {way}; ATE RMSE {1000 * error:.1f} mm"
    print(title)
    if a.report:
        a.report.parent.mkdir(parents=True, exist_ok=True)
        a.report.with_suffix(".json").write_text(json.dumps({"title": title, "per_500_frames": rows}, indent=1) + "\n")
        a.report.with_suffix(".svg").write_text(draw(rows, title))
    faults = judge(rows, stats, passes)
    for fault in faults:
        print(f"long_run: {fault}", file=sys.stderr)
    return 1 if faults else 0


if __name__ == "__main__":
    sys.exit(main())
