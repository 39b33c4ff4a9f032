#!/usr/bin/env python3
"""Draws how good each layer gets by how many seconds, from the curve.json of `bench/quality.py --curve`: PSNR and MS-SSIM
(gain-fitted, means over the scenes), one line per layer; further variants are dashed. Needs nothing but Python.

usage: plot_curve.py CURVE.json OUT.svg
"""
import json
import math
import sys

WIDTH, HEIGHT, LEFT, GAP, RIGHT, TOP, BOTTOM = 960, 400, 60, 130, 80, 44, 56
PANEL = (WIDTH - LEFT - GAP - RIGHT) / 2
COLOURS = {"T_N": "#2c7fb8", "R": "#d95f0e", "I_N": "#31a354", "I_F": "#756bb1"}
PANELS = (("PSNR, dB", 0, 1), ("MS-SSIM", 2, 0.01))  # title, which of a layer's figures, least distance of grid lines
DASHES = ("none", "7 4", "2 3", "10 3 2 3")


def grid_step(low, high, least):
    return next(s for s in (least * k * 10 ** e for e in range(6) for k in (1, 2, 5)) if (high - low) / s <= 8)


def panel(rows, left, title, figure, least):
    lines = {}
    for row in rows:
        for layer in COLOURS:
            if row["layers"].get(layer) and math.isfinite(row["layers"][layer][figure]):
                lines.setdefault((row["variant"], layer), []).append((row["seconds"], row["layers"][layer][figure]))
    seconds = [row["seconds"] for row in rows]
    values = [v for points in lines.values() for _, v in points]
    out = [f'<text x="{left:.1f}" y="24" font-size="15">{title}</text>']
    if not values:
        return out
    first, last = min(seconds) / 1.1, max(seconds) * 1.1
    step = grid_step(min(values), max(values), least)
    low, high = math.floor(min(values) / step) * step, (math.floor(max(values) / step) + 1) * step

    def x(s):
        return left + math.log(s / first) / math.log(last / first) * PANEL

    def y(v):
        return TOP + (high - v) / (high - low) * (HEIGHT - TOP - BOTTOM)

    for k in range(round((high - low) / step) + 1):
        v = low + k * step
        out.append(f'<line x1="{left:.1f}" x2="{left + PANEL:.1f}" y1="{y(v):.1f}" y2="{y(v):.1f}" stroke="#ddd"/>')
        out.append(f'<text x="{left - 8:.1f}" y="{y(v) + 4:.1f}" text-anchor="end">{v:.6g}</text>')
    for s in sorted({k * 10 ** e for e in range(7) for k in (1, 2, 5)}):
        if first <= s <= last:
            out.append(f'<line x1="{x(s):.1f}" x2="{x(s):.1f}" y1="{TOP}" y2="{HEIGHT - BOTTOM}" stroke="#ddd"/>')
            out.append(f'<text x="{x(s):.1f}" y="{HEIGHT - BOTTOM + 20}" text-anchor="middle">{s}</text>')
    out.append(f'<text x="{left + PANEL / 2:.1f}" y="{HEIGHT - 12}" text-anchor="middle">seconds from the photos to the clouds</text>')
    variants, labels = list(dict.fromkeys(row["variant"] for row in rows)), []
    for (variant, layer), points in lines.items():
        path = " ".join(f"{x(s):.1f},{y(v):.1f}" for s, v in points)
        dash = DASHES[variants.index(variant) % len(DASHES)]
        out.append(f'<polyline points="{path}" fill="none" stroke="{COLOURS[layer]}" stroke-width="2.5" stroke-dasharray="{dash}"/>')
        out += [f'<circle cx="{x(s):.1f}" cy="{y(v):.1f}" r="4" fill="{COLOURS[layer]}"/>' for s, v in points]
        name = layer if variant == variants[0] else f"{layer} {variant}"
        labels.append((y(points[-1][1]) + 4, x(points[-1][0]) + 10, name, COLOURS[layer]))
    below = 0
    for at, right, name, colour in sorted(labels):  # not one over the other
        below = max(at, below + 14)
        out.append(f'<text x="{right:.1f}" y="{below:.1f}" fill="{colour}">{name}</text>')
    return out


def main():
    if len(sys.argv) != 3:
        sys.exit(__doc__.strip())
    with open(sys.argv[1], encoding="utf-8") as file:
        rows = [row for row in json.load(file) if row["scene"].startswith("mean of")]
    if not rows:
        sys.exit(f"{sys.argv[1]}: no means; make it with bench/quality.py --curve")
    out = [f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {WIDTH} {HEIGHT}" font-family="sans-serif" font-size="13">',
           f'<rect width="{WIDTH}" height="{HEIGHT}" fill="white"/>']
    for i, (title, figure, least) in enumerate(PANELS):
        out += panel(rows, LEFT + i * (PANEL + GAP), title, figure, least)
    out.append("</svg>")
    with open(sys.argv[2], "w", encoding="utf-8") as file:
        file.write("\n".join(out) + "\n")


if __name__ == "__main__":
    main()
