#!/usr/bin/env python3
"""Draws docs/performance.svg from `flashsplat bench --json FILE`: cost of forward + backward against the number of
Gaussians, one line per picture size. Needs nothing but Python.

usage: plot_bench.py BENCH.json OUT.svg
"""
import json
import math
import sys

WIDTH, HEIGHT, LEFT, RIGHT, TOP, BOTTOM = 720, 400, 70, 110, 44, 56
COLOURS = {"300x200": "#2c7fb8", "600x400": "#d95f0e", "1200x800": "#31a354"}
COUNTS = {"10k": 10e3, "50k": 50e3, "200k": 200e3, "500k": 500e3}


def lines_of(cases):
    lines = {}
    for case in cases:
        part = case["name"].split("/")
        if part[0] == "raster" and part[2] in COLOURS:
            lines.setdefault(part[2], []).append((COUNTS[part[1]], case["cpu_ms"]))
    return {size: sorted(points) for size, points in lines.items()}


def main():
    if len(sys.argv) != 3:
        sys.exit(__doc__.strip())
    with open(sys.argv[1], encoding="utf-8") as file:
        data = json.load(file)
    lines = lines_of(data["cases"] if isinstance(data, dict) else data)
    if not lines:
        sys.exit(f"{sys.argv[1]}: no raster/... cases; run `flashsplat bench --json` without --cases")
    values = [ms for points in lines.values() for _, ms in points]
    low, high = math.floor(math.log10(min(values))), math.ceil(math.log10(max(values)))

    def x(n):
        return LEFT + (math.log10(n) - 4) / (math.log10(500e3) - 4) * (WIDTH - LEFT - RIGHT)

    def y(ms):
        return TOP + (high - math.log10(ms)) / (high - low) * (HEIGHT - TOP - BOTTOM)

    out = [f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {WIDTH} {HEIGHT}" font-family="sans-serif" font-size="13">',
           f'<rect width="{WIDTH}" height="{HEIGHT}" fill="white"/>',
           f'<text x="{LEFT}" y="24" font-size="15">Rasteriser, forward + backward: CPU milliseconds, 50 pairs a pixel</text>']
    for power in range(low, high + 1):
        for step in (1, 2, 5):
            ms = step * 10.0 ** power
            if ms > 10.0 ** high:
                break
            out.append(f'<line x1="{LEFT}" x2="{WIDTH - RIGHT}" y1="{y(ms):.1f}" y2="{y(ms):.1f}" stroke="#ddd"/>')
            out.append(f'<text x="{LEFT - 8}" y="{y(ms) + 4:.1f}" text-anchor="end">{ms:g}</text>')
    for name, n in COUNTS.items():
        out.append(f'<line x1="{x(n):.1f}" x2="{x(n):.1f}" y1="{TOP}" y2="{HEIGHT - BOTTOM}" stroke="#ddd"/>')
        out.append(f'<text x="{x(n):.1f}" y="{HEIGHT - BOTTOM + 20}" text-anchor="middle">{name}</text>')
    out.append(f'<text x="{(LEFT + WIDTH - RIGHT) / 2}" y="{HEIGHT - 12}" text-anchor="middle">Gaussians</text>')
    for size, points in lines.items():
        path = " ".join(f"{x(n):.1f},{y(ms):.1f}" for n, ms in points)
        out.append(f'<polyline points="{path}" fill="none" stroke="{COLOURS[size]}" stroke-width="2.5"/>')
        out += [f'<circle cx="{x(n):.1f}" cy="{y(ms):.1f}" r="4" fill="{COLOURS[size]}"/>' for n, ms in points]
        out.append(f'<text x="{x(points[-1][0]) + 10:.1f}" y="{y(points[-1][1]) + 4:.1f}" fill="{COLOURS[size]}">{size}</text>')
    out.append("</svg>")
    with open(sys.argv[2], "w", encoding="utf-8") as file:
        file.write("\n".join(out) + "\n")


if __name__ == "__main__":
    main()
