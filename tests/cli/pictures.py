"""Small photos and camera models for the tests, written with nothing but the standard library."""
import json
import math
import random
import struct
import zlib


def png_of_rows(width, height, rows, grey=False):
    """PNG bytes of 8-bit RGB, or grey, of the bytes of its rows."""
    def chunk(kind, data):
        return struct.pack(">I", len(data)) + kind + data + struct.pack(">I", zlib.crc32(kind + data))
    header = struct.pack(">IIBBBBB", width, height, 8, 0 if grey else 2, 0, 0, 0)
    data = zlib.compress(b"".join(b"\0" + row for row in rows))
    return b"\x89PNG\r\n\x1a\n" + chunk(b"IHDR", header) + chunk(b"IDAT", data) + chunk(b"IEND", b"")


def png(width, height, pixel):
    """The same of pixel(x, y) -> (r, g, b)."""
    return png_of_rows(width, height, [bytes(c for x in range(width) for c in pixel(x, y)) for y in range(height)])


def write_tiff(path, width, height, values):
    """Float RGB TIFF, one strip, not compressed."""
    data = struct.pack(f"<{3 * width * height}f", *values)
    tags = [(256, 4, 1, width), (257, 4, 1, height), (258, 3, 3, None), (259, 3, 1, 1), (262, 3, 1, 2), (273, 4, 1, None),
            (277, 3, 1, 3), (278, 4, 1, height), (279, 4, 1, len(data)), (284, 3, 1, 1), (339, 3, 3, None)]
    end = 8 + 2 + 12 * len(tags) + 4
    at = {258: end, 339: end + 6, 273: end + 12}
    head = struct.pack("<2sHIH", b"II", 42, 8, len(tags))
    head += b"".join(struct.pack("<HHII", t, kind, n, at.get(t, v)) for t, kind, n, v in tags) + b"\0" * 4
    path.write_bytes(head + struct.pack("<6H", 32, 32, 32, 3, 3, 3) + data)


def read_png(path):
    """Rows of the bytes of an 8-bit RGB or grey PNG."""
    data, at, packed = path.read_bytes(), 8, b""
    while at < len(data):
        size, kind = struct.unpack_from(">I4s", data, at)
        if kind == b"IHDR":
            width, height = struct.unpack_from(">II", data, at + 8)
            assert data[at + 16:at + 18] in (b"\x08\x00", b"\x08\x02"), path
            each = 3 if data[at + 17] else 1
        if kind == b"IDAT":
            packed += data[at + 8:at + 8 + size]
        at += 12 + size
    n = each * width
    raw, rows, above = zlib.decompress(packed), [], bytes(n)
    for y in range(height):
        how, row = raw[y * (n + 1)], bytearray(raw[y * (n + 1) + 1:(y + 1) * (n + 1)])
        for i in range(n):
            left, up, corner = (row[i - each], above[i], above[i - each]) if i >= each else (0, above[i], 0)
            paeth = min((abs(up - corner), 0, left), (abs(left - corner), 1, up),
                        (abs(left + up - 2 * corner), 2, corner))[2]
            row[i] = (row[i] + (0, left, up, (left + up) // 2, paeth)[how]) % 256
        rows.append(bytes(row))
        above = rows[-1]
    return rows


def photos(folder, n=6, width=48, height=32):
    """n flash photos F_00.png ... and n without, N_00.png ...: noise, twice as bright with flash."""
    folder.mkdir(parents=True, exist_ok=True)
    for i in range(n):
        for name, gain in (("F", 2), ("N", 1)):
            rng = random.Random(f"{name}{i}")
            (folder / f"{name}_{i:02}.png").write_bytes(
                png(width, height, lambda x, y: [gain * rng.randrange(20, 120) for _ in range(3)]))
    return folder


def model(folder, names, width=48, height=32):
    """COLMAP text model: cameras side by side, looking along z."""
    folder.mkdir(parents=True, exist_ok=True)
    (folder / "cameras.txt").write_text(f"1 PINHOLE {width} {height} {width} {width} {width / 2} {height / 2}\n")
    lines = [f"{i + 1} 1 0 0 0 {-0.05 * i} {0.02 * math.sin(i)} 0 1 {name}\n\n" for i, name in enumerate(names)]
    (folder / "images.txt").write_text("".join(lines))
    return folder


def give_points(truth, n=200):
    """Points with tracks for the model that synth writes without: then COLMAP is not needed."""
    rng = random.Random(1)
    cameras = json.loads((truth / "cameras.json").read_text())["images"]
    first, points, seen = cameras[0]["w2c"], [], [[] for _ in cameras]
    while len(points) < n:
        z = rng.uniform(1.5, 4)
        p = [rng.uniform(-.4, .4) * z - first[0][3], rng.uniform(-.3, .3) * z - first[1][3], z - first[2][3]]
        x = [sum(first[r][k] * p[r] for r in range(3)) for k in range(3)]
        track = ""
        for k, c in enumerate(cameras):
            q = [sum(c["w2c"][r][j] * x[j] for j in range(3)) + c["w2c"][r][3] for r in range(3)]
            u, v = c["fx"] * q[0] / q[2] + c["cx"], c["fy"] * q[1] / q[2] + c["cy"]
            if q[2] > 0 and 0 < u < c["width"] and 0 < v < c["height"]:
                track += f" {k + 1} {len(seen[k])}"
                seen[k].append(f"{u} {v} {len(points) + 1}")
        points.append(f"{len(points) + 1} {x[0]} {x[1]} {x[2]} 128 128 128 0.5{track}\n")
    (truth / "sparse/points3D.txt").write_text("".join(points))
    lines = [l for l in (truth / "sparse/images.txt").read_text().splitlines() if l and not l.startswith("#")]
    (truth / "sparse/images.txt").write_text("".join(f"{l}\n{' '.join(s)}\n" for l, s in zip(lines, seen)))
