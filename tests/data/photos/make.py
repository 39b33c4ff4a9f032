#!/usr/bin/python3
"""Writes the photos of this folder with OpenCV and exiftool, for the tests of the readers (needs both; run once).

Every pixel follows a formula that the tests know: see PATTERN, SMOOTH and RAW below.
"""
import os
import struct
import subprocess

import cv2
import numpy as np

os.chdir(os.path.dirname(os.path.abspath(__file__)))
y, x, c = np.mgrid[:16, :24, :3]
PATTERN = (7 * x + 13 * y + 29 * c) % 256  # 8 bits; 16 bits: times 257, plus x
SMOOTH = 40 + 5 * x + 3 * y + 20 * c       # for JPEG
WIDE = PATTERN * 257 % 65536


def write(name, rgb, *options):
    assert cv2.imwrite(name, rgb[:, :, ::-1] if rgb.ndim == 3 and rgb.shape[2] == 3 else rgb, list(options))


def tag(name, *tags):
    subprocess.run(["exiftool", "-q", "-overwrite_original", *tags, name], check=True)


u8, u16 = PATTERN.astype(np.uint8), WIDE.astype(np.uint16)
write("rgb8.png", u8)
write("rgb16.png", u16)
write("grey8.png", u8[:, :, 0])
write("rgba8.png", np.dstack([u8[:, :, ::-1], u8[:, :, 0]]))
write("rgb8.tif", u8)
write("rgb16.tif", u16)
write("rgb32f.tif", (PATTERN / 100.0 - 0.5).astype(np.float32), cv2.IMWRITE_TIFF_COMPRESSION, 1)
write("grey16.tif", u16[:, :, 0])
write("rgb.jpg", SMOOTH.astype(np.uint8), cv2.IMWRITE_JPEG_QUALITY, 95)
write("progressive.jpg", SMOOTH.astype(np.uint8), cv2.IMWRITE_JPEG_QUALITY, 95, cv2.IMWRITE_JPEG_PROGRESSIVE, 1)
write("grey.jpg", SMOOTH[:, :, 0].astype(np.uint8), cv2.IMWRITE_JPEG_QUALITY, 95)

camera = ["-Make=Maker", "-Model=Camera 1", "-ExposureTime=1/125", "-FNumber=5.6", "-ISO=400", "-FocalLength=35",
          "-FocalLengthIn35mmFormat=52", "-EXIF:Flash#=25", "-IFD0:Orientation#=6"]
for name in ["rgb.jpg", "rgb8.tif", "rgb8.png"]:
    tag(name, *camera)
tag("progressive.jpg", "-ExifByteOrder=II", "-EXIF:Flash#=24", "-ExposureTime=2", "-Make=Maker 2", "-IFD0:Orientation#=1",
    "-FocalLength=10", "-FocalPlaneXResolution=4", "-FocalPlaneYResolution=4", "-FocalPlaneResolutionUnit=mm",
    "-ExifImageWidth=24", "-ExifImageHeight=16")

# RAW: linear light (camera RGB, white-balanced) that demosaicing gives back exactly, and a saturated square.
WHITE_BALANCE, BLACK, WHITE = np.array([2.0, 1.0, 1.6]), 512, 16383
y, x = np.mgrid[:48, :64]
RAW = np.dstack([0.20 + 0.004 * x, 0.20 + 0.003 * y, 0.20 + 0.002 * (x + y)])


def dng(name, rgb, pattern, *tags, black=BLACK, linear=False):
    if linear:
        data = np.round(BLACK + rgb / WHITE_BALANCE * (WHITE - BLACK))
    else:
        color = np.array(pattern)[(y % 2) * 2 + x % 2]
        level = np.array(black if isinstance(black, list) else [black] * 4)[(y % 2) * 2 + x % 2]
        value = np.take_along_axis(rgb, color[:, :, None], 2)[:, :, 0] / WHITE_BALANCE[color]
        data = np.round(level + value * (WHITE - level))
        data[(x >= 40) & (x < 44) & (y >= 20) & (y < 24)] = WHITE
    write(name + ".tif", data.astype(np.uint16), cv2.IMWRITE_TIFF_COMPRESSION, 1)
    os.replace(name + ".tif", name)
    kind = ["-IFD0:PhotometricInterpretation#=34892"] if linear else [
        "-IFD0:PhotometricInterpretation#=32803", "-IFD0:CFARepeatPatternDim=2 2",
        "-IFD0:CFAPattern2=" + " ".join(map(str, pattern))]
    levels = ["-IFD0:BlackLevelRepeatDim=2 2", "-IFD0:BlackLevel=" + " ".join(map(str, black))] if isinstance(black, list) else \
             ["-IFD0:BlackLevelRepeatDim=1 1", "-IFD0:BlackLevel=" + " ".join([str(black)] * (3 if linear else 1))]
    tag(name, *kind, *levels, "-DNGVersion=1.4.0.0", "-DNGBackwardVersion=1.1.0.0", "-UniqueCameraModel=Test Camera",
        "-Make=Test", "-Model=Camera", "-IFD0:WhiteLevel=" + " ".join([str(WHITE)] * (3 if linear else 1)),
        "-ColorMatrix1=1 0 0 0 1 0 0 0 1", "-CalibrationIlluminant1#=21", "-AsShotNeutral=0.5 1 0.625", "-XMP:all=",
        "-ExposureTime=1/4", "-FNumber=5.6", "-ISO=200", "-FocalLength=24", "-FocalPlaneXResolution=2.5",
        "-FocalPlaneYResolution=2.5", "-FocalPlaneResolutionUnit=mm", *tags)


