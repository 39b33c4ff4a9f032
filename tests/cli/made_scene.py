"""A project folder with clouds that no training made: for tests of what is done with clouds."""
import json
import math
import random
import struct

FIELDS = ["x", "y", "z", "scale_0", "scale_1", "scale_2", "rot_0", "rot_1", "rot_2", "rot_3", "opacity"]
COLORS = ["color_0", "color_1", "color_2"]


def write_cloud(path, rows, with_gain):
    names = FIELDS + COLORS + ["gain"] * with_gain
    header = "ply\nformat binary_little_endian 1.0\nelement vertex %d\n%send_header\n" % (
        len(rows), "".join(f"property float {n}\n" for n in names))
    path.write_bytes(header.encode() + b"".join(struct.pack(f"<{len(names)}f", *row) for row in rows))


def made_rows(n, seed, with_gain, depth=(1.0, 3.0)):
    """Gaussians in a frustum before the camera at the origin, turned every way, of all sizes and opacities."""
    rng = random.Random(seed)
    rows = []
    for _ in range(n):
        z = rng.uniform(*depth)
        row = [rng.uniform(-0.5, 0.5) * z, rng.uniform(-0.4, 0.4) * z, z]
        row += [rng.uniform(-7, -1) for _ in range(3)]
        row += [rng.gauss(0, 1) * 3 for _ in range(4)]
        row += [rng.uniform(-4, 4)] + [rng.uniform(0.2, 1.1) for _ in range(3)] + [rng.uniform(-1, 1)] * with_gain
        rows.append(row)
    return rows


def make_project(out, n=300, normal=(0.0, 0.0, 1.0)):
    """T_N (and with it T_F) and R of n Gaussians, seen by one camera at the origin; returns their rows."""
    clouds = out / "clouds"
    clouds.mkdir(parents=True)
    rows = {"T_N": made_rows(n, 1, True), "R": made_rows(n, 2, False, (2.0, 5.0))}
    for name, of in rows.items():
        write_cloud(clouds / f"{name}.ply", of, name == "T_N")
    length = math.sqrt(sum(v * v for v in normal))
    (clouds / "model.json").write_text(json.dumps({
        "version": 2, "separation": "full", "shared_geometry": True, "pane_beta": True,
        "pane_normal": [v / length for v in normal], "pane_f0": 0.2, "pane_dimming": 0.2, "flash_return": 0.0,
        "gain_color": [1.0, 0.9, 0.8], "flash_distance": 1.0, "extent": 0.5, "metres_per_unit": 0.0,
        "clouds": {"T_N": n, "R": n}}))
    eye = [[1, 0, 0, 0], [0, 1, 0, 0], [0, 0, 1, 0], [0, 0, 0, 1]]
    (out / "views.json").write_text(json.dumps({"views": [
        {"name": "a", "flash": False, "held_out": False, "width": 100, "height": 80, "fx": 100, "fy": 100, "cx": 50,
         "cy": 40, "w2c": eye}]}))
    return rows


def make_hostile(out):
    """The same where five Gaussians of T_N are beyond what can be shown, and all of R."""
    rows = make_project(out, 30)
    rows["T_N"][2][3] = rows["T_N"][5][4] = 95
    rows["T_N"][7][0:3] = [3e38, -3e38, 3e38]
    rows["T_N"][8][10] = 3e38
    rows["T_N"][9][14] = 300  # of a gain: e^300 is as white as it gets
    for row in rows["R"]:
        row[4] = -1e30
    for name, of in rows.items():
        write_cloud(out / f"clouds/{name}.ply", of, name == "T_N")


def make_wall(out):
    """The same with a T_N that is an opaque wall, z = 2 + x / 4, green left and red right of the middle."""
    make_project(out, 10)
    rows, slope = [], math.atan(0.25) / 2
    for i in range(-30, 31):
        for j in range(-30, 31):
            rows.append([i / 20, j / 20, 2 + i / 80, -3.2, -3.2, -6, math.cos(slope), 0, -math.sin(slope), 0, 6,
                         0.9 if i > 0 else 0.4, 0.4 if i > 0 else 0.9, 0.4, 0])
    write_cloud(out / "clouds/T_N.ply", rows, True)
    model = json.loads((out / "clouds/model.json").read_text())
    model["clouds"]["T_N"] = len(rows)
    (out / "clouds/model.json").write_text(json.dumps(model))


def read_ply(path):
    """The vertices of a PLY of floats and bytes, a dictionary each."""
    data = path.read_bytes()
    header, body = data.split(b"end_header\n", 1)
    names, code, count = [], "<", 0
    for line in header.decode().splitlines():
        word = line.split()
        if word[:2] == ["element", "vertex"]:
            count = int(word[2])
        elif word[:1] == ["element"]:
            break
        elif word[:1] == ["property"]:
            names.append(word[2])
            code += {"float": "f", "uchar": "B"}[word[1]]
    size = struct.calcsize(code)
    return [dict(zip(names, struct.unpack_from(code, body, i * size))) for i in range(count)]
