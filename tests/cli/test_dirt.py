"""Dirt on the glass: found and kept out of both scenes, where there is some; the same bits on any number of threads and from a
checkpoint."""
import json
import shutil
import subprocess
import time

import common
from common import FolderTest, run

common.need("cv2", "numpy")
import cv2
import numpy


class Dirt(FolderTest):
    def setUp(self):
        super().setUp()
        self.scene = self.dir / "scene"

    def figures_of(self, out):
        views, truth, report = self.dir / "views", self.scene / "truth", self.dir / f"{out.name}.json"
        self.assert_works(run("render", out, "--output", views, "--cameras", truth / "cameras.json", "--layers", "R,T_F", "--force"))
        self.assert_works(run("evaluate", out, truth, "--output", views, "--views", "held_out", "--json", report))
        layers = next(iter(json.loads(report.read_text())["methods"].values()))["layers"]
        return {layer: layers[layer]["psnr_gain"] for layer in ("R", "T_F")}

    def test_dirt(self):
        words = ["--poses", self.scene / "truth/sparse", "--preset", "preview", "--steps", 1250, "--max-splats", 12000,
                 "--no-photographer", "--no-bars"]
        large = ["--width", 300, "--height", 200], ["--init-count", 8000]
        small = ["--width", 120, "--height", 80], ["--init-count", 1500]
        figures, files = {}, {}
        for faults, (size, start) in (("dirt", large), ("", small)):
            self.assert_works(run("synth", "-o", self.scene, *size, "--photos", 20, "--held-out", 4, "--seed", 33,
                                  *(["--field", faults] if faults else [])))
            for option in ("--dirt", "--no-dirt"):
                out = self.dir / f"out{faults}{option}"
                process = self.assert_works(run("run", self.scene / "capture/raw", "-o", out, *words, *start, option))
                found = bool(faults) and option == "--dirt"
                self.assertEqual(found, "found dirt on the glass" in process.stdout + process.stderr)
                self.assertEqual(found, "There is dirt on the glass" in (out / "index.html").read_text())
                self.assertEqual(found, (out / "clouds/veil.tif").exists())
                self.assertEqual(found, (out / "report/veil.jpg").exists() and "report/veil.jpg" in (out / "index.html").read_text())
                files[faults, option] = [(out / "clouds" / n).read_bytes() for n in ("T_N.ply", "R.ply", "model.json")]
                if faults:
                    figures[option] = self.figures_of(out)
                if found:
                    self.check_veil(out)
                    self.check_goes_on(out, ["run", self.scene / "capture/raw", *words, *start, option])
        self.assertGreater(figures["--dirt"]["T_F"], figures["--no-dirt"]["T_F"] + 1)
        self.assertGreater(figures["--dirt"]["R"], figures["--no-dirt"]["R"] - 0.5)
        self.assertTrue(files["", "--dirt"] == files["", "--no-dirt"])  # as if nobody had looked

    def check_veil(self, out):
        """It lies where the pane does, a metre before the cameras and upright, and smears are brighter than what is clean."""
        model = json.loads((out / "clouds/model.json").read_text())
        self.assertTrue(0.8 < model["veil_distance"] < 1.25, model["veil_distance"])
        self.assertGreater(abs(model["pane_normal"][1]), 0.95)
        light = cv2.imread(str(out / "clouds/veil.tif"), cv2.IMREAD_UNCHANGED)
        value, times = numpy.unique(light, return_counts=True)
        light = light[light != value[times.argmax()]]  # what no photo sees stays even
        self.assertGreater(numpy.percentile(light, 90), 2 * numpy.percentile(light, 50))

    def step_of(self, out):
        """Of the checkpoint; None in the moment that one takes the other's place."""
        try:
            return json.loads((out / "checkpoint/state.json").read_text())["step"]
        except FileNotFoundError:
            return None

    def check_goes_on(self, out, words):
        """The same bits on one thread, and from a checkpoint; a checkpoint with another veil's moments is refused."""
        other = self.dir / "other"
        same = ("T_N.ply", "R.ply", "model.json", "veil.tif")
        shutil.copytree(out, other)
        (other / "done/train.json").unlink()
        more = [*words, "-o", other, "--threads", 1, "--checkpoint-every", 700]
        command = subprocess.Popen([common.PROGRAM, *map(str, more)], stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
        for _ in range(6000):
            if command.poll() is not None or self.step_of(other) == 700:
                break
            time.sleep(0.05)
        command.kill()
        command.wait()
        self.assertEqual(self.step_of(other), 700)
        moments = other / "checkpoint/veil_m.bin"
        data = moments.read_bytes()
        moments.write_bytes(data[:-12])
        self.assert_fails(run(*more, "--resume"), 1, "veil_m.bin")
        moments.unlink()
        self.assert_fails(run(*more, "--resume"), 1, "veil_m.bin")
        moments.write_bytes(data)
        self.assert_works(run(*more, "--resume"))
        for name in same:
            self.assertEqual((out / "clouds" / name).read_bytes(), (other / "clouds" / name).read_bytes(), name)


if __name__ == "__main__":
    common.main()
