"""Poses found by COLMAP in a small made capture, in one model and in two that are aligned: most photos are placed, and
the cameras stand where they stood. Two photos of another place are left out, and said."""
import itertools
import json
import math
import pathlib
import subprocess
import sys
import tempfile
import unittest

PROGRAM = str(pathlib.Path(sys.argv.pop(1)).resolve())
PHOTOS = 24
STRANGERS = ["IMG_0000", "IMG_0100"]


def run(*words):
    process = subprocess.run([PROGRAM, *map(str, words)], stdin=subprocess.DEVNULL, stdout=subprocess.PIPE,
                             stderr=subprocess.PIPE, text=True, timeout=600, check=False)
    if process.returncode:
        raise AssertionError(f"{words}: exit code {process.returncode}\n{process.stdout}\n{process.stderr}")
    return process.stdout + process.stderr


def centres(path, key):
    """{view: centre of its camera}"""
    found = {}
    for view in json.loads(path.read_text())[key]:
        m = view["w2c"]
        found[view["name"]] = [-sum(m[k][i] * m[k][3] for k in range(3)) for i in range(3)]
    return found


def distance_error(found, truth):
    """How far the distances between the cameras are off, RMS over all pairs, after the best scale."""
    pairs = [(math.dist(found[a], found[b]), math.dist(truth[a], truth[b]))
             for a, b in itertools.combinations(found, 2)]
    scale = sum(x * y for x, y in pairs) / sum(x * x for x, _ in pairs)
    return math.sqrt(sum((scale * x - y) ** 2 for x, y in pairs) / sum(y * y for _, y in pairs))


class Colmap(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        holder = tempfile.TemporaryDirectory(prefix="flashsplat-colmap-")
        cls.addClassCleanup(holder.cleanup)
        cls.dir = pathlib.Path(holder.name)
        run("synth", "-o", cls.dir / "scene", "--photos", PHOTOS, "--held-out", 1, "--width", 320, "--height", 214,
            "--seed", 5)
        run("synth", "-o", cls.dir / "other", "--photos", 2, "--held-out", 0, "--width", 320, "--height", 214, "--seed",
            2)
        strangers = sorted((cls.dir / "other/capture/raw").iterdir())
        for n, path in zip(STRANGERS, strangers):  # names that come first: COLMAP meets them before the others
            path.rename(cls.dir / f"scene/capture/raw/{n}.DNG")

    def check(self, align, most):
        out = self.dir / align
        run("ingest", self.dir / "scene/capture/raw", "-o", out, "--long-edge", 120)
        text = run("poses", out, "--align", align)
        truth, found = centres(self.dir / "scene/truth/cameras.json", "images"), centres(out / "views.json", "views")
        self.assertGreaterEqual(len(found), PHOTOS * 3 // 4, text)
        for name in STRANGERS:
            self.assertNotIn(name, found)
            self.assertRegex(text, f"{name} has no pose and is left out: .*of another place")
        error = distance_error(found, truth)
        print(f"{align}: {len(found)} photos, {100 * error:.2f} % off", file=sys.stderr)
        self.assertLess(error, most)
        return text

    def test_one_model(self):
        self.check("joint", 0.03)

    def test_two_models_are_aligned(self):
        # each has a focal length of its own here, which moves cameras and points apart
        self.assertIn("aligned to the others", self.check("separate", 0.3))


unittest.main(module="__main__", verbosity=2)
