#!/usr/bin/env python3
"""R where photos saw it clear of people: PSNR in dB, gain-fitted, at the held-out pixels of R that at least --photos
photos show without anyone in the way, and at the others.

CAPTURE: made by `synth --field photographer` (or pedestrian): truth/figures tells where each photo shows people.
REFERENCE, OUT: folders with the renders of held-out views (`render --cameras truth/cameras.json --metres-per-unit 1
--output OUT/held`). REFERENCE is of the same capture without people; the depth of its R tells which photos see a pixel.
"""
import argparse, json, pathlib

import cv2, numpy


def linear(path, size=None):
    light = (cv2.imread(str(path))[:, :, ::-1].astype(numpy.float64) / 255) ** (1 / 0.22)
    return light if size is None else cv2.resize(light, size, interpolation=cv2.INTER_AREA)


def project(camera, points):
    w2c = numpy.array(camera["w2c"])[:3]
    p = points @ w2c[:, :3].T + w2c[:, 3]
    z = numpy.where(p[..., 2] > 0, p[..., 2], numpy.nan)
    return p[..., 0] / z * camera["fx"] + camera["cx"], p[..., 1] / z * camera["fy"] + camera["cy"]


def points_of(camera, depth):
    """World positions (h, w, 3) of a picture's pixels; of depth 0: not finite."""
    h, w = depth.shape
    scale = w / camera["width"]
    y, x = numpy.mgrid[0:h, 0:w]
    depth = numpy.where(depth > 0, depth, numpy.nan)
    p = numpy.stack([((x + 0.5) / scale - camera["cx"]) / camera["fx"] * depth,
                     ((y + 0.5) / scale - camera["cy"]) / camera["fy"] * depth, depth], -1)
    w2c = numpy.array(camera["w2c"])[:3]
    return (p - w2c[:, 3]) @ w2c[:, :3]


def photos_that_see(points, photos, figures):
    n = numpy.zeros(points.shape[:2], int)
    for photo in photos:
        u, v = project(photo, points)
        inside = (u >= 0) & (v >= 0) & (u < photo["width"]) & (v < photo["height"])
        hidden = cv2.imread(str(figures / f"{photo['name']}.png"), cv2.IMREAD_GRAYSCALE) > 0
        scale = hidden.shape[1] / photo["width"]
        at = [numpy.clip(numpy.nan_to_num(x * scale).astype(int), 0, most - 1) for x, most in zip((v, u), hidden.shape)]
        n += inside & ~hidden[at[0], at[1]]
    return n


def psnr(capture, out, cameras, clear):
    pairs = []
    for camera in cameras:
        guess = linear(out / "held" / "R" / f"{camera['name']}.png")
        pairs.append((guess, linear(capture / "truth" / "R" / f"{camera['name']}.png", guess.shape[1::-1])))
    gain = sum((g * t).sum((0, 1)) for g, t in pairs) / sum((g * g).sum((0, 1)) for g, t in pairs)
    errors = [((numpy.clip(g * gain, 0, 1) ** 0.22 - numpy.clip(t, 0, 1) ** 0.22) ** 2).mean(-1) for g, t in pairs]
    for wanted in (True, False):
        of = numpy.concatenate([e[c == wanted] for e, c in zip(errors, clear)])
        yield -10 * numpy.log10(of.mean()) if of.size else numpy.nan


def main():
    p = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    p.add_argument("capture", type=pathlib.Path)
    p.add_argument("reference", type=pathlib.Path)
    p.add_argument("out", type=pathlib.Path, nargs="*")
    p.add_argument("--photos", type=int, default=5)
    args = p.parse_args()
    cameras = json.loads((args.capture / "truth" / "cameras.json").read_text())["images"]
    held, photos = [c for c in cameras if c["held_out"]], [c for c in cameras if not c["held_out"]]
    clear = []
    for camera in held:
        depth = cv2.imread(str(args.reference / "held" / "depth_R" / f"{camera['name']}.png"), cv2.IMREAD_UNCHANGED)
        seen = photos_that_see(points_of(camera, depth / 1000), photos, args.capture / "truth" / "figures")
        clear.append(seen >= args.photos)
    print(f"{100 * numpy.mean([c.mean() for c in clear]):.1f} % of the pixels are seen clear by {args.photos} photos or more")
    for out in [args.reference, *args.out]:
        print("{}: R {:.2f} dB there, {:.2f} dB elsewhere".format(out, *psnr(args.capture, out, held, clear)))


if __name__ == "__main__":
    main()
