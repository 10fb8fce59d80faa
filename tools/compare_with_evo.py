#!/usr/bin/env python3
"""Compares `semvslam eval` with evo (pip install evo) on the same files, or records evo's numbers for the unit tests.

  compare_with_evo.py --program build/release/bin/semvslam CASES.json...   exit code 1 on a difference above 1e-6
  compare_with_evo.py --write CASES.json...                                refreshes the "expected" parts

A cases file holds {"folder": ..., "cases": [{"truth", "estimate", "scale", "delta_frames", "overlapping", "expected"}]};
the folder is relative to the repository root. Where it is absent the file is skipped with a line that says so.

evo's counterparts:   semvslam eval GT EST              evo_ape tum GT EST -a --t_max_diff 0.02
                      semvslam eval GT EST --scale      evo_ape tum GT EST -as --t_max_diff 0.02
                      --delta Nf                        evo_rpe tum GT EST --delta N --delta_unit f --all_pairs --t_max_diff 0.02
                      --delta Nf --consecutive          the same without --all_pairs
                      (deg)                             -r angle_deg
evo has no step in seconds."""
import argparse
import importlib.util
import json
import pathlib
import subprocess
import sys

ROOT = pathlib.Path(__file__).resolve().parent.parent
NAMES = {"rmse": "rmse", "mean": "mean", "median": "median", "sd": "std", "min": "min", "max": "max"}
TOLERANCE = 1e-6


def evo_numbers(truth_file, estimate_file, case):
    from evo.core import metrics, sync
    from evo.core.units import Unit
    from evo.tools import file_interface

    truth = file_interface.read_tum_trajectory_file(str(truth_file))
    estimate = file_interface.read_tum_trajectory_file(str(estimate_file))
    truth, estimate = sync.associate_trajectories(truth, estimate, max_diff=0.02)
    estimate.align(truth, correct_scale=case["scale"])

    def statistics(metric):
        metric.process_data((truth, estimate))
        all_values = metric.get_all_statistics()
        return {ours: float(all_values[theirs]) for ours, theirs in NAMES.items()}

    def relative(relation):
        return metrics.RPE(relation, case["delta_frames"], Unit.frames, all_pairs=case["overlapping"])

    return {"paired": truth.num_poses,
            "ate_m": statistics(metrics.APE(metrics.PoseRelation.translation_part)),
            "rpe_translation_m": statistics(relative(metrics.PoseRelation.translation_part)),
            "rpe_rotation_deg": statistics(relative(metrics.PoseRelation.rotation_angle_deg))}


def our_numbers(program, truth_file, estimate_file, case):
    command = [program, "eval", truth_file, estimate_file, "--json", "-", "--delta", f"{case['delta_frames']}f"]
    command += ["--scale"] * case["scale"] + ["--consecutive"] * (not case["overlapping"])
    return json.loads(subprocess.run(command, check=True, stdout=subprocess.PIPE).stdout)["estimate"]


def differences(ours, theirs):
    if ours["paired"] != theirs["paired"]:
        yield f"paired {ours['paired']}, evo {theirs['paired']}"
    for group in ("ate_m", "rpe_translation_m", "rpe_rotation_deg"):
        for name in NAMES:
            if not abs(ours[group][name] - theirs[group][name]) <= TOLERANCE:
                yield f"{group} {name} {ours[group][name]:.9f}, evo {theirs[group][name]:.9f}"


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("files", nargs="+", type=pathlib.Path)
    parser.add_argument("--program")
    parser.add_argument("--write", action="store_true")
    args = parser.parse_args()
    if not args.program and not args.write:
        parser.error("one of --program and --write is needed")
    if importlib.util.find_spec("evo") is None:
        print("skipped: evo is not installed (pip install evo)")
        return 77
    checked = failed = skipped = 0
    for file in args.files:
        content = json.loads(file.read_text())
        folder = ROOT / content["folder"]
        if not folder.is_dir():
            print(f"skipped {file.name}: its trajectories are not here ({content['folder']})")
            skipped += len(content["cases"])
            continue
        for case in content["cases"]:
            truth, estimate = folder / case["truth"], folder / case["estimate"]
            theirs = evo_numbers(truth, estimate, case)
            checked += 1
            if args.write:
                case["expected"] = theirs
                continue
            faults = list(differences(our_numbers(args.program, truth, estimate, case), theirs))
            failed += bool(faults)
            for fault in faults:
                print(f"{case['estimate']} delta {case['delta_frames']}f scale {case['scale']}: {fault}")
        if args.write:
            file.write_text(json.dumps(content, indent=1) + "\n")
    print(f"{checked - failed} passed, {failed} failed, {skipped} skipped")
    return 1 if failed else 0


if __name__ == "__main__":
    sys.exit(main())
