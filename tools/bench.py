#!/usr/bin/env python3
"""Runs the benchmarks of what a frame costs and prints their shares of the whole.

  bench.py BUILD_FOLDER [--sequence FOLDER] [--seconds 0.5]

BUILD_FOLDER/bin must hold data_bench, feature_bench and solve_bench (preset release: ninja data_bench feature_bench solve_bench).
With a recording its own pictures are decoded (else made-up ones), and the program, where it is built, is run on it once: it
tells how often a key frame comes (else one in nine frames), and its own stages are printed beside. Times are processor time of
one thread; compare them on an idle machine."""
import argparse
import json
import os
import pathlib
import subprocess
import sys
import tempfile

# What a frame consists of: (name, program, benchmark, how often per frame; "key" = per key frame).
PARTS = [
    ("decoding, colour (JPEG to grey)", "data_bench", "jpeg_gray_ours", 1),
    ("decoding, depth (16-bit PNG)", "data_bench", "png_depth_ours", 1),
    ("extraction, 1000 features", "feature_bench", "extract/1000", 1),
    ("matching, last frame, 1000 points", "feature_bench", "match_projected_1000_features/1000", 1),
    ("matching, local map, 3000 points", "feature_bench", "match_projected_1000_features/3000", 1),
    ("pose optimisation, 700 points", "solve_bench", "bm_optimize_pose/700", 2),
    ("local bundle adjustment, 12 + 12 key frames", "solve_bench", "bm_adjust_bundle/24/12/1600", "key"),
]
TO_MS = {"ns": 1e-6, "us": 1e-3, "ms": 1.0, "s": 1e3}


def processor():
    for line in pathlib.Path("/proc/cpuinfo").read_text().splitlines():
        if line.startswith("model name"):
            return f"{line.split(':', 1)[1].strip()}, {os.cpu_count()} processors, load {os.getloadavg()[0]:.1f}"
    return f"{os.cpu_count()} processors, load {os.getloadavg()[0]:.1f}"


def times_ms(program, names, seconds, environment):
    """Median processor time of each benchmark, from five repetitions."""
    command = [program, "--benchmark_filter=^(" + "|".join(names) + ")$", "--benchmark_format=json", "--benchmark_repetitions=5",
               f"--benchmark_min_time={seconds / 5}", "--benchmark_report_aggregates_only=true"]
    done = subprocess.run(command, stdout=subprocess.PIPE, stderr=subprocess.DEVNULL, env=environment, check=True)
    found = json.loads(done.stdout)["benchmarks"]
    return {b["run_name"]: b["cpu_time"] * TO_MS[b["time_unit"]] for b in found if b["aggregate_name"] == "median"}


def run_statistics(program, sequence):
    with tempfile.TemporaryDirectory() as out:
        subprocess.run([program, "run", sequence, "--out", out, "--mode", "orb", "--quiet"], check=True, stdout=subprocess.DEVNULL)
        return json.loads((pathlib.Path(out) / "stats.json").read_text())


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("build", type=pathlib.Path)
    parser.add_argument("--sequence", type=pathlib.Path)
    parser.add_argument("--seconds", type=float, default=0.5, help="for each benchmark")
    a = parser.parse_args()
    folder = (a.build / "bin").resolve()
    environment = dict(os.environ)
    if a.sequence:
        environment["SEMVSLAM_BENCH_SEQUENCE"] = str(a.sequence)
    measured = {}
    for program in sorted({part[1] for part in PARTS}):
        if not (folder / program).exists():
            raise SystemExit(f"bench: {folder / program} is not built")
        measured.update(times_ms(folder / program, [part[2] for part in PARTS if part[1] == program], a.seconds, environment))
    stats = run_statistics(folder / "semvslam", a.sequence) if a.sequence and (folder / "semvslam").exists() else None
    per_frame = stats["stages_ms"]["mapping"]["count"] / stats["frames"] if stats else 1 / 9
    rows = [(name, measured[bench], per_frame if times == "key" else times) for name, _, bench, times in PARTS]
    whole = sum(ms * times for _, ms, times in rows)
    print(f"{processor()}\n\n| part | ms | per frame | share |\n|---|---|---|---|")
    for name, ms, times in rows:
        print(f"| {name} | {ms:.2f} | {times:.3g} | {100 * ms * times / whole:.0f} % |")
    print(f"| all of it | | {whole:.2f} ms | 100 % |")
    if stats:
        print(f"\nThe program itself, {stats['frames']} frames: {stats['cpu_ms_per_frame']:.1f} ms of processor time per frame; stages, "
              "wall clock:\n\n| stage | mean, ms | per frame, ms |\n|---|---|---|")
        for name, s in stats["stages_ms"].items():
            print(f"| {name} | {s['mean']:.2f} | {s['mean'] * s['count'] / stats['frames']:.2f} |")
    return 0


if __name__ == "__main__":
    sys.exit(main())
