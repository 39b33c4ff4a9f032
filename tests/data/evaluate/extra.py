#!/usr/bin/env python3
"""Writes expected_extra.json: MS-SSIM, the paper's convention and depth errors of the pictures here, in numpy."""
import json
import os

import cv2
import numpy as np

HERE = os.path.dirname(os.path.abspath(__file__))
G = 0.22
VIEWS = ("TEST_01", "TEST_02")


def load(path):
    return cv2.imread(f"{HERE}/{path}.png").astype(float) / 255


def window(a):
    k = cv2.getGaussianKernel(11, 1.5)
    return cv2.filter2D(a, -1, k @ k.T, borderType=cv2.BORDER_REFLECT)[5:-5, 5:-5]


def terms(a, b):
    ma, mb = window(a), window(b)
    va, vb, c = window(a * a) - ma**2, window(b * b) - mb**2, window(a * b) - ma * mb
    cs = (2 * c + 0.03**2) / (va + vb + 0.03**2)
    return ((2 * ma * mb + 1e-4) / (ma**2 + mb**2 + 1e-4) * cs).mean((0, 1)), cs.mean((0, 1))


def halved(x):
    h, w = x.shape[0] // 2, x.shape[1] // 2
    return x[:2 * h, :2 * w].reshape(h, 2, w, 2, 3).mean((1, 3))


def ms_ssim(a, b):
    n, side = 0, min(a.shape[:2])
    while n < 5 and side >= 11:
        n, side = n + 1, side // 2
    weight = np.array([0.0448, 0.2856, 0.3001, 0.2363, 0.1333][:n])
    weight /= weight.sum()
    product = np.ones(3)
    for i in range(n):
        whole, contrast = terms(a, b)
        product *= np.maximum(whole if i == n - 1 else contrast, 0) ** weight[i]
        a, b = halved(a), halved(b)
    return product.mean()


def psnr(a, b):
    return -10 * np.log10(((a - b) ** 2).mean())


def stretched(x):
    return (x - x.min()) / (x.max() - x.min())


def main():
    out = {"T_N": {}}
    pairs = []
    asked = 0
    for v in VIEWS:
        a, b = load(f"truth/T_N/{v}"), load(f"renders/T_N/{v}")
        d = np.maximum(load(f"truth/I_F/{v}") ** (1 / G) - load(f"truth/I_N/{v}") ** (1 / G), 0) ** G
        out["T_N"][v] = {"ms_ssim": ms_ssim(a, b), "psnr_paper": psnr(stretched(d), stretched(b))}
        t, e = [cv2.imread(f"{HERE}/{q}/depth_T/{v}.png", -1).astype(float) / 1000 for q in ("truth", "renders")]
        asked += (t > 0).sum()
        both = (t > 0) & (e > 0)
        pairs.append((t[both], e[both]))
    t, e = [np.concatenate(x) for x in zip(*pairs)]
    scale = np.median(t / e)
    out["depth_T"] = {"median_relative_error": np.median(abs(e - t) / t), "scale": scale,
                      "median_relative_error_scaled": np.median(abs(e * scale - t) / t), "covered": len(t) / asked}
    with open(f"{HERE}/expected_extra.json", "w", encoding="utf-8") as f:
        json.dump(out, f, indent=1)


main()
