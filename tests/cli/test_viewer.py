"""The viewer in the page shows the program's own picture: at poses that no photo has, in each browser that is here,
layer by layer against `flashsplat render`; its buttons, sliders and keys
work, and everybody can use them. FLASHSPLAT_SCREENSHOTS=DIR leaves pictures of the page there."""
import base64
import json
import os
import pathlib
import shutil
import sys
import unittest

import browsers
import common

common.need("cv2", "numpy", also=not browsers.found() and "no browser here: install chromium, or firefox-esr and xvfb")
import cv2
import numpy

LEAST_PSNR = 38  # dB
LAYERS = {"T_N": {"layer": "T", "flash": 0}, "T_F": {"layer": "T", "flash": 1}, "R": {"layer": "R", "flash": 0},
          "I_N": {"layer": "both", "flash": 0}, "I_F": {"layer": "both", "flash": 1},
          "beta": {"layer": "beta", "flash": 0}}


def psnr(a, b):
    return 10 * numpy.log10(255 ** 2 / max(numpy.mean((a.astype(float) - b) ** 2), 1e-9))


AXE = pathlib.Path(__file__).resolve().parent.parent / "npm/node_modules/axe-core/axe.min.js"
SCREENSHOTS = os.environ.get("FLASHSPLAT_SCREENSHOTS")
DESK = "flashsplat.desk"


# WebXR of one eye that rests where it began, with the lens of CAMERA.
GLASSES = """
    const camera = CAMERA, { stage } = flashsplat.desk, { gl } = stage.renderer, { width: w, height: h } = camera;
    const matrix = [1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1];
    const projectionMatrix = [2 * camera.fx / w, 0, 0, 0, 0, 2 * camera.fy / h, 0, 0,
                              1 - 2 * camera.cx / w, 2 * camera.cy / h - 1, -1, -1, 0, 0, -0.2, 0];
    const eye = { transform: { matrix }, projectionMatrix };
    let frames = 0, done, over = false, refusals = 1;
    const { warn } = console;
    console.warn = why => { window.warned = why.message; console.warn = warn; };
    window.seen = new Promise(resolve => { done = resolve; });
    const session = {
        updateRenderState() {},
        requestReferenceSpace: async () => { if (refusals-- > 0) throw new Error('not now'); return {}; },
        end() { over = true; this.onend(); },
        requestAnimationFrame(call) { requestAnimationFrame(time => {
            if (over) return;
            call(time, { getViewerPose: () => ({ transform: { matrix }, views: [eye] }) });
            if (++frames === 5) { window.picture = stage.canvas.toDataURL(); done(); }
        }); },
    };
    gl.makeXRCompatible = async () => {};
    window.XRWebGLLayer = class { framebuffer = null; getViewport() { return { x: 0, y: 0, width: w, height: h }; } };
    window.xr = { session, isSessionSupported: async () => true, requestSession: async () => { over = false; return session; } };
    Object.defineProperty(navigator, 'xr', { value: window.xr, configurable: true });
    stage.share = 1;
    await flashsplat.desk.offerVr();
    return 1;
"""


def decode(url):
    return cv2.imdecode(numpy.frombuffer(base64.b64decode(url.split(",")[1]), numpy.uint8), cv2.IMREAD_COLOR)


