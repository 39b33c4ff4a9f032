#!/usr/bin/env python3
"""Made the pictures in this folder: a small truth, and renders with blur, gain, noise, other sizes and a missing view.

expected_<views>.json holds what an independent scorer in numpy and OpenCV says about them (T_N T_F R I_N I_F at
held_out, capture and all views): mean PSNR and SSIM, as they are and after the gain."""
import json
import os
import sys

import cv2
import numpy as np

HERE = os.path.dirname(os.path.abspath(__file__))
rng = np.random.default_rng(5)


def texture(h, w):
    """Smooth blobs and a few hard edges, linear light."""
    a = cv2.resize(rng.random((h // 8, w // 8, 3)), (w, h), interpolation=cv2.INTER_CUBIC) ** 2
    a[h // 3:h // 2, w // 4:w // 2] *= 0.1
    return np.clip(a, 0, 1) * 0.6


def save(path, linear, quality=None):
    os.makedirs(os.path.dirname(path), exist_ok=True)
    encoded = np.round(np.clip(linear, 0, 1) ** 0.22 * 255).astype(np.uint8)
    if not cv2.imwrite(path, encoded, [] if quality is None else [cv2.IMWRITE_JPEG_QUALITY, quality]):
        sys.exit(f"cannot write {path}")


def main():
    h, w = 48, 64
    images = []
    for name, held_out in (("IMG_0001", False), ("TEST_01", True), ("TEST_02", True)):
        images.append({"name": name, "flash": False, "held_out": held_out, "width": w, "height": h, "fx": 70.0,
                       "fy": 70.0, "cx": w / 2, "cy": h / 2, "w2c": np.eye(4).tolist()})
        t, r = texture(h, w), texture(h, w) * 0.5
        alpha = 0.5 + texture(h, w)[..., :1] * 3
        layers = {"T_N": t * 0.4, "T_F": t * 0.4 * (1 + alpha), "R": r}
        if held_out:
            layers["I_N"], layers["I_F"] = layers["T_N"] + r, layers["T_F"] + r
        for layer, linear in layers.items():
            jpeg = layer == "R"
            save(f"{HERE}/truth/{layer}/{name}.{'jpg' if jpeg else 'png'}", linear, 97 if jpeg else None)
            if layer == "I_F" and name == "TEST_02":
                continue  # missing render
            b = cv2.GaussianBlur(linear, (0, 0), 0.8) * np.array([0.7, 1.0, 1.2]) + rng.normal(size=linear.shape) * 0.003
            if layer == "T_F":
                b = cv2.resize(b, (40, 30), interpolation=cv2.INTER_AREA)
            if layer == "R":
                b = cv2.resize(b, (96, 72), interpolation=cv2.INTER_CUBIC)
            save(f"{HERE}/renders/{layer}/{name}.png", b)
        if held_out:
            z = (1000 + 3000 * texture(h, w)[..., 0]).astype(np.uint16)
            z[:4, :4] = 0
            d = (z * 1.02 + rng.normal(size=z.shape) * 20).astype(np.uint16)
            d[:, :2] = 0
            os.makedirs(f"{HERE}/truth/depth_T", exist_ok=True)
            os.makedirs(f"{HERE}/renders/depth_T", exist_ok=True)
            cv2.imwrite(f"{HERE}/truth/depth_T/{name}.png", z)
            cv2.imwrite(f"{HERE}/renders/depth_T/{name}.png", d)
    with open(f"{HERE}/truth/cameras.json", "w", encoding="utf-8") as f:
        json.dump({"images": images}, f, indent=1)


main()
