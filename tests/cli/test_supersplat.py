"""Exported clouds look in SuperSplat's viewer as they do on our page, from where a photo was taken, and its engine
finds in a glTF's Gaussians what the PLY says and shows the same picture of them. Chromium draws with software.
FLASHSPLAT_SCREENSHOTS=DIR leaves the pairs there."""
import base64
import functools
import http.server
import json
import os
import pathlib
import shutil
import sys
import threading
import time

import browsers
import common
from made_scene import read_ply

VIEWER = pathlib.Path(__file__).resolve().parent.parent / "npm/node_modules/@playcanvas/supersplat-viewer/public"
common.need("cv2", "numpy", also="chromium is not here" if not shutil.which("chromium") else not VIEWER.exists() and
            "@playcanvas/supersplat-viewer is not here: tools/npm.sh fetches it")
import cv2
import numpy

SCREENSHOTS = os.environ.get("FLASHSPLAT_SCREENSHOTS")
WIDTH, HEIGHT = 192, 128
LAYERS = {"T_N": {"layer": "T", "flash": 0}, "T_F": {"layer": "T", "flash": 1}, "R": {"layer": "R", "flash": 0}}
# dB between theirs and ours: they blend display values, we blend light^0.22, so that edges of Gaussians differ.
LEAST_PSNR = 28
LEAST_SAME = 38  # of the same Gaussians out of a glTF, sorted in steps that begin elsewhere
MOST_OFF = 6     # of 255, each channel's mean over the picture


def psnr(a, b):
    return 10 * numpy.log10(255 ** 2 / max(numpy.mean((a.astype(float) - b) ** 2), 1e-9))


def turn_of(q):
    w, x, y, z = q
    return numpy.array([[1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)],
                        [2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)],
                        [2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)]])


def times(a, b):
    """Product of quaternions, w first."""
    (w, x, y, z), (s, i, j, k) = a, b
    return [w * s - x * i - y * j - z * k, w * i + x * s + y * k - z * j,
            w * j - x * k + y * s + z * i, w * k + x * j - y * i + z * s]


def in_first_camera(model):
    """Turns a COLMAP text model so that its world is the first image's frame: y down, as COLMAP's own are."""
    lines = (model / "images.txt").read_text().splitlines()
    first = None
    for i, line in enumerate(lines):
        word = line.split()
        if len(word) != 10 or line.startswith("#"):
            continue
        q, t = [float(v) for v in word[1:5]], numpy.array([float(v) for v in word[5:8]])
        first = first or (q, t)
        back = [first[0][0], *[-v for v in first[0][1:]]]
        q = times(q, back)
        t = t - turn_of(q) @ first[1]
        lines[i] = " ".join([word[0], *[f"{v:.17g}" for v in (*q, *t)], *word[8:]])
    (model / "images.txt").write_text("\n".join(lines) + "\n")


class Quiet(http.server.SimpleHTTPRequestHandler):
    def log_message(self, *_):
        pass


