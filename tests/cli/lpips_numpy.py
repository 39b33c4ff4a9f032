#!/usr/bin/env python3
"""LPIPS in numpy, written apart from the program's, and made-up weights; run alone, it prints what test_lpips.c expects."""
import pathlib
import sys

import numpy as np

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[2] / "tools"))
import lpips_convert  # noqa: E402  the networks' shapes

# Per network: max pooling before a convolution, its stride and padding, and the convolutions whose features count.
POOL = {"alex": {1: 3, 2: 3}, "vgg": {2: 2, 4: 2, 7: 2, 10: 2}}
STRIDE = {"alex": {0: 4}, "vgg": {}}
PAD = {"alex": [2, 2, 1, 1, 1], "vgg": [1] * 13}
TAPS = {"alex": [0, 1, 2, 3, 4], "vgg": [1, 3, 6, 9, 12]}


def hashed(n, seed, scale):
    """n numbers in -scale .. scale that a few lines of C make as well."""
    i = np.arange(n, dtype=np.uint64) + np.uint64(seed) * np.uint64(1000003)
    x = (i * np.uint64(2654435761)) & np.uint64(0xFFFFFFFF)
    x ^= x >> np.uint64(15)
    x = (x * np.uint64(2246822519)) & np.uint64(0xFFFFFFFF)
    return (((x >> np.uint64(8)).astype(np.float64) / 2**24 - 0.5) * 2 * scale).astype(np.float32)


def made_up(net):
    """[(weight, bias)], [lin]: of a size that keeps the features alive."""
    convs = []
    for i, (_, n_out, n_in, k) in enumerate(lpips_convert.NETS[net]):
        scale = float(np.float32(2.0 / np.sqrt(n_in * k * k)))
        convs.append((hashed(n_out * n_in * k * k, 2 * i + 1, scale).reshape(n_out, n_in, k, k),
                      hashed(n_out, 2 * i + 2, 0.1)))
    return convs, [np.abs(hashed(n, 100 + i, 1.0)) for i, n in enumerate(lpips_convert.LINS[net])]


def features(net, convs, x):
    out = []
    for i, (weight, bias) in enumerate(convs):
        if i in POOL[net]:
            size = POOL[net][i]
            x = np.lib.stride_tricks.sliding_window_view(x, (size, size), (1, 2))[:, ::2, ::2].max((3, 4))
        pad, stride, k = PAD[net][i], STRIDE[net].get(i, 1), weight.shape[2]
        x = np.pad(x, ((0, 0), (pad, pad), (pad, pad)))
        patches = np.lib.stride_tricks.sliding_window_view(x, (k, k), (1, 2))[:, ::stride, ::stride]
        x = np.einsum("chwij,ocij->ohw", patches, weight.astype(np.float64), optimize=True)
        x = np.maximum(x + bias[:, None, None], 0)
        if i in TAPS[net]:
            out.append(x / (np.sqrt((x**2).sum(0)) + 1e-10))
    return out


def distance(net, weights, a, b):
    """a, b: (height, width, 3), 0..1."""
    shift, scale = np.array([-0.030, -0.088, -0.188]), np.array([0.458, 0.448, 0.450])
    convs, lins = weights
    fa, fb = (features(net, convs, ((2 * p - 1 - shift) / scale).transpose(2, 0, 1)) for p in (a, b))
    return sum(((x - y) ** 2 * lin[:, None, None]).sum(0).mean() for x, y, lin in zip(fa, fb, lins))


def main():
    a = hashed(52 * 37 * 3, 201, 0.5).reshape(37, 52, 3).astype(float) + 0.5
    b = hashed(52 * 37 * 3, 202, 0.5).reshape(37, 52, 3).astype(float) * 0.5 + 0.5
    for net in ("alex", "vgg"):
        print(net, repr(float(distance(net, made_up(net), a, b))))


if __name__ == "__main__":
    main()