dng("flash.dng", np.minimum(RAW * 1.3, 0.95), [0, 1, 1, 2], "-EXIF:Flash#=9", "-IFD0:Orientation#=1")
dng("ambient.dng", RAW, [0, 1, 1, 2], "-EXIF:Flash#=16", "-IFD0:Orientation#=1")
dng("turned.dng", RAW, [2, 1, 1, 0], "-EXIF:Flash#=16", "-IFD0:Orientation#=6", black=[500, 520, 530, 510])
dng("gbrg.dng", RAW, [1, 2, 0, 1], "-EXIF:Flash#=0", "-IFD0:Orientation#=1")
dng("linear.dng", RAW, None, "-EXIF:Flash#=16", "-IFD0:Orientation#=1", linear=True)


def lossy(name):
    """A linear DNG of one lossy JPEG tile, 60 and 120 of 255, which no program at hand writes."""
    grey = np.full((48, 64, 3), 120, np.uint8)
    grey[:, :32] = 60
    tile = cv2.imencode(".jpg", grey, [cv2.IMWRITE_JPEG_QUALITY, 95])[1].tobytes()
    tags = [(254, "I", [0]), (256, "I", [64]), (257, "I", [48]), (258, "H", [8] * 3), (259, "H", [34892]),
            (262, "H", [34892]), (271, "s", [b"Test"]), (272, "s", [b"Camera"]), (277, "H", [3]), (284, "H", [1]),
            (322, "I", [64]), (323, "I", [48]), (324, "I", [0]), (325, "I", [len(tile)]), (50706, "B", [1, 4, 0, 0]),
            (50721, "ii", [1, 1, 0, 1, 0, 1, 0, 1, 1, 1, 0, 1, 0, 1, 0, 1, 1, 1]), (50728, "II", [1, 2, 1, 1, 5, 8])]
    types = {"B": 1, "s": 2, "H": 3, "I": 4, "II": 5, "ii": 10}
    base, entries, more = 8 + 2 + 12 * len(tags) + 4, [], b""
    for tag, kind, values in tags:
        data = values[0] + b"\0" if kind == "s" else struct.pack(f"<{len(values)}{kind[0]}", *values)
        count = len(data) if kind == "s" else len(values) // len(kind)
        place = data.ljust(4, b"\0") if len(data) <= 4 else struct.pack("<I", base + len(more))
        more += data.ljust(len(data) + len(data) % 2, b"\0") if len(data) > 4 else b""
        entries.append(struct.pack("<HHI", tag, types[kind], count) + place)
    entries[12] = struct.pack("<HHII", 324, 4, 1, base + len(more))
    with open(name, "wb") as f:
        f.write(b"II*\0" + struct.pack("<IH", 8, len(tags)) + b"".join(entries) + bytes(4) + more + tile)


lossy("lossy.dng")


def super_ccd(name):
    """Fujifilm's pixels that stand on their corners: a sensor of 40 x 60, its values 1000 to 1899."""
    model, tags = b"FinePix T100", ((0x100, (60, 40)), (0x121, (56, 36)), (0x130, (0, 0)))
    tiff = b"II*\0" + struct.pack("<IH", 8, 2) + struct.pack("<HHII", 0x10F, 2, 9, 38) + \
        struct.pack("<HHII", 0x110, 2, len(model) + 1, 48) + bytes(4) + b"FUJIFILM\0\0" + model + b"\0"
    jpeg = b"\xff\xd8\xff\xe1" + struct.pack(">H", len(tiff) + 8) + b"Exif\0\0" + tiff + b"\xff\xd9"
    directory = struct.pack(">I", len(tags)) + b"".join(struct.pack(">HHHH", tag, 4, *v) for tag, v in tags)
    pixels = b"".join(struct.pack("<H", 1000 + (x * 7 + y * 3) % 900) for y in range(60) for x in range(40))
    head = bytearray(b"FUJIFILMCCD-RAW 0201".ljust(160, b"\0"))
    head[28:28 + len(model)] = model
    struct.pack_into(">IIIIII", head, 84, 160, len(jpeg), 160 + len(jpeg), len(directory),
                     160 + len(jpeg) + len(directory), len(pixels))
    with open(name, "wb") as f:
        f.write(bytes(head) + jpeg + directory + pixels)


super_ccd("super_ccd.raf")
