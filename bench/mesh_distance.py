#!/usr/bin/env python3
"""How far the vertices of a mesh are from the true surface, and how much of that they cover:
bench/mesh_distance.py MESH.ply TRUTH

TRUTH is that of a made or rendered capture (cameras.json, depth_T/*.png in millimetres), MESH of a run with its poses.
A vertex's distance is the least along the rays of the views that see its place. Covered is a place of the surface, one
of 150 across a view, with a vertex there or beside it that is within 3 % of its depth. Needs Debian's python3-numpy and
python3-opencv."""
import json
import pathlib
import sys

import cv2
import numpy as np


def read_vertices(path):
    data = pathlib.Path(path).read_bytes()
    header, body = data.split(b"end_header\n", 1)
    count = int(header.split(b"element vertex ")[1].split()[0])
    row = np.dtype([("xyz", "<f4", 3), ("rgb", "u1", 3)])
    return np.frombuffer(body, row, count)["xyz"].astype(float)


def cover(depth, x, y, z):
    """Which places of a view's surface have a vertex: those at pixels x, y, in depth z."""
    width = 150
    height = round(width * depth.shape[0] / depth.shape[1])
    true = cv2.resize(depth, (width, height), interpolation=cv2.INTER_NEAREST)
    column, row = (x * width / depth.shape[1]).astype(int), (y * height / depth.shape[0]).astype(int)
    there = np.zeros((height, width), bool)
    for dy in (-1, 0, 1):
        for dx in (-1, 0, 1):
            i, j = np.clip(row + dy, 0, height - 1), np.clip(column + dx, 0, width - 1)
            near = np.abs(z - true[i, j]) < 0.03 * true[i, j]
            there[i[near], j[near]] = True
    return there[true > 0]


def main():
    mesh, truth = sys.argv[1], pathlib.Path(sys.argv[2])
    xyz = read_vertices(mesh)
    nearest = np.full(len(xyz), np.inf)
    places = covered = 0
    for view in json.loads((truth / "cameras.json").read_text())["images"]:
        path = truth / "depth_T" / (view["name"] + ".png")
        if not path.exists():
            continue
        depth = cv2.imread(str(path), cv2.IMREAD_UNCHANGED).astype(float) / 1000
        w2c = np.array(view["w2c"])
        at = xyz @ w2c[:3, :3].T + w2c[:3, 3]
        z = np.maximum(at[:, 2], 1e-9)
        x = (view["fx"] * at[:, 0] / z + view["cx"]) * depth.shape[1] / view["width"]
        y = (view["fy"] * at[:, 1] / z + view["cy"]) * depth.shape[0] / view["height"]
        inside = (at[:, 2] > 0) & (x >= 0) & (y >= 0) & (x < depth.shape[1]) & (y < depth.shape[0])
        seen = depth[y[inside].astype(int), x[inside].astype(int)]
        off = np.where(seen > 0, np.abs(seen - at[inside, 2]), np.inf)
        nearest[inside] = np.minimum(nearest[inside], off)
        there = cover(depth, x[inside], y[inside], at[inside, 2])
        places += there.size
        covered += there.sum()
    known = nearest[np.isfinite(nearest)]
    print(f"{len(xyz)} vertices, {len(known)} in view of the truth: distance median {np.median(known):.4f}, "
          f"90 % under {np.percentile(known, 90):.4f}, mean {known.mean():.4f} metres; "
          f"{100 * covered / places:.1f} % of the surface covered")


if __name__ == "__main__":
    main()
