"""Small photos and camera models for the tests, written with nothing but the standard library."""
import math
import random
import struct
import zlib


def png(width, height, pixel):
    """PNG bytes of 8-bit RGB; pixel(x, y) -> (r, g, b)."""
    def chunk(kind, data):
        return struct.pack(">I", len(data)) + kind + data + struct.pack(">I", zlib.crc32(kind + data))
    rows = b"".join(b"\0" + bytes(c for x in range(width) for c in pixel(x, y)) for y in range(height))
    header = struct.pack(">IIBBBBB", width, height, 8, 2, 0, 0, 0)
    return b"\x89PNG\r\n\x1a\n" + chunk(b"IHDR", header) + chunk(b"IDAT", zlib.compress(rows)) + chunk(b"IEND", b"")


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