class Viewer(common.ProgramTest):
    @classmethod
    def setUpClass(cls):
        cls.dir = cls.shared_folder()
        scene = cls.dir / "scene"
        cls.ok("synth", "-o", scene, "--photos", 12, "--held-out", 2, "--width", 192, "--height", 128, "--seed", 31)
        cls.make("one", "--init-count", 2000, "--steps", 80)
        cls.out = cls.dir / "one page & more"
        cls.cameras = cls.cameras_of(scene)

    @staticmethod
    def cameras_of(scene):
        cameras = json.loads((scene / "truth/cameras.json").read_text())["images"]
        return [{**c, "w2c": [x for r in c["w2c"][:3] for x in r]} for c in cameras if c["held_out"]]

    @classmethod
    def make(cls, name, *options, scene="scene"):
        """Trains, renders the poses without photos, and keeps what is mailed: the page and its folder."""
        scene, made, page = cls.dir / scene, cls.dir / name, cls.dir / f"{name} page & more"
        cls.ok("run", scene / "capture/raw", "-o", made, "--poses", scene / "truth/sparse", "--long-edge", 192,
               "--metres-per-unit", 1, *options)
        cls.ok("render", made, "--cameras", scene / "truth/sparse", "-o", cls.dir / f"{name} renders",
               "--metres-per-unit", 1)
        page.mkdir()
        shutil.copy(made / "index.html", page)
        shutil.copytree(made / "report", page / "report")

    @classmethod
    def ok(cls, *words):
        cls.assert_works(common.run(*words, "--threads", 1, timeout=300))

    def each(self, kinds=None, out=None):
        for kind in kinds or browsers.found():
            browser = kind()
            try:
                browser.resize(420, 700)
                browser.open(((out or self.out) / "index.html").as_uri())
                ready = browser.evaluate("flashsplat.ready.then(why => why ? why.message : 'ready')")
                self.assertEqual(ready, "ready", kind.__name__)
                yield browser
                self.assertEqual(browser.errors, [], kind.__name__)
            finally:
                browser.close()

    def compare(self, browser, renders, cameras=None, least=LEAST_PSNR, either=0):
        """either: share of the pixels that may be black in one picture alone; they are then left out."""
        for camera in cameras or self.cameras:
            for layer, show in LAYERS.items():
                url = browser.evaluate(f"{DESK}.picture({json.dumps(camera)}, {json.dumps(show)})")
                page, program = decode(url), cv2.imread(str(renders / layer / (camera["name"] + ".png")))
                black = page.any(2) != program.any(2) if either else numpy.zeros(page.shape[:2], bool)
                found = psnr(page[~black], program[~black])
                name = f"{type(browser).__name__} {camera['name']} {layer}"
                print(f"{name}: {found:.1f} dB, {black.mean():.3f} black in one alone", file=sys.stderr)
                self.assertGreaterEqual(found, least, name)
                self.assertLessEqual(black.mean(), either, name)

    def test_shows_what_render_writes(self):
        for browser in self.each():
            self.compare(browser, self.dir / "one renders")

    def test_shows_four_clouds(self):
        self.make("four", "--init-count", 800, "--steps", 30, "--geometry", "separate", "--beta", "cloud")
        for browser in self.each(browsers.found()[:1], self.dir / "four page & more"):
            self.compare(browser, self.dir / "four renders")

    def test_shows_bars(self):
        """Nothing is mirrored before them."""
        self.ok("synth", "-o", self.dir / "window", "--photos", 16, "--held-out", 2, "--width", 300, "--height", 200,
                "--seed", 301, "--hard", "frame")
        self.make("barred", "--long-edge", 300, "--init-count", 8000, "--steps", 1250, "--max-splats", 10000,
                  scene="window")
        self.assertIn(b"property float cover", (self.dir / "barred/clouds/T_N.ply").read_bytes()[:2000])
        for browser in self.each(browsers.found()[:1], self.dir / "barred page & more"):
            self.compare(browser, self.dir / "barred renders", self.cameras_of(self.dir / "window"),
                         least=36, either=0.03)  # R ends where cover reaches a share, which both find for themselves

    def test_measures(self):
        """The distance between two pixels is what the program's depth says it is."""
        camera = self.cameras[0]
        path = self.dir / "one renders/depth_T" / (camera["name"] + ".png")
        depth = cv2.imread(str(path), cv2.IMREAD_UNCHANGED) / 1000
        pixels, width = [(60, 70), (140, 50)], camera["width"]
        rays = [((x + 0.5 - camera["cx"]) / camera["fx"], (y + 0.5 - camera["cy"]) / camera["fy"], 1)
                for x, y in pixels]
        ends = [numpy.array(r) * depth[y, x] for r, (x, y) in zip(rays, pixels)]
        wanted = numpy.linalg.norm(ends[0] - ends[1])
        for browser in self.each():
            browser.evaluate(f"{DESK}.picture({json.dumps(camera)}, {{layer: 'T', flash: 0}})")
            scale = browser.evaluate(f"{DESK}.stage.canvas.clientWidth") / width
            browser.evaluate("(document.querySelector('[data-do=measure]').click(), 1)")
            for x, y in pixels:
                browser.evaluate(f"({DESK}.ruler.click({(x + 0.5) * scale}, {(y + 0.5) * scale}), 1)")
            text = browser.evaluate("document.querySelector('.viewer .status').textContent")
            value, unit = text.split()
            found = float(value) * {"cm": 0.01, "m": 1}[unit]
            self.assertLess(abs(found / wanted - 1), 0.03, (text, wanted))
            self.assertIn(text, browser.evaluate("document.querySelector('.viewer .marks').textContent"))

    def test_controls(self):
        for browser in self.each():
            for width in (1280, 390):
                browser.resize(width, 800)
                self.assertLessEqual(browser.evaluate("document.documentElement.scrollWidth"), width)
            self.check_buttons(browser)
            self.check_walking(browser)
            self.check_address(browser)

    def click(self, browser, what):
        browser.evaluate(f"(document.querySelector('{what}').click(), 1)")

    def check_buttons(self, browser):
        for layer in ("T", "R", "depth", "beta", "both"):
            self.click(browser, f"[data-layer={layer}]")
            self.assertEqual(browser.evaluate(f"{DESK}.stage.show.layer"), layer)
            pressed = "[...document.querySelectorAll('.viewer [data-layer][aria-pressed=true]')]"
            self.assertEqual(browser.evaluate(pressed + ".map(b => b.dataset.layer)"), [layer])
        for name, value, text in (("reflection", 40, "40 %"), ("flash", 100, "on"), ("stops", 1.5, "+1.5 stops")):
            browser.evaluate(f"(i => {{ i.value = {value}; i.dispatchEvent(new Event('input')); return 1; }})"
                             f"(document.querySelector('[data-set={name}]'))")
            said = f"document.querySelector('[data-set={name}]').getAttribute('aria-valuetext')"
            self.assertEqual(browser.evaluate(said), text)
        shown = f"(({{ reflection, flash, stops }}) => [reflection, flash, stops])({DESK}.stage.show)"
        self.assertEqual(browser.evaluate(shown), [0.4, 1, 1.5])
        self.click(browser, "[data-do=beside]")
        browser.evaluate(f"{DESK}.stage.settled().then(() => document.querySelector('.beside img').decode())")
        self.assertGreater(browser.evaluate("document.querySelector('.beside img').naturalWidth"), 0)
        self.click(browser, "[data-do=beside]")

    def until(self, browser, what, wanted):
        """Waits for what the page shows at its own pace: software's frames may take a second on a busy machine."""
        browser.evaluate(f"""new Promise((done, fail) => {{
            const begin = performance.now(), look = () => {wanted} ? done(1) : performance.now() - begin > 30000
                ? fail(new Error({json.dumps(what)})) : setTimeout(look, 50);
            look();
        }})""")

    def check_walking(self, browser):
        at = f"{DESK}.stage.pose.centre"
        far = f"Math.max(...{at}.map((x, i) => Math.abs(x - was[i]))) > 1e-4"
        press = """(key => {{
            window.was = {at};
            for (const type of ['keydown', 'keyup'])
                {desk}.stage.canvas.dispatchEvent(new KeyboardEvent(type, {{ key, bubbles: true }}));
            return 1;
        }})('{key}')"""
        for key in ("w", "ArrowRight", "+"):  # a short tap moves, however long a frame takes
            browser.evaluate(press.format(desk=DESK, at=at, key=key))
            self.until(browser, f"moved by {key}", far)
        self.until(browser, "keys let go", f"!{DESK}.walk.held.size")
        browser.evaluate(f"{DESK}.stage.settled().then(() => (window.was = {at}, 1))")
        self.assertEqual(browser.evaluate(at), browser.evaluate("was"))  # and nothing goes on
        self.click(browser, "[data-do=play]")
        self.until(browser, "playing", far)
        play, wheel = "document.querySelector('[data-do=play]')", "new WheelEvent('wheel', { deltaY: 9 })"
        browser.evaluate(f"({DESK}.stage.canvas.dispatchEvent({wheel}), {DESK}.stage.settled()).then(() => 1)")
        self.assertEqual(browser.evaluate(f"{play}.getAttribute('aria-pressed')"), "false")  # hands stop it
        self.click(browser, ".film button:nth-child(3)")
        self.until(browser, "arrived", f"!{DESK}.walk.flight")
        self.assertEqual(browser.evaluate(at), browser.evaluate(f"{DESK}.scene.views[2].pose.centre"))
        pressed = "document.querySelector('.film button:nth-child(3)').getAttribute('aria-pressed')"
        self.assertEqual(browser.evaluate(pressed), "true")

    def check_address(self, browser):
        name = browser.evaluate(f"{DESK}.scene.views[1].name")
        words = f"view={name}&layer=R&reflection=20&flash=250&stops=-1"
        browser.evaluate(f"(location.hash = '{words}', {DESK}.stage.settled()).then(() => 1)")
        shown = f"(({{ layer, flash, reflection }}) => [layer, flash, reflection])({DESK}.stage.show)"
        self.assertEqual(browser.evaluate(shown), ["R", 2.5, 0.2])
        self.assertEqual(browser.evaluate(f"{DESK}.stage.pose.centre"),
                         browser.evaluate(f"{DESK}.scene.views[1].pose.centre"))

    def test_by_keys_alone(self):
        """Tab comes to everything that can be used."""
        for browser in self.each():
            if not hasattr(browser, "press"):
                continue
            usable = "[...document.querySelectorAll('canvas, button, input, summary, a')]"
            wanted = browser.evaluate(f"(window.all = {usable}.filter(e => e.checkVisibility() && !e.disabled)).length")
            browser.evaluate("(document.body.focus(), window.reached = new Set(), 1)")
            for _ in range(wanted + 5):
                browser.press("Tab", 9)
                browser.evaluate("(reached.add(document.activeElement), 1)")
            left = browser.evaluate("all.filter(e => !reached.has(e)).map(e => e.outerHTML.slice(0, 80))")
            self.assertEqual(left, [])

    def test_everybody_can_use_it(self):
        if not AXE.exists():
            self.skipTest("axe-core is not here (tools/npm.sh)")
        for browser in self.each():
            for width in (1280, 390):
                browser.resize(width, 800)
                browser.evaluate(f"{DESK}.stage.settled().then(() => 1)")
                browser.evaluate(AXE.read_text(encoding="utf-8") + "\n1")
                found = browser.evaluate("axe.run().then(r => r.violations.map(v => [v.impact, v.id, v.nodes.map(n => "
                                         "n.html.slice(0, 120)).slice(0, 3)]))")
                self.assertEqual([v for v in found if v[0] in ("serious", "critical")], [], (width, found))

    def test_in_vr(self):
        """With glasses that are made up: who does not move sees what the page shows, through each eye's own lens."""
        for browser in self.each():
            camera, show = json.dumps(self.cameras[0]), "{layer: 'both', flash: 1}"
            wanted = decode(browser.evaluate(f"{DESK}.picture({camera}, {show})"))
            browser.evaluate(f"(async () => {{ {GLASSES} }})()".replace("CAMERA", camera))
            self.assertFalse(browser.evaluate("document.querySelector('[data-do=vr]').hidden"))
            self.click(browser, "[data-do=vr]")  # refused: the page goes on, and one may try again
            browser.evaluate(f"{DESK}.stage.settled().then(() => 1)")
            self.assertEqual(browser.evaluate("window.warned"), "not now")
            self.click(browser, "[data-do=vr]")
            found = decode(browser.evaluate("window.seen.then(() => window.picture)"))
            self.assertGreater(psnr(found, wanted), 30)  # half floats
            browser.evaluate("(xr.session.end(), flashsplat.desk.stage.settled()).then(() => 1)")

    @unittest.skipUnless(SCREENSHOTS, "FLASHSPLAT_SCREENSHOTS names no folder")
    def test_to_look_at(self):
        pathlib.Path(SCREENSHOTS).mkdir(parents=True, exist_ok=True)
        for browser in self.each():
            for width in (1280, 390):
                browser.resize(width, 1000)
                for reflection in (0, 50, 100):
                    for flash in (0, 100):
                        browser.evaluate(f"({DESK}.set('reflection', {reflection}), {DESK}.set('flash', {flash}), "
                                         f"document.getElementById('viewer').scrollIntoView(), {DESK}.stage.settled())"
                                         ".then(() => 1)")
                        name = f"{type(browser).__name__}_{width}_R{reflection}_flash{flash}.png"
                        (pathlib.Path(SCREENSHOTS) / name).write_bytes(browser.screenshot())


if __name__ == "__main__":
    common.main()
