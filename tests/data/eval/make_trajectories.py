#!/usr/bin/env python3
"""Writes the synthetic trajectories beside this file: a known path, and estimates of it with noise, drift, gaps, another
frame of reference, another scale and time stamps of their own. Numbers are fixed by the seed; needs numpy."""
import pathlib

import numpy as np

HERE = pathlib.Path(__file__).parent


def quaternion(axis_angle):
    angle = np.linalg.norm(axis_angle)
    axis = axis_angle / angle if angle > 0 else np.array([1.0, 0, 0])
    return np.append(axis * np.sin(angle / 2), np.cos(angle / 2))  # x y z w


def product(a, b):
    ax, ay, az, aw = a
    bx, by, bz, bw = b
    return np.array([aw * bx + ax * bw + ay * bz - az * by, aw * by - ax * bz + ay * bw + az * bx,
                     aw * bz + ax * by - ay * bx + az * bw, aw * bw - ax * bx - ay * by - az * bz])


def rotate(q, v):
    return product(product(q, np.append(v, 0)), q * np.array([-1, -1, -1, 1]))[:3]


def write(name, poses):
    lines = ["# timestamp tx ty tz qx qy qz qw"]
    lines += [f"{t:.6f} " + " ".join(f"{v:.7f}" for v in [*p, *q]) for t, p, q in poses]
    (HERE / name).write_text("\n".join(lines) + "\n")


def main():
    rng = np.random.default_rng(7)
    start = 1305031102.175304
    position = lambda s: np.array([1.5 * np.sin(0.9 * s), 1.1 * np.cos(0.6 * s), 0.4 * np.sin(1.7 * s) + 0.05 * s])
    attitude = lambda s: quaternion(np.array([0.5 * np.sin(0.7 * s), 0.9 * np.sin(0.4 * s + 1), 0.3 * s]))
    truth = [(start + k * 0.01, position(k * 0.01), attitude(k * 0.01)) for k in range(800)]
    write("truth.txt", truth)

    turn, shift = quaternion(np.array([0.3, -1.2, 2.0])), np.array([4.0, -2.0, 0.7])
    for name, scale, drift, every in [("estimate.txt", 1.0, 0.0, 1), ("drifting.txt", 1.0, 0.02, 1), ("scaleless.txt", 0.37, 0.0, 5)]:
        poses = []
        for k in range(0, 240, every):
            if name != "scaleless.txt" and 100 <= k < 130:
                continue  # tracking was lost for a second
            s = k / 30 + rng.uniform(-0.004, 0.004)
            noise = rng.normal(0, 0.01, 3) + drift * s
            p = scale * rotate(turn, position(s) + noise - shift)
            q = product(turn, product(attitude(s), quaternion(rng.normal(0, 0.006, 3))))
            poses.append((start + s, p, q))
        write(name, poses)


if __name__ == "__main__":
    main()
