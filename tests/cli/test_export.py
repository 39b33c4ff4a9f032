#!/usr/bin/env python3
"""Exported clouds, opened by programs of others (tests/npm): what they find is what the INRIA PLY says, within the
steps of the format."""
import csv
import gzip
import hashlib
import json
import math
import pathlib
import shutil
import struct
import subprocess
import unittest
import zipfile

import common
import pictures
from made_scene import make_hostile, make_project, make_wall, read_ply, write_cloud

NPM = pathlib.Path(__file__).resolve().parent.parent / "npm"
SPLAT_TRANSFORM = NPM / "node_modules/@playcanvas/splat-transform/bin/cli.mjs"
VALIDATOR = NPM / "node_modules/gltf-validator"
ALL = "ply,splat,spz,spz2,sog,compressed,glb,points"
SH0 = 0.28209479177387814


def needs(path):
    there = path.exists() and shutil.which("node")
    return unittest.skipUnless(there, f"{path.relative_to(NPM)} is not here: tools/npm.sh fetches it")


def node(*arguments):
    process = subprocess.run(["node", *map(str, arguments)], stdin=subprocess.DEVNULL, stdout=subprocess.PIPE,
                             stderr=subprocess.PIPE, text=True, timeout=120, check=False)
    assert process.returncode == 0, process.stderr
    return process.stdout


def opacity(row):
    return 1 / (1 + math.exp(-row["opacity"]))


def rotation(row):
    q = [row[f"rot_{k}"] for k in range(4)]
    length = math.sqrt(sum(v * v for v in q))
    return [v / length for v in q]


def angle(a, b):
    """Between two ellipsoids, in degrees: half turns about their own axes do not show."""
    w, x, y, z = rotation(a)
    same = [(w, x, y, z), (-x, w, z, -y), (-y, -z, w, x), (-z, y, -x, w)]
    return math.degrees(2 * math.acos(min(1, max(abs(sum(u * v for u, v in zip(q, rotation(b)))) for q in same))))


