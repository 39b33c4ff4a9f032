"""Folders of photos as Flash-Splat's authors and NeRFReN's published theirs, made of a capture of `synth`."""
import json
import pathlib
import struct
import subprocess
import tempfile

import cv2
import numpy

BLACK, WHITE = 2045, 15092
GAMMA = 0.22


def linear_photos(program, capture):
    """name -> (flash, camera values as shares of full, height x width x 3 RGB), and the gains of white balance."""
    with tempfile.TemporaryDirectory(prefix="flashsplat-authors-") as out:
        subprocess.run([program, "ingest", capture / "capture/raw", "-o", out, "--long-edge", "0"], check=True,
                       capture_output=True)
        told = json.loads((pathlib.Path(out) / "ingest.json").read_text())
        photos = {}
        for p in told["photos"]:
            tiff = cv2.imread(f"{out}/linear/{p['name']}.tif", cv2.IMREAD_UNCHANGED)
            photos[p["name"]] = (p["flash"], tiff[:, :, ::-1] / numpy.array(told["white_balance"]))
    return photos, told["white_balance"]


def new_name(name, flash):
    return f"{name}_{'flash' if flash else 'noflash'}"


def poses_of(sparse):
    """name without extension -> (quaternion w x y z, t), and the camera's numbers, of a COLMAP text model."""
    lines = [l for l in (sparse / "images.txt").read_text().splitlines() if not l.startswith("#")]
    poses = {}
    for line in lines[::2]:
        word = line.split()
        poses[pathlib.Path(word[9]).stem] = [float(v) for v in word[1:8]]
    camera = [l for l in (sparse / "cameras.txt").read_text().splitlines() if not l.startswith("#")][0].split()
    return poses, [float(v) for v in camera[2:]]


def write_binary_model(folder, images, camera):
    """A COLMAP model of SIMPLE_RADIAL without distortion: name -> pose."""
    width, height, fx, _, cx, cy = camera
    folder.mkdir(parents=True)
    (folder / "cameras.bin").write_bytes(struct.pack("<QIiQQ4d", 1, 1, 2, int(width), int(height), fx, cx, cy, 0.0))
    data = struct.pack("<Q", len(images))
    for i, (name, pose) in enumerate(sorted(images.items())):
        data += struct.pack("<I7dI", i + 1, *pose, 1) + name.encode() + b"\0" + struct.pack("<Q", 0)
    (folder / "images.bin").write_bytes(data)
    (folder / "points3D.bin").write_bytes(struct.pack("<Q", 0))


def write_bounds(path, images, camera):
    """LLFF's poses_bounds.npy, a row a photo in the order of the names."""
    width, height, fx, *_ = camera
    rows = []
    for _, (w, x, y, z, *t) in sorted(images.items()):
        r = numpy.array([[1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)],
                         [2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)],
                         [2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)]])
        right, down, forward = r
        columns = numpy.stack([down, right, -forward, -r.T @ t, [height, width, fx]], axis=1)
        rows.append([*columns.ravel(), 0.5, 20])
    numpy.save(path, numpy.array(rows))


def developed(values, gains):
    return numpy.rint(255 * numpy.clip(values * gains, 0, 1) ** GAMMA).astype(numpy.uint8)


def make_authors(program, capture, to, dtype="<u2", order="C"):
    """images/, images_npy/, sparse/0 and poses_bounds.npy; returns the gains to give as --npy-gains."""
    photos, gains = linear_photos(program, capture)
    poses, camera = poses_of(capture / "truth/sparse")
    for folder in ("images", "images_npy"):
        (to / folder).mkdir(parents=True)
    named = {}
    for name, (flash, values) in photos.items():
        stored = BLACK + values * (WHITE - BLACK)
        if numpy.dtype(dtype).kind != "f":
            stored = numpy.rint(stored)
        numpy.save(to / f"images_npy/{new_name(name, flash)}.npy", numpy.asarray(stored.astype(dtype), order=order))
        cv2.imwrite(str(to / f"images/{new_name(name, flash)}.png"), developed(values, gains)[:, :, ::-1])
        named[f"{new_name(name, flash)}.png"] = poses[name]
    write_binary_model(to / "sparse/0", named, camera)
    write_bounds(to / "poses_bounds.npy", named, camera)
    return gains


def make_rffr(program, capture, to):
    """LLFF's layout, JPEG, no flash and nothing that says so."""
    photos, gains = linear_photos(program, capture)
    poses, camera = poses_of(capture / "truth/sparse")
    (to / "images").mkdir(parents=True)
    named = {name: poses[name] for name, (flash, _) in photos.items() if not flash}
    for name in named:
        cv2.imwrite(str(to / f"images/{name}.jpg"), developed(photos[name][1], gains)[:, :, ::-1],
                    [cv2.IMWRITE_JPEG_QUALITY, 97])
    write_bounds(to / "poses_bounds.npy", named, camera)


def write_dense(path, points, ascii=False):
    """Points (n, 3) as COLMAP's fused.ply: x y z nx ny nz red green blue."""
    head = f"ply\nformat {'ascii' if ascii else 'binary_little_endian'} 1.0\nelement vertex {len(points)}\n"
    head += "".join(f"property float {n}\n" for n in ("x", "y", "z", "nx", "ny", "nz"))
    head += "".join(f"property uchar {n}\n" for n in ("red", "green", "blue")) + "end_header\n"
    path.parent.mkdir(parents=True, exist_ok=True)
    if ascii:
        path.write_text(head + "".join(f"{x:.9g} {y:.9g} {z:.9g} 0 0 1 9 9 9\n" for x, y, z in points))
    else:
        path.write_bytes(head.encode() + b"".join(struct.pack("<6f3B", *p, 0, 0, 1, 9, 9, 9) for p in points))
