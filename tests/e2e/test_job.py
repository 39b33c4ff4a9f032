"""The whole job on a small made capture, through the program: photos to separated scene, measured against the truth;
the same bits for any number of threads and after an interruption; stages that are done are skipped."""
import json
import pathlib
import re
import shutil
import signal
import subprocess
import sys
import tempfile
import time
import unittest

PROGRAM = str(pathlib.Path(sys.argv.pop(1)).resolve())
STEPS = 300
TRAIN = ["--steps", STEPS, "--max-splats", 8000]
ALL = [*TRAIN, "--init-count", 4000, "--long-edge", 208]  # two levels: 104, 208
# Held-out views, gain-fitted, in dB: about 4 below what was measured. Without the flash cues it is 15 to 20.
LEAST = {"T_N": 28, "T_F": 28, "R": 25, "I_N": 30, "I_F": 30}


def command(*words):
    return [PROGRAM, *map(str, words)]


def run(*words, code=0, timeout=900):
    process = subprocess.run(command(*words), stdin=subprocess.DEVNULL, stdout=subprocess.PIPE, stderr=subprocess.PIPE,
                             text=True, timeout=timeout, check=False)
    if process.returncode != code:
        raise AssertionError(f"{words}: exit code {process.returncode}\n{process.stdout}\n{process.stderr}")
    return process.stdout


def job(out, *more):
    return ["run", Job.scene / "capture/raw", "-o", out, "--poses", Job.scene / "truth/sparse", *ALL, *more]


def plys(out):
    folders = ("start", "clouds", "export")
    return {p.relative_to(out): p.read_bytes() for f in folders for e in ("ply", "spz")
            for p in sorted((out / f).glob(f"*.{e}"))}


def log_without_times(out):
    return [{k: v for k, v in json.loads(line).items() if k != "seconds"}
            for line in (out / "log.jsonl").read_text().splitlines()]