class Export(common.FolderTest):
    def setUp(self):
        super().setUp()
        self.out = self.dir / "out"
        self.rows = make_project(self.out)

    def export(self, formats, *options, code=0):
        process = common.run("export", self.out, "--formats", formats, *options)
        self.assertEqual(process.returncode, code, process.stderr)
        return process

    def transformed(self, name):
        """What splat-transform makes of a file: its rows, in the frame of a PLY."""
        table = self.dir / (name + ".csv")
        node(SPLAT_TRANSFORM, "-q", "-w", self.out / "export" / name, table)
        with open(table, newline="", encoding="utf-8") as f:
            return [{key: float(value) for key, value in row.items()} for row in csv.DictReader(f)]

    def assert_same(self, name, position=1e-4, scale=0.04, color=0.01, alpha=0.003, degrees=0.5):
        """All Gaussians of export/<name> are those of the layer's PLY, each within the steps given."""
        wanted = read_ply(self.out / "export" / (name.split(".")[0] + ".ply"))
        found = self.transformed(name)
        self.assertEqual(len(found), len(wanted))
        for want in wanted:
            got = min(found, key=lambda row: sum((row[k] - want[k]) ** 2 for k in "xyz"))
            for k in "xyz":
                self.assertAlmostEqual(got[k], want[k], delta=position)
            for k in range(3):
                self.assertAlmostEqual(got[f"scale_{k}"], want[f"scale_{k}"], delta=scale)
                self.assertAlmostEqual(SH0 * got[f"f_dc_{k}"], SH0 * want[f"f_dc_{k}"], delta=color)
            self.assertAlmostEqual(opacity(got), opacity(want), delta=alpha)
            self.assertLess(angle(got, want), degrees)

    @needs(SPLAT_TRANSFORM)
    def test_inria_and_splat(self):
        self.export("ply,splat")
        self.assert_same("T_N.ply", 1e-6, 1e-6, 1e-6, 1e-6, 0.1)
        self.assert_same("R.splat", 1e-6, 1e-5, 0.5 / 255 + 1e-6, 0.5 / 255 + 1e-6, 1.5)

    @needs(SPLAT_TRANSFORM)
    def test_spz(self):
        self.export("ply,spz,spz2")
        step = 0.5 / 255 / 0.15 * SH0 + 1e-6
        self.assert_same("T_F.spz", 2e-5, 0.5 / 16 + 1e-6, step, 0.5 / 255 + 1e-6, 0.25)
        self.assert_same("R.v2.spz", 2e-5, 0.5 / 16 + 1e-6, step, 0.5 / 255 + 1e-6, 15)  # its w follows from 8 bits

    @needs(SPLAT_TRANSFORM)
    def test_compressed(self):
        """Ranges are those of 256 Gaussians: here nearly the whole scene, 5 units of 2048 and of 1024 steps."""
        self.export("ply,compressed")
        self.assert_same("R.compressed.ply", 0.003, 6 / 1023, 0.5 / 255 + 1e-6, 0.5 / 255 + 1e-6, 0.25)

    @needs(SPLAT_TRANSFORM)
    def test_sog(self):
        self.export("ply,sog")
        self.assert_same("T_N.sog", 2e-4, 0.03, 0.004, 0.5 / 255 + 1e-6, 1)
        with zipfile.ZipFile(self.out / "export/R.sog") as archive:
            self.assertIsNone(archive.testzip())
            self.assertEqual(json.loads(archive.read("meta.json"))["count"], 300)

    def glb(self, name):
        """The document of export/<name> and its accessors as lists of tuples."""
        data = (self.out / "export" / name).read_bytes()
        magic, version, total, size, kind = struct.unpack_from("<5I", data)
        self.assertEqual((magic, version, total, kind), (0x46546C67, 2, len(data), 0x4E4F534A))
        document = json.loads(data[20:20 + size])
        body, values = data[28 + size:], []
        for accessor in document["accessors"]:
            view = document["bufferViews"][accessor["bufferView"]]
            width = {"SCALAR": 1, "VEC3": 3, "VEC4": 4}[accessor["type"]]
            one = struct.Struct(f"<{width}{ {5126: 'f', 5121: 'B'}[accessor['componentType']] }")
            values.append([one.unpack_from(body, view["byteOffset"] + i * one.size) for i in range(accessor["count"])])
        return document, values

    def test_glb(self):
        """As floats, exactly; y up, so the frame of the poses turned about x."""
        self.export("ply,glb")
        document, values = self.glb("R.glb")
        self.assertEqual(document["extensionsUsed"], ["KHR_gaussian_splatting"])
        splats = document["meshes"][0]["primitives"][0]
        self.assertEqual(splats["extensions"]["KHR_gaussian_splatting"],
                         {"kernel": "ellipse", "colorSpace": "srgb_rec709_display"})
        of = {name.split(":")[-1]: values[index] for name, index in splats["attributes"].items()}
        for i, row in enumerate(read_ply(self.out / "export/R.ply")):
            self.assertEqual(of["POSITION"][i], (row["x"], -row["y"], -row["z"]))
            for k in range(3):
                self.assertAlmostEqual(math.log(of["SCALE"][i][k]), row[f"scale_{k}"], delta=1e-5)
                self.assertAlmostEqual(of["SH_DEGREE_0_COEF_0"][i][k], row[f"f_dc_{k}"], delta=1e-6)
            self.assertAlmostEqual(of["OPACITY"][i][0], opacity(row), delta=1e-6)
            x, y, z, w = of["ROTATION"][i]
            turned = {"rot_0": w, "rot_1": x, "rot_2": -y, "rot_3": -z}
            self.assertLess(angle(turned, row), 0.1)

    @needs(VALIDATOR)
    def test_glb_is_valid(self):
        """But for what the validator, which does not know the extension yet, says of its name and attributes' names."""
        self.export("glb", "--unmirror")
        for path in sorted((self.out / "export").iterdir()):
            report = json.loads(node(NPM / "validate_gltf.mjs", path))
            issues = [issue for issue in report["issues"]["messages"] if issue["code"] != "UNSUPPORTED_EXTENSION"
                      and "/attributes/KHR_gaussian_splatting:" not in issue["pointer"]]
            self.assertEqual(issues, [])
            self.assertEqual(report["info"]["totalVertexCount"], 304 if path.stem in ("R", "room") else 300)

    def test_pane(self):
        """The rectangle that the photo looks through: 100 by 80 pixels of a camera of 100 pixels, at 2 units."""
        self.export("glb", "--pane-distance", 2)
        document, values = self.glb("R.glb")
        self.assertEqual([node["name"] for node in document["nodes"]], ["Gaussians", "pane"])
        corners = values[document["meshes"][1]["primitives"][0]["attributes"]["POSITION"]]
        for corner, want in zip(corners, [(-1, 0.8, -2), (1, 0.8, -2), (1, -0.8, -2), (-1, -0.8, -2)]):
            for got, v in zip(corner, want):
                self.assertAlmostEqual(got, v, delta=1e-6)

    def covariance(self, row):
        w, x, y, z = rotation(row)
        turn = [[1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)],
                [2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)],
                [2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)]]
        size = [math.exp(2 * row[f"scale_{k}"]) for k in range(3)]
        return [[sum(turn[i][k] * size[k] * turn[j][k] for k in range(3)) for j in range(3)] for i in range(3)]

    def test_nothing_to_unmirror(self):
        path = self.out / "clouds/model.json"
        model = json.loads(path.read_text())
        model["clouds"].pop("R")
        path.write_text(json.dumps(model | {"separation": "none"}))
        process = self.export("ply", "--unmirror", code=2)
        self.assert_fails(process, 2, "--unmirror", "nothing is mirrored")
        self.assertFalse((self.out / "export").exists() or (self.out / "done/export.json").exists())

    def test_unmirror(self):
        """Positions and covariances are the reflected ones, at the pane that is told or found."""
        out, normal = self.dir / "tilted", [0.28, 0.0, 0.96]
        make_project(out, 40, normal)
        mirror = [[(i == j) - 2 * normal[i] * normal[j] for j in range(3)] for i in range(3)]
        for options, distance in ((["--pane-distance", "0.75"], 0.75), ([], None)):
            self.assert_works(common.run("export", out, "--formats", "ply", "--unmirror", *options))
            seen, room = read_ply(out / "export/R.ply"), read_ply(out / "export/room.ply")
            if distance is None:
                distance = min(sum(n * row[k] for n, k in zip(normal, "xyz")) for row in read_ply(out / "export/T_N.ply"))
            for a, b in zip(seen, room):
                at = sum(n * a[k] for n, k in zip(normal, "xyz"))
                for n, k in zip(normal, "xyz"):
                    self.assertAlmostEqual(b[k], a[k] - 2 * (at - distance) * n, delta=1e-5)
                was, now = self.covariance(a), self.covariance(b)
                want = [[sum(mirror[i][k] * was[k][l] * mirror[l][j] for k in range(3) for l in range(3))
                         for j in range(3)] for i in range(3)]
                most = max(map(max, was))
                for i in range(3):
                    for j in range(3):
                        self.assertAlmostEqual(now[i][j], want[i][j], delta=1e-4 * most)

    def test_mesh(self):
        """A wall's mesh lies on it and has its colours; the same bytes for any number of threads."""
        out, meshes = self.dir / "wall", []
        make_wall(out)
        for threads in (1, 3):
            self.assert_works(common.run("export", out, "--formats", "mesh", "--threads", threads, "--force"))
            meshes.append((out / "export/T_N.mesh.ply").read_bytes())
        self.assertEqual(meshes[0], meshes[1])
        self.assertEqual({p.name for p in (out / "export").iterdir()}, {"T_N.mesh.ply", "T_F.mesh.ply"})
        vertices = read_ply(out / "export/T_N.mesh.ply")
        self.assertGreater(len(vertices), 400)
        off = sorted(abs(v["z"] - 2 - v["x"] / 4) for v in vertices)
        self.assertLess(off[len(off) // 2], 0.015)  # of pixels 0.02 wide
        self.assertLess(off[-1], 0.05)
        for v in vertices:
            if abs(v["x"]) > 0.15:
                self.assertEqual(v["red"] > v["green"], v["x"] > 0)

    def test_adds_up(self):
        """What was exported of the same clouds stays beside what another call writes; what is gone is made again."""
        there = lambda: sorted(p.suffix for p in (self.out / "export").glob("T_N.*"))
        self.export("ply")
        self.assertIn("beside what is there", self.export("spz").stdout)
        self.assertEqual(there(), [".ply", ".spz"])
        (self.out / "views.json").unlink()
        self.export("points", "--dataset", code=1)  # ended early: no photos are known
        self.assertIn("beside what is there", self.export("spz").stdout)
        self.assertIn(".ply", there())
        self.assertIn("done already", self.export("spz").stdout)
        shutil.rmtree(self.out / "export")
        self.assertIn("gone", self.export("spz").stdout)
        self.assertEqual(there(), [".spz"])
        with open(self.out / "clouds/model.json", "a") as f:
            f.write("\n")
        self.assertIn("done again", self.export("splat").stdout)  # of other clouds
        self.assertEqual(there(), [".splat"])
        self.assertIn("done already", self.export("splat").stdout)
        self.export("ply", "--force")
        self.assertEqual(there(), [".ply"])

    def test_damaged_views(self):
        """No other exposure is taken for what cannot be read, and what is there stays."""
        self.export("ply")
        before = (self.out / "export/T_N.ply").read_bytes()
        (self.out / "views.json").write_text('{"views": [')
        self.assert_fails(common.run("export", self.out, "--formats", "ply,spz"), 1, "views.json")
        self.assertEqual((self.out / "export/T_N.ply").read_bytes(), before)

    def test_dataset(self):
        """COLMAP reads the model; its one photo is T as the camera sees it, in the colours of the clouds."""
        out = self.dir / "wall"
        make_wall(out)
        self.assert_works(common.run("export", out, "--formats", "ply", "--dataset"))
        text = self.dir / "text"
        text.mkdir()
        subprocess.run(["colmap", "model_converter", "--input_path", out / "export/dataset/sparse/0", "--output_path",
                        text, "--output_type", "TXT"], check=True, stdout=subprocess.DEVNULL, timeout=60)
        lines = [line for line in (text / "images.txt").read_text().splitlines() if not line.startswith("#")]
        self.assertEqual(lines[0].split(), "1 1 0 0 0 0 0 0 1 a.png".split())
        self.assertIn("1 PINHOLE 100 80 100 100 50 40", (text / "cameras.txt").read_text())
        points = [line.split() for line in (text / "points3D.txt").read_text().splitlines() if line[0] != "#"]
        self.assertEqual(len(points), 61 * 61)
        rows = pictures.read_png(out / "export/dataset/images/a.png")
        for x, side in ((20, -1), (80, 1)):
            want = [int(v) for v in next(p for p in points if side * float(p[1]) > 0.5)[4:7]]
            for got, v in zip(rows[40][3 * x:3 * x + 3], want):
                self.assertAlmostEqual(got, v, delta=3)

    def test_dataset_of_photos(self):
        """The photos by sRGB's curve and nothing else, the poses' points, the nearest photo of the other lighting."""
        out = self.dir / "wall"
        make_wall(out)
        eye = json.loads((out / "views.json").read_text())["views"][0]
        views = []
        for name, flash, x in (("a", True, 0.0), ("b", False, 0.3), ("c", False, 0.1)):
            w2c = [r[:3] + [r[3] - x * (k == 0)] for k, r in enumerate(eye["w2c"])]
            views.append(dict(eye, name=name, flash=flash, width=4, height=3, w2c=w2c))
        (out / "views.json").write_text(json.dumps({"views": views}))
        (out / "images").mkdir()
        for i, v in enumerate(views):
            light = [(i + 1) / 8, 0.5, -0.1]  # the first pixel is outside the photo, the second clipped
            pictures.write_tiff(out / f"images/{v['name']}.tif", 4, 3, [0, 0, 0] + light * 11)
            (out / f"images/{v['name']}_mask.png").write_bytes(
                pictures.png_of_rows(4, 3, [bytes([0, 0, 255, 255])] + [b"\xff" * 4] * 2, grey=True))
        pictures.model(out / "sparse", ["a", "b", "c"], 4, 3)
        (out / "sparse/points3D.txt").write_text("1 1 2 3 9 8 7 0.5\n")
        self.assert_works(common.run("export", out, "--formats", "ply", "--dataset", "--dataset-of", "photos"))
        data = out / "export/dataset"
        lines = [line.split("\t") for line in (data / "pairs.txt").read_text().splitlines()]
        self.assertEqual(lines, [["a.png", "c.png", "0.1"]])
        srgb = lambda v: round(255 * (1.055 * v ** (1 / 2.4) - 0.055))
        for i, v in enumerate(views):
            row = bytes([srgb((i + 1) / 8), srgb(0.5), 0] * 4)
            self.assertEqual(pictures.read_png(data / f"images/{v['name']}.png"), [bytes(3) + row[3:]] + [row] * 2)
            mask = pictures.read_png(data / f"masks/{v['name']}.png.png")
            self.assertEqual([list(r) for r in mask], [[0, 255, 255, 255]] + [[255] * 4] * 2)
        points = struct.unpack_from("<QQ3d3B", (data / "sparse/0/points3D.bin").read_bytes())
        self.assertEqual(points, (1, 1, 1, 2, 3, 9, 8, 7))
        self.assert_works(common.run("export", out, "--formats", "ply", "--dataset"))
        self.assertFalse((data / "pairs.txt").exists() or (data / "masks").exists())  # they are of the photos

    def test_far_and_small(self):
        """Far from the origin SPZ keeps the scene's own steps; sizes that it cannot tell, and no points, are told of."""
        for row in self.rows["T_N"]:
            row[0], row[1] = row[0] + 1000, row[1] + 500
        for row in self.rows["R"]:
            row[3:6] = [s - 8 for s in row[3:6]]
            row[10] = -abs(row[10]) - 0.1
        for name, rows in self.rows.items():
            write_cloud(self.out / f"clouds/{name}.ply", rows, name == "T_N")
        process = self.assert_works(common.run("export", self.out, "--formats", "spz,points"))
        self.assertIn("R: spz: ", process.stderr)
        self.assertNotIn("T_N: spz: ", process.stderr)
        self.assertIn("R: no points", process.stderr)
        self.assertFalse((self.out / "export/R.points.ply").exists())
        self.assertTrue((self.out / "export/T_N.points.ply").exists())
        data = gzip.decompress((self.out / "export/T_N.spz").read_bytes())
        n, bits = len(self.rows["T_N"]), data[13]
        self.assertLess(2.0**-bits, 2e-4)
        found = sorted(int.from_bytes(data[16 + 9 * i:19 + 9 * i], "little", signed=True) / 2**bits for i in range(n))
        for x, row in zip(found, sorted(self.rows["T_N"])):
            self.assertAlmostEqual(x, row[0], delta=2.0**-bits)

    def test_points(self):
        self.export("ply,points")
        cloud = [row for row in read_ply(self.out / "export/T_N.ply") if row["opacity"] >= 0]
        points = read_ply(self.out / "export/T_N.points.ply")
        self.assertEqual([p["x"] for p in points], [row["x"] for row in cloud])
        for p, row in zip(points, cloud):
            self.assertAlmostEqual(p["green"] / 255, 0.5 + SH0 * row["f_dc_1"], delta=0.5 / 255 + 1e-6)

    def test_hostile(self):
        """What no viewer can show is left out with a warning; the rest is finite in every format."""
        out = self.dir / "hostile"
        make_hostile(out)
        process = self.assert_works(common.run("export", out, "--formats", ALL, "--unmirror"))
        self.assertIn("T_N: 3 of 30 Gaussians are left out", process.stderr)
        self.assertIn("T_F: 3 of 30 Gaussians are left out", process.stderr)
        self.assertIn("R: 30 of 30 Gaussians are left out", process.stderr)
        self.assertEqual([p.name for p in (out / "export").glob("R.*")], [])
        for layer, n in (("T_N", 27), ("T_F", 27)):
            rows = read_ply(out / "export" / f"{layer}.ply")
            self.assertEqual(len(rows), n)
            self.assertTrue(all(math.isfinite(v) for row in rows for v in row.values()))
        self.out = out
        _, values = self.glb("T_F.glb")
        self.assertTrue(all(math.isfinite(v) for accessor in values for row in accessor for v in row))
        with zipfile.ZipFile(out / "export/T_N.sog") as archive:
            self.assertEqual(json.loads(archive.read("meta.json"), parse_constant=self.fail)["count"], 27)

    @needs(SPLAT_TRANSFORM)
    def test_far(self):
        """A Gaussian far beyond the others takes nothing from them."""
        rows = self.rows["T_N"]
        rows[7][0:3] = [0, 40, 900]
        write_cloud(self.out / "clouds/T_N.ply", rows, True)
        self.export("ply,spz")
        wanted, found = read_ply(self.out / "export/T_N.ply"), self.transformed("T_N.spz")
        self.assertEqual(max(row["z"] for row in wanted), 900)
        far = max(found, key=lambda row: row["z"])
        self.assertGreater(far["z"], 60)
        self.assertAlmostEqual(far["y"] / far["z"], 40 / 900, delta=1e-4)
        for want in wanted:
            if want["z"] < 900:
                nearest = min(sum((row[k] - want[k]) ** 2 for k in "xyz") for row in found)
                self.assertLess(math.sqrt(nearest), 5e-5)

    def test_choice(self):
        """Only what was asked for is there, the same bytes for any number of threads; the rest is refused by name."""
        self.export("ply,spz", "--threads", 1)
        first = {p.name: hashlib.sha256(p.read_bytes()).digest() for p in (self.out / "export").iterdir()}
        self.assertEqual(set(first), {f"{layer}.{ending}" for layer in ("T_F", "T_N", "R") for ending in ("ply", "spz")})
        self.export("ply,spz", "--threads", 3, "--force")
        again = {p.name: hashlib.sha256(p.read_bytes()).digest() for p in (self.out / "export").iterdir()}
        self.assertEqual(first, again)
        self.export("splat", "--force")
        self.assertEqual({p.suffix for p in (self.out / "export").iterdir()}, {".splat"})
        self.assert_fails(self.export("ply,psd", code=2), 2, "--formats", "'psd'")


if __name__ == "__main__":
    common.main()
