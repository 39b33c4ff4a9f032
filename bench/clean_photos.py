#!/usr/bin/env python3
"""How near the photos that `export --clean dng` cleaned are to the truth: bench/clean_photos.py CAPTURE OUT

CAPTURE is a made capture (synth), OUT a run on its RAW photos with its poses, rendered (renders/) and exported. At all
photos that have a truth: PSNR of tone-mapped values at full size, one gain a channel for all photos of a lighting, of
the upsampled render (bicubic, of the tone-mapped PNG: 1 dB better than of linear light) and of the cleaned photo. Needs
Debian's python3-numpy and python3-opencv."""
import json
import pathlib
import sys

import cv2
import numpy as np

GAMMA = 0.22


def coded(path):
    return cv2.imread(str(path), cv2.IMREAD_UNCHANGED)[..., ::-1].astype(np.float32) / 255


def render(path, width, height):
    larger = cv2.resize(coded(path), (width, height), interpolation=cv2.INTER_CUBIC)
    return larger.clip(0, 1) ** (1 / GAMMA)


def cleaned(path, width, height, balance):
    values = np.fromfile(path, np.uint16, count=3 * width * height, offset=8)
    return values.reshape(height, width, 3).astype(np.float32) / 65535 * balance


def mean_psnr(pairs):
    over = sum((truth * estimate).sum((0, 1), np.float64) for truth, estimate in pairs)
    gain = (over / sum((estimate ** 2).sum((0, 1), np.float64) for _, estimate in pairs)).astype(np.float32)
    off = [truth.clip(0, 1) ** GAMMA - (estimate * gain).clip(0, 1) ** GAMMA for truth, estimate in pairs]
    return [-10 * np.log10((d.astype(np.float64) ** 2).mean()) for d in off]


def main():
    capture, out = map(pathlib.Path, sys.argv[1:3])
    balance = np.array(json.loads((out / "ingest.json").read_text())["white_balance"], np.float32)
    images = json.loads((capture / "truth/cameras.json").read_text())["images"]
    for layer, flash in (("T_N", False), ("T_F", True)):
        renders, photos, names = [], [], []
        for image in images:
            path = capture / "truth" / layer / (image["name"] + ".png")
            if image["flash"] is not flash or not path.exists():
                continue
            truth = coded(path) ** (1 / GAMMA)
            size = truth.shape[1], truth.shape[0]
            renders.append((truth, render(out / "renders" / layer / path.name, *size)))
            photos.append((truth, cleaned(out / "export/photos" / (image["name"] + ".dng"), *size, balance)))
            names.append(image["name"])
        a, b = mean_psnr(renders), mean_psnr(photos)
        for name, of_render, of_photo in zip(names, a, b):
            print(f"{layer} {name}: render {of_render:.2f}, cleaned {of_photo:.2f}, {of_photo - of_render:+.2f} dB")
        print(f"{layer}: render {np.mean(a):.2f}, cleaned {np.mean(b):.2f}, {np.mean(b) - np.mean(a):+.2f} dB")


main()
