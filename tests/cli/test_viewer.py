"""The viewer in the page shows the program's own picture: at poses that no photo has, in each browser that is here,
layer by layer against `flashsplat render`."""
import base64
import json
import os
import pathlib
import shutil
import sys
import tempfile
import unittest

import browsers
import common

try:
    import cv2
    import numpy
    MISSING = not browsers.found() and "no browser here: install chromium, or firefox-esr and xvfb"
except ImportError as missing:
    SYSTEM = "/usr/bin/python3"  # may have what another Python in PATH lacks
    if os.path.exists(SYSTEM) and not os.path.samefile(SYSTEM, sys.executable):
        os.execv(SYSTEM, [SYSTEM, *sys.argv])
    MISSING = str(missing)
if MISSING:
    print(f"skipped: {MISSING}")
    sys.exit(77)

LEAST_PSNR = 38  # dB
LAYERS = {"T_N": {"layer": "T", "flash": 0}, "T_F": {"layer": "T", "flash": 1}, "R": {"layer": "R", "flash": 0},
          "I_N": {"layer": "both", "flash": 0}, "I_F": {"layer": "both", "flash": 1},
          "beta": {"layer": "beta", "flash": 0}}


def psnr(a, b):
    return 10 * numpy.log10(255 ** 2 / max(numpy.mean((a.astype(float) - b) ** 2), 1e-9))


def decode(url):
    return cv2.imdecode(numpy.frombuffer(base64.b64decode(url.split(",")[1]), numpy.uint8), cv2.IMREAD_COLOR)


class Viewer(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        holder = tempfile.TemporaryDirectory(prefix="flashsplat-viewer-")
        cls.addClassCleanup(holder.cleanup)
        cls.dir = pathlib.Path(holder.name)
        scene, made = cls.dir / "scene", cls.dir / "made"
        cls.ok("synth", "-o", scene, "--photos", 12, "--held-out", 2, "--width", 192, "--height", 128, "--seed", 31)
        cls.ok("run", scene / "capture/raw", "-o", made, "--poses", scene / "truth/sparse", "--long-edge", 192,
               "--init-count", 2000, "--steps", 80, "--metres-per-unit", 1)
        cls.ok("render", made, "--cameras", scene / "truth/sparse", "-o", cls.dir / "renders")
        # what is mailed: the page and its folder, nothing else
        cls.out = cls.dir / "a page & more"
        cls.out.mkdir()
        shutil.copy(made / "index.html", cls.out)
        shutil.copytree(made / "report", cls.out / "report")
        cameras = json.loads((scene / "truth/cameras.json").read_text())["images"]
        cls.cameras = [{**c, "w2c": [x for r in c["w2c"][:3] for x in r]} for c in cameras if c["held_out"]]

    @classmethod
    def ok(cls, *words):
        process = common.run(*words, "--threads", 1, timeout=300)
        if process.returncode:
            raise AssertionError(process.stderr)

    def each(self):
        for kind in browsers.found():
            browser = kind()
            try:
                browser.resize(420, 700)
                browser.open((self.out / "index.html").as_uri())
                ready = browser.evaluate("flashsplat.ready.then(why => why ? why.message : 'ready')")
                self.assertEqual(ready, "ready", kind.__name__)
                yield browser
                self.assertEqual(browser.errors, [], kind.__name__)
            finally:
                browser.close()

    def test_shows_what_render_writes(self):
        for browser in self.each():
            for camera in self.cameras:
                for layer, show in LAYERS.items():
                    url = browser.evaluate(f"flashsplat.desk.picture({json.dumps(camera)}, {json.dumps(show)})")
                    wanted = cv2.imread(str(self.dir / "renders" / layer / (camera["name"] + ".png")))
                    found = psnr(decode(url), wanted)
                    print(f"{type(browser).__name__} {camera['name']} {layer}: {found:.1f} dB", file=sys.stderr)
                    self.assertGreaterEqual(found, LEAST_PSNR, (type(browser).__name__, camera["name"], layer))


if __name__ == "__main__":
    common.main()
