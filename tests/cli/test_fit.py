"""What a machine is asked for: training that fits into --minutes, and memory that is not there."""
import json
import os
import pathlib
import re
import resource
import shutil

import common
import pictures
from common import FolderTest, run

START = ["--long-edge", 96, "--init-count", 2500, "--threads", 1]
TRAIN = ["--threads", 1, "--progress-every", 0]
PIXELS = 6e6  # of a photo of the tests of memory; each takes 16 bytes of them
PHOTOS = int(os.sysconf("SC_PHYS_PAGES") * os.sysconf("SC_PAGE_SIZE") / (16 * PIXELS)) + 10


class Fit(FolderTest):
    @classmethod
    def setUpClass(cls):
        made = cls.shared_folder()
        cls.scene, cls.start = made / "scene", made / "start"
        poses = ["--poses", cls.scene / "truth/sparse"]
        stages = (["synth", "-o", cls.scene, "--width", 96, "--height", 64, "--photos", 6, "--held-out", 1, "--seed", 5],
                  ["ingest", cls.scene / "capture/raw", "-o", cls.start, "--long-edge", 96],
                  ["poses", cls.start, *poses], ["initialise", cls.start, *START[2:]])
        for words in stages:
            cls.assert_works(run(*words))
            if words[0] == "synth":
                pictures.give_points(cls.scene / "truth")
        cls.poses = poses

    def steps_said(self, process, words):
        self.assert_works(process)
        said = re.search(words, process.stdout)
        self.assertIsNotNone(said, process.stdout)
        return int(said[1])

    def least_minutes(self, *words):
        process = run(*words, "--minutes", 1e-4)
        self.assert_fails(process, 1, "--minutes 0.0001", "no more than 300 steps", "--long-edge")
        return float(re.search(r"take ([\d.]+) minutes", process.stderr)[1])

    def test_training_fits(self):
        out = self.dir / "out"
        shutil.copytree(self.start, out)
        train = ["train", out, *TRAIN]
        for _ in range(5):  # other programs may come and go between the two
            minutes = 3 * self.least_minutes(*train)
            process = run(*train, "--minutes", minutes, "--force")
            if process.returncode == 0 and "train: 6800 steps" not in process.stdout:
                break
        train += ["--minutes", minutes]
        steps = self.steps_said(process, r"train: (\d+) steps in about \d+:\d\d, by --minutes")
        self.assertTrue(300 <= steps < 6800, steps)
        mark = json.loads((out / "done/train.json").read_text())
        self.assertEqual(mark["settings"]["steps"], steps)

        for same in (train, train + ["--resume"], train[:-2] + ["--steps", steps]):  # however fast it is by now
            self.assertIn("train: done already", run(*same).stdout)
        (out / "done/train.json").unlink()
        self.assertEqual(self.steps_said(run(*train, "--resume"), r"from the checkpoint at step (\d+)"), steps)
        self.assert_fails(run(*train, "--resume", "--dssim", 0.3), 1, "the setting dssim was 0 and is 0.3 now")
        self.least_minutes(*train[:-2])  # other minutes are another training

    def test_run_fits(self):
        job = ["run", self.scene / "capture/raw", "-o", self.dir / "out", *self.poses, *START, "--max-splats", 2500,
               "--progress-every", 0]
        self.assertGreater(self.least_minutes(*job), 0.01)
        self.assertFalse((self.dir / "out/linear").exists())
        process = run(*job, "--minutes", 30, timeout=500)  # never more than the preset's
        self.assertEqual(self.steps_said(process, r"estimate: .* for (\d+) steps"), 6800)
        self.assertEqual(self.steps_said(process, r"train: (\d+) steps in about"), 6800)
        again = [*job, "--long-edge", 80, "--steps", 200]  # what is done anew is said anew
        self.assertEqual(self.steps_said(run(*again), r"estimate: .* as 80 x 53 pixels.* for (\d+) steps"), 200)
        self.assertNotIn("estimate", run(*again).stdout)
        again[-1] = 210
        self.assertEqual(self.steps_said(run(*again), r"estimate: .*ingest 0:00, poses 0:00, .* for (\d+) steps"), 210)

    def test_estimate_of_what_is_to_be_done(self):
        photos = self.dir / "photos"
        shutil.copytree(self.scene / "capture/raw", photos)
        job = ["run", photos, "-o", self.dir / "out", *START, "--max-splats", 2500, "--steps", 200]
        self.assertIn("estimate: ", run(*job, *self.poses).stdout)
        other = shutil.copytree(self.scene / "truth/sparse", self.dir / "model")
        self.assertNotIn("estimate: ", run(*job, "--poses", other).stdout)  # the same one, elsewhere
        with open(photos / "IMG_0002.DNG", "r+b") as f:
            f.seek(-20, os.SEEK_END)
            f.write(b"other pixels")
        self.assertIn("estimate: ", run(*job, *self.poses).stdout)

    def test_minutes_gone_by_training(self):
        out = self.dir / "out"
        shutil.copytree(self.start, out)
        photos = self.scene / "capture/raw"
        photos.rename(self.scene / "gone")  # so that no estimate comes first
        self.addCleanup((self.scene / "gone").rename, photos)
        process = run("run", photos, "-o", out, *self.poses, *START, "--minutes", 1e-3)
        self.assertEqual(self.steps_said(process, r"train: (\d+) steps in about"), 300)
        for text in (process.stderr, (out / "warnings/train.txt").read_text(), (out / "index.html").read_text()):
            self.assertIn("--minutes 0.001", text)

    def test_minutes_or_steps(self):
        for words in (["--minutes", 1, "--steps", 500], ["--steps", 500, "--minutes", 1]):
            self.assert_fails(run("train", self.start, *words), 2, "--minutes and --steps")
        self.assert_fails(run("train", self.start, "--minutes", -1), 2, "--minutes")

    def test_memory_of_a_run(self):
        photos = self.dir / "photos"
        photos.mkdir()
        (photos / "0.png").write_bytes(pictures.png_of_rows(3000, 2000, [b"\x40" * 9000] * 2000))
        for i in range(1, PHOTOS):
            os.link(photos / "0.png", photos / f"{i}.png")
        process = run("run", photos, "-o", self.dir / "out", "--long-edge", 0)
        self.assert_fails(process, 1, f"{PHOTOS} photos at 3000 pixels", "GB of memory", "--long-edge")
        self.assertFalse((self.dir / "out/linear").exists())

    def test_memory_of_training(self):
        out = self.dir / "out"
        shutil.copytree(self.start, out)
        views = json.loads((out / "views.json").read_text())
        first = views["views"][0] | {"width": 3000, "height": 2000, "held_out": False}
        views["views"] = [first | {"name": f"photo_{i:06}"} for i in range(PHOTOS)]
        (out / "views.json").write_text(json.dumps(views))
        self.assert_fails(run("train", out, *TRAIN), 1, f"{PHOTOS} photos at 3000 pixels", "GB of memory")
        self.assertFalse((out / "clouds").exists())

    def test_memory_of_a_container(self):
        """Less than the machine has."""
        if b"__asan_init" in pathlib.Path(common.PROGRAM).read_bytes():
            self.skipTest("the sanitizer asks for more than that")
        limit = lambda: resource.setrlimit(resource.RLIMIT_AS, (1500 << 20, 1500 << 20))
        process = run("train", self.start, *TRAIN, "--max-splats", 4000000, preexec_fn=limit)
        self.assert_fails(process, 1, "GB of memory, there are 1.6", "--max-splats")


common.main()