class Job(unittest.TestCase):
    maxDiff = None

    @classmethod
    def setUpClass(cls):
        holder = tempfile.TemporaryDirectory(prefix="flashsplat-e2e-")
        cls.addClassCleanup(holder.cleanup)
        Job.dir = pathlib.Path(holder.name)
        Job.scene, Job.out = Job.dir / "scene", Job.dir / "out"
        run("synth", "-o", Job.scene, "--photos", 14, "--held-out", 3, "--width", 240, "--height", 160, "--seed", 5)
        begin = time.time()
        Job.log = run(*job(Job.out, "--threads", 2))
        Job.seconds = time.time() - begin

    def test_quality(self):
        held_out = self.dir / "held_out"
        run("render", self.out, "--cameras", self.scene / "truth/sparse", "-o", held_out)
        run("evaluate", self.out, self.scene / "truth", "--output", held_out, "--json", self.dir / "figures.json")
        figures = json.loads((self.dir / "figures.json").read_text())
        layers = figures["methods"]["flashsplat"]["layers"]
        reached = {layer: round(layers[layer]["psnr_gain"], 2) for layer in LEAST}
        print(reached, file=sys.stderr)
        for layer, least in LEAST.items():
            self.assertGreater(reached[layer], least, layer)
            self.assertEqual(layers[layer]["n"], 3)

    def test_mesh(self):
        """The mesh lies on the true surface: median 36 mm when this was written, of voxels of 25 mm."""
        copy = shutil.copytree(self.out, self.dir / "meshed")
        run("export", copy, "--formats", "mesh")
        measure = pathlib.Path(__file__).resolve().parents[2] / "bench/mesh_distance.py"
        text = subprocess.run(["/usr/bin/python3", measure, copy / "export/T_N.mesh.ply", self.scene / "truth"],
                              check=True, stdout=subprocess.PIPE, text=True, timeout=120).stdout
        print(text, file=sys.stderr)
        self.assertLess(float(re.search(r"median ([0-9.]+)", text)[1]), 0.06)
        self.assertGreater(int(text.split()[0]), 4000)

    def test_estimate(self):
        said = re.search(r"(?m)^estimate: 14 photos as 208 x 139 pixels: about (\d+):(\d\d) \(.* and 0\.\d GB", self.log)
        self.assertIsNotNone(said, self.log)
        estimate = 60 * int(said[1]) + int(said[2])
        print(f"estimate {estimate} s, took {self.seconds:.0f} s", file=sys.stderr)
        self.assertTrue(self.seconds / 4 < estimate < 4 * self.seconds)  # other programs may run beside it
        self.assertFalse((self.out / ".flashsplat/estimate").exists())

    def test_same_bits_for_any_number_of_threads(self):
        out = self.dir / "one_thread"
        run(*job(out, "--threads", 1))
        self.assertGreaterEqual(len(plys(out)), 6)
        self.assertEqual(plys(out).keys(), plys(self.out).keys())
        for name, data in plys(out).items():
            self.assertTrue(data == plys(self.out)[name], f"{name} differs")

    def test_done_stages_are_skipped(self):
        copy = shutil.copytree(self.out, self.dir / "copy")
        text = run(*job(copy))
        for stage in ("ingest", "poses", "initialise", "train", "render", "export"):
            self.assertRegex(text, rf"(?m)^{stage}: .*skipped")
        run("render", copy, "--cameras", copy / "sparse")  # other pictures in the stage's place
        self.assertFalse((copy / "done/render.json").exists())
        self.assertNotRegex(run(*job(copy)), r"(?m)^render: .*skipped")
        text = run("export", copy, "--force")
        self.assertNotIn("skipped", text)
        self.assertEqual(plys(copy), plys(self.out))
        text = run("train", copy, *TRAIN, "--steps", 3)
        self.assertIn("the setting steps was 300 and is 3 now", text)
        self.assertFalse((copy / "done/render.json").exists())
        self.assertFalse((copy / "done/export.json").exists())

    def test_whole_numbers_on_the_page(self):
        out = self.dir / "seeded"
        run("run", Job.scene / "capture/raw", "-o", out, "--poses", Job.scene / "truth/sparse", "--steps", 3, "--init-count", 300,
            "--long-edge", 96, "--seed", 20261125)
        self.assertIn("20261125", (out / "index.html").read_text())

    def test_says_what_it_does_not_look_for(self):
        for what in ("the mirror image of who takes the photos", "bars before the glass", "who walks by"):
            self.assertRegex(self.log, rf"does not look for {what}.*: that wants \d+ (steps|photos)")

    def test_run_names_the_files_to_open(self):
        opened = self.log[self.log.index("Open these:"):]
        paths = re.findall(r"(?m)^  (\S+)", opened)
        self.assertGreaterEqual(len(paths), 4)
        for path in paths:
            self.assertTrue(pathlib.Path(path).exists(), path)

    def test_info(self):
        text = run("info", self.out)
        for stage in ("ingest", "poses", "initialise", "train", "render", "export"):
            self.assertRegex(text, rf"(?m)^  {stage} +done")

    def test_damaged_project(self):
        """What an earlier stage left is damaged: one line names the file, nothing crashes, the rest is kept."""
        cases = (("views.json", "render"), ("views.json", "train"), ("clouds/T_N.ply", "render"),
                 ("clouds/R.ply", "export"),
                 ("clouds/model.json", "render"), ("start/R.ply", "train"), ("start/model.json", "train"),
                 ("images/IMG_0001.tif", "train"), ("images/IMG_0001_mask.png", "train"),
                 ("sparse/points3D.txt", "initialise"), ("checkpoint/state.json", "train --resume"),
                 ("checkpoint/T_N_m.ply", "train --resume"), ("checkpoint/T_N_neighbours.bin", "train --resume"))
        for name, words in cases:
            copy = self.dir / "damaged"
            shutil.copytree(self.out, copy)
            data = (copy / name).read_bytes()
            stage, *options = words.split()
            options += TRAIN if stage == "train" else []
            for damaged in (b"", data[:len(data) // 2], b"\xff" * len(data)):
                (copy / name).write_bytes(damaged)
                process = subprocess.run(command(stage, copy, "--force", *options), capture_output=True, text=True,
                                         timeout=600, check=False)
                with self.subTest(name=name, words=words, size=len(damaged)):
                    self.assertEqual(process.returncode, 1, process.stdout + process.stderr)
                    line = next(l for l in process.stderr.splitlines() if l.startswith("flashsplat: "))
                    self.assertIn(str(copy / pathlib.Path(name).parts[0]), line)
                    if name == "views.json" or name.startswith(("clouds/", "start/")):
                        self.assertIn("--force` makes it again", line)
            shutil.rmtree(copy)

    def interrupted(self, out, how):
        """A training that `how` ends after its first checkpoint, then is taken up again."""
        shutil.copytree(self.out, out, ignore=shutil.ignore_patterns("checkpoint", "clouds", "export", "renders"))
        (out / "done/train.json").unlink()
        train = ["train", out, *TRAIN, "--checkpoint-every", 20, "--progress-every", 0]
        process = subprocess.Popen(command(*train), stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True)
        deadline = time.monotonic() + 300
        while not (out / "checkpoint").exists() or not list((out / "checkpoint").iterdir()):
            if process.poll() is not None:
                self.fail("training ended before its first checkpoint: " + process.communicate()[0])
            self.assertLess(time.monotonic(), deadline)
            time.sleep(0.02)
        time.sleep(0.05)
        process.send_signal(how)
        output, _ = process.communicate(timeout=120)
        self.assertFalse((out / "done/train.json").exists(), output)
        text = run(*train, "--resume")
        self.assertRegex(text, r"step \d+")
        for name, data in plys(self.out).items():
            if name.parts[0] == "clouds":
                self.assertTrue(data == (out / name).read_bytes(), f"{name} differs")
        self.assertEqual(log_without_times(out), log_without_times(self.out))
        return process.returncode

    def test_ctrl_c_and_resume(self):
        self.assertEqual(self.interrupted(self.dir / "ctrl_c", signal.SIGINT), 130)

    def test_kill_and_resume(self):
        self.assertEqual(self.interrupted(self.dir / "killed", signal.SIGKILL), -9)


unittest.main(module="__main__", verbosity=2)
