#!/usr/bin/env python3
"""Scores the rendered presets against their exact truth.

  rendered_accuracy.py PROGRAM FOLDER [--frames 300] [--size 640x480] [--people none,walking,sitting]

Renders into FOLDER (what is there already is used again), for each of the camera motions xyz, rpy, halfsphere and static: rooms
without people with the sensor's noise and exact, run in mode orb; rooms with people with the sensor's noise, run in mode full. All
runs are deterministic. Exit code 1 when a frame was not tracked, the ATE RMSE is not below 1 % of the way (with people: or 3 mm),
or, on exact pictures, not below 1 mm."""
import argparse
import json
import math
import pathlib
import subprocess
import sys

MOTIONS = ("xyz", "rpy", "halfsphere", "static")
MAX_SHARE, MAX_EXACT_MM = 0.01, 1.0
MAX_WITH_PEOPLE_MM = 3.0     # a camera that only trembles has no way to speak of


def way_m(file):
    lines = [line.split() for line in file.read_text().splitlines() if line and not line.startswith("#")]
    places = [tuple(map(float, words[1:4])) for words in lines]
    return sum(math.dist(a, b) for a, b in zip(places, places[1:]))


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("program", type=pathlib.Path)
    parser.add_argument("folder", type=pathlib.Path)
    parser.add_argument("--frames", type=int, default=300)
    parser.add_argument("--size", default="640x480")
    parser.add_argument("--people", default="none,walking,sitting")
    a = parser.parse_args()
    program = a.program.resolve()
    a.folder.mkdir(parents=True, exist_ok=True)
    good = True
    print("| people | camera | depth and colour | mode | way, m | ATE RMSE, mm | of the way | tracked |\n|---|---|---|---|---|---|---|---|")
    for people, motion in ((p, m) for p in a.people.split(",") for m in MOTIONS):
        for noise in ("noise", "exact") if people == "none" else ("noise",):
            mode = "orb" if people == "none" else "full"
            name = f"{motion}_{noise}_{a.frames}_{a.size}" if people == "none" else f"{people}_{motion}_{a.frames}_{a.size}"
            sequence, out = a.folder / name, a.folder / (name + "_out")
            if not sequence.exists():
                subprocess.run([program, "render", "--people", people, "--motion", motion, "--frames", str(a.frames), "--size",
                                a.size, "--quiet", "--out", sequence] + ["--exact"] * (noise == "exact"), check=True)
            subprocess.run([program, "run", sequence, "--out", out, "--mode", mode, "--deterministic", "--quiet"], check=True,
                           stdout=subprocess.DEVNULL)
            stats = json.loads((out / "stats.json").read_text())
            error_mm = 1000 * json.loads((out / "evaluation.json").read_text())["estimate"]["ate_m"]["rmse"]
            way = way_m(sequence / "groundtruth.txt")
            share = error_mm / 1000 / way
            accurate = share < MAX_SHARE or (people != "none" and error_mm < MAX_WITH_PEOPLE_MM)
            fine = stats["tracked"] == stats["frames"] and accurate and (noise != "exact" or error_mm < MAX_EXACT_MM)
            good = good and fine
            print(f"| {people} | {motion} | {noise} | {mode} | {way:.3f} | {error_mm:.2f} | {100 * share:.2f} % | "
                  f"{stats['tracked']} of {stats['frames']} |{'' if fine else ' <- too bad'}", flush=True)
    return 0 if good else 1


if __name__ == "__main__":
    sys.exit(main())
