#!/usr/bin/env python3
"""Runs recordings in several modes and prints what each mode is worth.

  ablation.py PROGRAM OUT SEQUENCE... [--modes orb,masks,full] [--runs 5] [--set key=value]...

Every SEQUENCE (a folder with groundtruth.txt) is run in every mode, RUNS times, threaded. Writes OUT/ablation.md (also printed) and
OUT/ablation.json: ATE RMSE as median and range, frames lost, runs that did not end well, time of the tracking stage, frames per
second. Where a sequence has a folder mask/ with the true instances: the share of the features kept that lie on moving things, and
the share of the features on the static scene that are dropped or may not enter the map. Exit code 1 when a run failed."""
import argparse
import json
import pathlib
import statistics
import subprocess
import sys
import time

MODES = "orb,boxes,masks,masks+repair,masks+motion,motion,full"


def run_once(program, sequence, mode, out, extra):
    command = [program, "run", sequence, "--mode", mode, "--out", out, "--quiet", *extra]
    if any((sequence / "mask").glob("*.png")):
        command += ["--truth-masks", "mask"]
    done = subprocess.run(command, stdout=subprocess.DEVNULL, stderr=subprocess.PIPE, text=True)
    if done.returncode != 0:
        return {"failed": f"exit code {done.returncode}: {done.stderr.strip()[-300:]}"}
    stats = json.loads((out / "stats.json").read_text())
    ate_m = json.loads((out / "evaluation.json").read_text())["estimate"]["ate_m"]["rmse"]
    return {"ate_m": ate_m, "frames": stats["frames"], "tracked": stats["tracked"], "lost": stats["lost"],
            "tracking_ms": stats["stages_ms"]["tracking"]["mean"], "frames_per_s": stats["frames_per_s"],
            "notices": stats["notices"], "truth": stats.get("truth")}


TRUTH = ("kept_on_moving", "tracked_on_moving", "static_dropped", "clear_static_dropped", "static_barred")


def summarise(runs):
    good = [r for r in runs if "failed" not in r]
    if not good:
        return {"runs": len(runs), "failed": len(runs)}
    errors = sorted(r["ate_m"] for r in good)
    summary = {"runs": len(runs), "failed": len(runs) - len(good), "ate_m_median": statistics.median(errors), "ate_m_min": errors[0],
               "ate_m_max": errors[-1], "lost": max(r["lost"] for r in good),
               "tracking_ms": statistics.median(r["tracking_ms"] for r in good),
               "frames_per_s": statistics.median(r["frames_per_s"] for r in good)}
    for key in TRUTH:
        values = [r["truth"][key] for r in good if r["truth"]]
        if values:
            summary[key] = statistics.median(values)
    return summary


def row(sequence, mode, s):
    if "ate_m_median" not in s:
        return f"| {sequence} | {mode} | all {s['runs']} runs failed | | | | |"
    truth = " / ".join(f"{100 * s[k]:.1f}" if k in s else "-" for k in TRUTH)
    return (f"| {sequence} | {mode} | {1000 * s['ate_m_median']:.1f} ({1000 * s['ate_m_min']:.1f}-{1000 * s['ate_m_max']:.1f}) | "
            f"{s['lost']} | {truth} | {s['tracking_ms']:.1f} | {s['frames_per_s']:.0f} |"
            + (f" {s['failed']} runs failed" if s["failed"] else ""))


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("program", type=pathlib.Path)
    parser.add_argument("out", type=pathlib.Path)
    parser.add_argument("sequences", type=pathlib.Path, nargs="+")
    parser.add_argument("--modes", default=MODES)
    parser.add_argument("--runs", type=int, default=5)
    parser.add_argument("--set", action="append", default=[], help="passed on to every run")
    a = parser.parse_args()
    a.out.mkdir(parents=True, exist_ok=True)
    extra = [word for value in a.set for word in ("--set", value)]
    lines = ["| sequence | mode | ATE RMSE, mm: median (range) | lost | on moving things: kept / tracked, static: dropped / clear of outlines / barred from the map, % | tracking, ms | frames/s |",
             "|---|---|---|---|---|---|---|"]
    print("\n".join(lines), flush=True)
    result, start = {}, time.time()
    for sequence in a.sequences:
        for mode in a.modes.split(","):
            runs = [run_once(a.program.resolve(), sequence, mode, a.out / f"{sequence.name}_{mode}_{i}", extra) for i in range(a.runs)]
            summary = summarise(runs)
            result.setdefault(sequence.name, {})[mode] = {"summary": summary, "runs": runs}
            lines.append(row(sequence.name, mode, summary))
            print(lines[-1], flush=True)
            (a.out / "ablation.md").write_text("\n".join(lines) + "\n")
            (a.out / "ablation.json").write_text(json.dumps(result, indent=1) + "\n")
    failed = sum(m["summary"]["failed"] for modes in result.values() for m in modes.values())
    print(f"{sum(m['summary']['runs'] for s in result.values() for m in s.values())} runs, {failed} failed, {time.time() - start:.0f} s")
    return 1 if failed else 0


if __name__ == "__main__":
    sys.exit(main())
