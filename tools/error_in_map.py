#!/usr/bin/env python3
"""How far a localised run is off in the world of its map: aligned as the run that made the map is, and not anew. The ground truths
of both recordings must be in one world.

  error_in_map.py MAP_GROUND_TRUTH MAP_TRAJECTORY GROUND_TRUTH TRAJECTORY     TUM files; stamps that differ by less than 1 ms are one"""
import math
import sys


def read(path):
    """Milliseconds -> position."""
    with open(path, encoding="utf-8") as file:
        rows = [list(map(float, line.split())) for line in file if line.strip() and not line.startswith("#")]
    return {round(1e3 * row[0]): row[1:4] for row in rows}


def dot(a, b):
    return sum(x * y for x, y in zip(a, b))


def mean(points):
    return [sum(p[k] for p in points) / len(points) for k in range(3)]


def rotation_of(w, x, y, z):
    return [[1 - 2 * (y * y + z * z), 2 * (x * y - z * w), 2 * (x * z + y * w)],
            [2 * (x * y + z * w), 1 - 2 * (x * x + z * z), 2 * (y * z - x * w)],
            [2 * (x * z - y * w), 2 * (y * z + x * w), 1 - 2 * (x * x + y * y)]]


def align(pairs):
    """Rotation and translation that take the first of each pair nearest to the second (Horn 1987, by quaternions)."""
    from_mean, to_mean = mean([a for a, _ in pairs]), mean([b for _, b in pairs])
    s = [[sum((a[i] - from_mean[i]) * (b[j] - to_mean[j]) for a, b in pairs) for j in range(3)] for i in range(3)]
    trace = s[0][0] + s[1][1] + s[2][2]
    delta = [s[1][2] - s[2][1], s[2][0] - s[0][2], s[0][1] - s[1][0]]
    matrix = [[trace, *delta]] + [[delta[i], *(s[i][j] + s[j][i] - (trace if i == j else 0) for j in range(3))] for i in range(3)]
    shift = max(sum(map(abs, row)) for row in matrix)  # then the largest eigenvalue is the largest in size too
    quaternion = [1.0, 0.1, 0.2, 0.3]
    for _ in range(5000):
        quaternion = [dot(row, quaternion) + shift * q for row, q in zip(matrix, quaternion)]
        size = math.sqrt(dot(quaternion, quaternion))
        quaternion = [q / size for q in quaternion]
    rotation = rotation_of(*quaternion)
    return rotation, [to_mean[k] - dot(rotation[k], from_mean) for k in range(3)]


def main():
    if len(sys.argv) != 5:
        print(__doc__, file=sys.stderr)
        return 2
    map_truth, map_poses, truth, poses = map(read, sys.argv[1:])
    pairs = [(p, map_truth[t]) for t, p in map_poses.items() if t in map_truth]
    found = [(p, truth[t]) for t, p in poses.items() if t in truth]
    if len(pairs) < 3 or not found:
        print("error_in_map: trajectory and ground truth have no stamps in common", file=sys.stderr)
        return 1
    rotation, translation = align(pairs)
    errors = sorted(math.dist([dot(rotation[k], p) + translation[k] for k in range(3)], q) for p, q in found)
    rmse = math.sqrt(dot(errors, errors) / len(errors))
    print(f"{len(errors)} poses in the map's world: RMSE {1e3 * rmse:.1f} mm, median {1e3 * errors[len(errors) // 2]:.1f}, "
          f"largest {1e3 * errors[-1]:.1f}")
    return 0


if __name__ == "__main__":
    sys.exit(main())