class SuperSplat(common.ProgramTest):
    @classmethod
    def setUpClass(cls):
        cls.dir = cls.shared_folder()
        scene, cls.out = cls.dir / "scene", cls.dir / "out"
        cls.ok("synth", "-o", scene, "--photos", 8, "--held-out", 0, "--width", WIDTH, "--height", HEIGHT,
               "--seed", 31)
        in_first_camera(scene / "truth/sparse")
        cls.ok("run", scene / "capture/raw", "-o", cls.out, "--poses", scene / "truth/sparse", "--long-edge", WIDTH,
               "--init-count", 4000, "--steps", 120, "--formats", "ply,compressed,sog,glb")
        cls.views = json.loads((cls.out / "views.json").read_text())["views"]
        cls.browser = browsers.Chromium()
        cls.addClassCleanup(cls.browser.close)
        cls.browser.resize(WIDTH, HEIGHT)
        cls.serve()

    @classmethod
    def ok(cls, *words):
        cls.assert_works(common.run(*words, "--threads", 1, timeout=300))

    @classmethod
    def serve(cls):
        """Their page with our clouds beside it, on this machine."""
        cls.site = cls.dir / "site"
        shutil.copytree(VIEWER, cls.site, ignore=shutil.ignore_patterns("*.map"))
        (cls.site / "favicon.ico").write_bytes(b"")
        for path in (cls.out / "export").iterdir():
            os.symlink(path, cls.site / path.name)
        server = http.server.ThreadingHTTPServer(("127.0.0.1", 0), functools.partial(Quiet, directory=cls.site))
        cls.url = f"http://127.0.0.1:{server.server_port}"
        threading.Thread(target=server.serve_forever, daemon=True).start()
        cls.addClassCleanup(server.server_close)
        cls.addClassCleanup(server.shutdown)

    def camera(self):
        """A photo's, its principal point in the middle and no roll about its axis: what their settings can say."""
        view = self.views[5]
        w2c = numpy.array(view["w2c"])
        centre, ahead = -w2c[:3, :3].T @ w2c[:3, 3], w2c[2, :3]
        right = numpy.cross([0, 1, 0], ahead)
        right /= numpy.linalg.norm(right)
        turn = numpy.stack([right, numpy.cross(ahead, right), ahead])
        pose = numpy.column_stack([turn, -turn @ centre])
        ours = {"width": WIDTH, "height": HEIGHT, "fx": view["fx"], "fy": view["fx"], "cx": WIDTH / 2,
                "cy": HEIGHT / 2, "w2c": pose.ravel().tolist()}
        theirs = {"position": (centre * [-1, -1, 1]).tolist(), "target": ((centre + ahead) * [-1, -1, 1]).tolist(),
                  "fov": float(2 * numpy.degrees(numpy.arctan(WIDTH / 2 / view["fx"])))}
        return ours, theirs

    def settings(self, camera):
        off = {"enabled": False, "intensity": 0}
        effects = {"sharpness": {"enabled": False, "amount": 0}, "bloom": {**off, "blurLevel": 2}, "fringing": off,
                   "grading": {"enabled": False, "brightness": 1, "contrast": 1, "saturation": 1, "tint": [1, 1, 1]},
                   "vignette": {**off, "inner": 0.3, "outer": 0.75, "curvature": 1}}
        return {"version": 2, "tonemapping": "none", "highPrecisionRendering": False, "animTracks": [],
                "background": {"color": [0, 0, 0]}, "postEffectSettings": effects, "annotations": [],
                "cameras": [{"initial": camera}], "startMode": "default"}

    def ours(self, camera):
        """On our page: the layers with the tone curve of its pictures."""
        self.browser.open((self.out / "index.html").as_uri())
        ready = self.browser.evaluate("flashsplat.ready.then(why => why ? why.message : 'ready')")
        self.assertEqual(ready, "ready")
        found = {}
        for layer, show in LAYERS.items():
            words = json.dumps(camera), json.dumps({**show, "plain": False})
            url = self.browser.evaluate(f"flashsplat.desk.picture({words[0]}, {words[1]})")
            found[layer] = cv2.imdecode(numpy.frombuffer(base64.b64decode(url.split(",")[1]), numpy.uint8), 1)
        return found

    def shot(self):
        """What their page shows, as soon as it stays the same."""
        before = None
        for _ in range(40):
            now = cv2.imdecode(numpy.frombuffer(self.browser.screenshot(), numpy.uint8), 1)
            if before is not None and (now == before).all():
                return now
            before = now
            time.sleep(0.15)
        return self.fail("their picture does not come to rest")

    def theirs(self, name):
        self.browser.open(f"{self.url}/index.html?webgl&noui&noanim&content=./{name}")
        for _ in range(300):
            if self.browser.evaluate("typeof window.captureFrame === 'function'"):  # from the first whole frame on
                return self.shot()
            time.sleep(0.1)
        return self.fail(f"{name}: no picture within 30 s; {self.browser.errors}")

    def keep(self, name, *pictures):
        if SCREENSHOTS:
            pathlib.Path(SCREENSHOTS).mkdir(parents=True, exist_ok=True)
            cv2.imwrite(str(pathlib.Path(SCREENSHOTS) / f"supersplat_{name}.png"), numpy.hstack(pictures))

    def test_looks_as_ours(self):
        mine, theirs = self.camera()
        (self.site / "settings.json").write_text(json.dumps(self.settings(theirs)))
        ours = self.ours(mine)
        for name in ("T_N.ply", "T_F.ply", "R.ply", "T_N.sog", "R.compressed.ply"):
            picture, want = self.theirs(name), ours[name.split(".")[0]]
            self.keep(name, want, picture)
            found, off = psnr(picture, want), (picture.astype(float) - want).mean((0, 1))
            print(f"{name}: {found:.1f} dB, off by {off.round(1)}", file=sys.stderr)
            self.assertGreater(want.std(), 15, name)
            self.assertGreater(found, LEAST_PSNR, name)
            self.assertLess(abs(off).max(), MOST_OFF, name)
            if name == "R.ply":
                self.check_gltf("R", picture)
        self.assertEqual(self.browser.errors, [])

    def check_gltf(self, layer, of_ply):
        """Instead of the PLY that the page shows, and turned as it: half a turn about x, and theirs about z."""
        found = self.browser.evaluate(f"""new Promise((done, fail) => app.assets.loadFromUrl('./{layer}.glb', 'container',
            (error, asset) => {{
                if (error) return fail(new Error(error));
                for (const old of app.root.find(e => e.gsplat)) old.enabled = false;
                const made = asset.resource.instantiateRenderEntity();
                for (const pane of made.find(e => e.render)) pane.enabled = false;
                made.setEulerAngles(0, 180, 0);
                app.root.addChild(made);
                app.autoRender = true;
                const data = asset.resource.gsplats[0].resource.gsplatData;
                const names = ['x', 'y', 'z', 'opacity', ...[0, 1, 2, 3].map(k => `rot_${{k}}`),
                               ...[0, 1, 2].flatMap(k => [`scale_${{k}}`, `f_dc_${{k}}`])];
                done({{ splats: asset.resource.gsplats.length,
                       ...Object.fromEntries(names.map(n => [n, Array.from(data.getProp(n))])) }});
            }}))""")
        self.assertEqual(found.pop("splats"), 1)
        rows = read_ply(self.out / "export" / f"{layer}.ply")
        want = {name: numpy.array([row[name] for row in rows]) for name in found}
        got = {name: numpy.array(values) for name, values in found.items()}
        order = [numpy.lexsort(numpy.float32([way["z"], way["y"], way["x"]]))
                 for way in (want, {**got, "y": -got["y"], "z": -got["z"]})]  # theirs are along a curve
        want, got = ({name: values[at] for name, values in way.items()} for way, at in zip((want, got), order))
        for name, sign in (("x", 1), ("y", -1), ("z", -1)):
            numpy.testing.assert_allclose(sign * got[name], want[name], atol=1e-6)
        numpy.testing.assert_allclose(got["opacity"], 1 / (1 + numpy.exp(-want["opacity"])), atol=1e-5)
        for k in range(3):
            numpy.testing.assert_allclose(numpy.log(got[f"scale_{k}"]), want[f"scale_{k}"], atol=1e-4)
            numpy.testing.assert_allclose(got[f"f_dc_{k}"], want[f"f_dc_{k}"], atol=1e-5)
        theirs, mine = (numpy.stack([way[f"rot_{k}"] for k in range(4)], 1) for way in (got, want))
        cosine = (theirs * mine * [1, 1, -1, -1]).sum(1)
        lengths = numpy.linalg.norm(theirs, axis=1) * numpy.linalg.norm(mine, axis=1)
        numpy.testing.assert_allclose(abs(cosine) / lengths, 1, atol=1e-5)
        picture = self.shot()
        self.keep(f"{layer}.glb", of_ply, picture)
        print(f"{layer}.glb: {psnr(picture, of_ply):.1f} dB", file=sys.stderr)
        self.assertGreater(psnr(picture, of_ply), LEAST_SAME)


if __name__ == "__main__":
    common.main()
