"""Nobody's files are lost, and results are what their settings say: every layout of folders, links, foreign files with
our names, edited results, interruptions; other photos, models and settings, with and without --resume."""
import contextlib
import hashlib
import json
import os
import pathlib
import random
import shutil
import signal
import subprocess
import time

import common
from common import FolderTest, run
from pictures import give_points

QUICK = ["--long-edge", 96, "--steps", 6, "--init-count", 300, "--max-splats", 400, "--checkpoint-every", 2,
         "--threads", 1]
TRAIN = QUICK[2:4] + QUICK[6:]


def look(path):
    """What a file, folder or link is: its mode, and its content or where it points."""
    mode = os.lstat(path).st_mode
    if path.is_symlink():
        return mode, os.readlink(path)
    return mode, hashlib.sha256(path.read_bytes()).hexdigest() if path.is_file() else None


def contents(folder):
    return {p: look(p) for p in sorted(folder.rglob("*")) if ".flashsplat" not in p.parent.parts}


def clouds(out):
    return {str(p.relative_to(out)): look(p)[1] for d in ("start", "clouds") for p in sorted((out / d).iterdir())
            if p.suffix in (".ply", ".json")}


class Layouts(FolderTest):
    @classmethod
    def setUpClass(cls):
        cls.made = cls.shared_folder()
        cls.scene, cls.done = cls.made / "scene", cls.made / "done"
        for seed, name in ((5, "scene"), (6, "other")):
            cls.assert_works(run("synth", "-o", cls.made / name, "--width", 96, "--height", 64, "--photos", 6, "--held-out", 1,
                                 "--seed", seed))
        give_points(cls.scene / "truth")
        cls.assert_works(run("run", cls.scene / "capture/raw", "-o", cls.done, "--poses", cls.scene / "truth/sparse", *QUICK))

    def setUp(self):
        super().setUp()
        self.photos, self.model, self.out = self.dir / "photos", self.dir / "model", self.dir / "out"
        shutil.copytree(self.scene / "capture/raw", self.photos)
        shutil.copytree(self.scene / "truth/sparse", self.model)
        (self.photos / "IMG_0001.DNG").chmod(0o444)
        self.users = {}

    def job(self, *more, photos=None, out=None, model=None, **options):
        return run("run", photos or self.photos, "-o", out or self.out, "--poses", model or self.model, *QUICK, *more,
                   **options)

    def keep(self, but=None):
        """All that is there now is the user's, but what is in a project of ours."""
        self.users = {p: was for p, was in contents(self.dir).items() if but is None or not p.is_relative_to(but)}

    def kept(self):
        for path, was in self.users.items():
            self.assertTrue(os.path.lexists(path), f"{path} is lost")
            self.assertEqual(look(path), was, path)

    def works(self, process, out=None):
        self.assert_works(process)
        self.kept()
        if out is not False:
            self.assertEqual(clouds(out or self.out), clouds(self.done))

    def refuses(self, process, *words):
        self.assert_fails(process, 1, *words)
        self.kept()

    def copy(self):
        """A finished project of our own."""
        return pathlib.Path(shutil.copytree(self.done, self.out, symlinks=True))

    def put(self, path, text="mine"):
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text(text)
        return path

    # ---- photos and results ----

    def test_colmap_layout(self):
        scene = self.dir / "scene"
        scene.mkdir()
        self.photos.rename(scene / "images")
        self.model.rename(scene / "sparse")
        self.keep()
        self.refuses(run("run", "images", "-o", ".", "--poses", "sparse", *QUICK, cwd=scene), "images", "results")
        self.assertEqual(sorted(p.name for p in scene.iterdir()), ["images", "sparse"])
        self.works(run("run", "images", "-o", "out", "--poses", "sparse", *QUICK, cwd=scene), scene / "out")

    def test_model_where_ours_goes(self):
        (self.out / "sparse").mkdir(parents=True)
        self.model.rename(self.out / "sparse/0")
        self.keep()
        for model in (self.out / "sparse", self.out / "sparse/0"):
            self.refuses(self.job(model=model), model)
        (self.out / "sparse/0").rename(self.out / "mine")
        self.keep()
        self.works(self.job(model=self.out / "mine"))
        self.works(self.job("--force", model=self.out / "mine"))

    def test_one_folder_for_photos_and_results(self):
        self.keep()
        for more in ([], ["--force"], ["--steps", 6]):
            self.works(self.job(*more, out=self.photos), self.photos)
        self.assertIn("train: done already", self.job(out=self.photos).stdout)  # sheet.png is no photo

    def test_results_in_photos_and_photos_in_results(self):
        self.keep()
        self.works(self.job(out=self.photos / "out"), self.photos / "out")
        self.photos.rename(self.dir / "scene")
        inside = self.out / "photos"
        self.out.mkdir()
        shutil.copytree(self.dir / "scene", inside, ignore=shutil.ignore_patterns("out"))
        self.users = contents(self.out)
        self.works(self.job(photos=inside))
        self.works(self.job("--force", photos=inside))

    def test_photos_where_results_go(self):
        for name in ("linear", "linear/features", "images", "renders/T_N", "progress", ".flashsplat"):
            folder = self.out / name
            folder.parent.mkdir(parents=True, exist_ok=True)
            shutil.copytree(self.scene / "capture/jpeg", folder)
            self.keep()
            process = self.job(photos=folder)
            with self.subTest(name=name):
                self.refuses(process, self.out / name.split("/", maxsplit=1)[0])
                self.assertFalse((self.out / "done").exists())
            shutil.rmtree(self.out)

    def test_foreign_files_that_collide(self):
        """Each is found before anything is touched."""
        names = ("ingest.json", "linear/IMG_0001.tif", "linear/IMG_0002_mask.png", "linear/features/IMG_0003.png",
                 "views.json", "images/IMG_0001.tif", "sparse/cameras.txt", "sparse/images.bin", "start/R.ply",
                 "start/transmitted.ply", "clouds/T_N.ply", "clouds/model.json", "log.jsonl", "progress/00500.png",
                 "checkpoint/state.json", "checkpoint.old/T_N.ply", "renders/R/IMG_0001.png", "sheet.png",
                 "export/T_N.ply", "index.html", "report/1_photo.jpg", "warnings/poses.txt", "done/train.json",
                 "video/T.mp4")
        for name in names:
            self.put(self.out / name)
            self.keep()
            with self.subTest(name=name):
                self.refuses(self.job(), self.out / name)
                self.assertEqual([p for p in self.out.rglob("*") if p.is_file() and ".flashsplat" not in p.parts],
                                 [self.out / name])
            shutil.rmtree(self.out)
        self.put(self.out / ".flashsplat")
        self.keep()
        self.refuses(self.job(), ".flashsplat")
        for name in ("linear", "start", "renders"):  # a file where a folder must be
            self.out = self.dir / name
            self.put(self.out / name)
            self.keep()
            self.refuses(self.job(), self.out / name)

    def test_foreign_files_that_do_not_collide(self):
        for folder in ("", "linear", "linear/features", "images", "sparse", "start", "clouds", "progress", "renders",
                       "renders/T_N", "renders/mine", "export", "report", "video", "done", "warnings", "path"):
            for name in ("notes.md", "holiday.jpeg", ".hidden", "mask.gif"):
                self.put(self.out / folder / name)
        self.keep()
        for more in ([], ["--force"]):
            self.works(self.job(*more))
        self.works(run("render", self.out, "--force", "--video", "--path-views", 2), False)

    def test_links(self):
        real, target = self.dir / "real", self.dir / "users"
        real.mkdir()
        self.put(target / "IMG_0001.tif")
        self.out.symlink_to(real)
        for path in list(self.photos.iterdir())[:3]:  # a photo that is a link
            path.rename(target / path.name)
            path.symlink_to(target / path.name)
        self.keep()
        self.works(self.job())
        self.works(self.job("--force"))
        for name in ("linear", "linear/features", "images", "renders/T_N", "start", "checkpoint", "export", "progress",
                     "report", "warnings", "done"):
            shutil.move(self.out / name, self.dir / "moved")
            (self.out / name).symlink_to(target)
            self.keep()
            with self.subTest(name=name):
                self.refuses(self.job("--force"), self.out / name)
            (self.out / name).unlink()
            shutil.move(self.dir / "moved", self.out / name)
        (self.out / "sheet.png").unlink()
        (self.out / "sheet.png").symlink_to(target / "IMG_0001.tif")
        self.keep()
        self.refuses(self.job("--force"), self.out / "sheet.png")

    # ---- results that were touched, copied, or are of others ----

    def test_edited_results(self):
        self.copy()
        for name in ("renders/T_N/IMG_0001.png", "start/R.ply", "views.json", "linear/IMG_0001.tif", "export/T_N.ply",
                     "clouds/R.ply", "log.jsonl", "index.html", "done/ingest.json"):
            path = self.out / name
            was, times = path.read_bytes(), (path.stat().st_atime_ns, path.stat().st_mtime_ns)
            path.write_bytes(bytes([was[0] ^ 1]) + was[1:])  # the same size
            os.utime(path, ns=times)  # and time
            self.keep()
            with self.subTest(name=name):
                self.refuses(self.job("--force"), path)
            path.write_bytes(was)
        self.users = {}
        self.works(self.job("--force"))

    def test_copies_without_times(self):
        shutil.copytree(self.done, self.out, copy_function=shutil.copyfile)
        self.works(self.job("--force"))

    def test_older_versions(self):
        shutil.rmtree(self.copy() / ".flashsplat")
        for path in (self.out / "done").iterdir():
            mark = json.loads(path.read_text())
            del mark["inputs"]
            path.write_text(json.dumps(mark))
        self.keep()
        for more in ([], ["--force"]):
            self.refuses(self.job(*more), self.out / "done", "folder")
        self.refuses(run("train", self.out, *TRAIN), self.out / "done")
        self.works(run("render", self.out, "-o", self.dir / "renders"), False)

    def test_folders_of_others(self):
        self.copy()
        self.keep()
        self.refuses(run("render", self.out, "-o", self.scene / "truth"), self.scene / "truth")
        self.refuses(self.job(out=self.scene / "capture"), self.scene / "capture")
        mine = self.put(self.dir / "pictures/R/IMG_0002.png")
        self.keep(self.out)
        self.refuses(run("render", self.out, "-o", self.dir / "pictures"), mine)
        self.assertEqual(list((self.dir / "pictures").rglob("*.png")), [mine])
        mine.rename(mine.with_name("mine.png"))
        self.keep(self.out)
        for _ in range(2):
            self.works(run("render", self.out, "-o", self.dir / "pictures"), False)
        self.works(run("render", self.out, "-o", self.out / "more/pictures"), False)

    def test_synth(self):
        for name in ("capture/raw/IMG_0001.DNG", "capture/mine.jpg", "truth/T_N/IMG_0001.png", "truth/notes.txt"):
            path = self.put(self.dir / "scene" / name)
            self.keep()
            self.refuses(run("synth", "-o", self.dir / "scene", "--photos", 2, "--width", 32, "--height", 32), path)
            shutil.rmtree(self.dir / "scene")
        scene = pathlib.Path(shutil.copytree(self.scene, self.dir / "scene"))
        (scene / "truth/sparse/images.txt").unlink()  # by give_points
        (scene / "truth/sparse/points3D.txt").unlink()
        self.put(scene / "notes.txt")
        self.users = {scene / "notes.txt": look(scene / "notes.txt")}
        self.works(run("synth", "-o", scene, "--photos", 4, "--width", 32, "--height", 32), False)
        self.assertEqual(len(list((scene / "capture/raw").iterdir())), 4)

    def test_two_synths_at_once(self):
        words = ["synth", "-o", self.dir / "scene", "--photos", 6, "--width", 600, "--height", 400]
        with subprocess.Popen([str(w) for w in [common.PROGRAM, *words]], stdout=subprocess.DEVNULL,
                              stderr=subprocess.DEVNULL) as first:
            while not list((self.dir / "scene").glob("truth/T_N/*")) and first.poll() is None:
                time.sleep(0.05)
            first.send_signal(signal.SIGSTOP)
            try:
                self.refuses(run(*words), self.dir / "scene", "another flashsplat")
            finally:
                first.send_signal(signal.SIGCONT)
            self.assertEqual(first.wait(), 0)
        self.works(run(*words[:3], "--photos", 4, "--width", 32, "--height", 32), False)

    def test_root(self):
        """Of all folders: refused for that, before it is seen that there are no photos."""
        for place in ("/", "//", "/.", f"{self.dir}/{'../' * len(self.dir.parts)}"):
            self.refuses(run("ingest", self.dir / "none", "-o", place), "root of all folders")
            self.refuses(run("render", self.dir / "none", "-o", place), "none")

    def test_refused(self):
        """Nothing is left of folders that were made for it, and what was there before stays."""
        (self.dir / "there").mkdir()
        self.keep()
        for place in ("a/b/c", "a//b/./c/", "there/b/c", "a/../b/c", "there"):
            self.refuses(run("ingest", self.dir / "none", "-o", self.dir / place), "none")
            self.refuses(self.job("--masks", self.dir / "none", out=self.dir / place), "none")
            self.refuses(run("ingest", self.photos, "-o", self.dir / place / ("n" * 300)), "n" * 300)
            self.assertEqual(contents(self.dir).keys(), self.users.keys())
            process = run("ingest", "none", "-o", place, cwd=self.dir)
            self.refuses(process, "none")
            self.assertEqual(contents(self.dir).keys(), self.users.keys())

    def test_single_files(self):
        flash, other = sorted(self.photos.iterdir())[:2]
        path = self.put(self.dir / "figures.json")
        picture = self.put(self.dir / "difference.tif").with_suffix(".png")
        self.copy()
        self.keep()
        self.refuses(run("pair", flash, other, "-o", picture, "--linear"), picture.with_suffix(".tif"))
        self.assertFalse(picture.exists())
        self.works(run("pair", flash, other, "-o", picture), False)
        again = "user.flashsplat" in os.listxattr(picture)  # else the disk cannot tell whose it is
        for _ in range(2 * again):
            self.works(run("pair", flash, other, "-o", picture), False)
        for more in ([], ["--linear"]):  # ours, but not of pair
            inside = self.out / "renders/T_N/IMG_0001.png"
            was = inside.read_bytes()
            self.assert_fails(run("pair", flash, other, "-o", inside, *more), 1, inside, "in the way", "pair")
            self.assertEqual(inside.read_bytes(), was)
        shutil.copy(picture, self.put(self.dir / "pair.png"))
        self.refuses(run("pair", flash, other, "-o", self.dir / "pair.png"), self.dir / "pair.png")
        for _ in range(2 * again):
            self.works(run("pair", flash, other, "-o", self.out / "mine.png", "--linear"), False)
        self.put(picture)
        self.keep(self.out)
        self.refuses(run("pair", flash, other, "-o", picture), picture)
        self.refuses(run("bench", "--json", path, "--cases", "adam"), path)
        evaluate = ["evaluate", self.out, self.scene / "truth", "--views", "capture"]
        self.refuses(run(*evaluate, "--json", path), path)
        for _ in range(2):
            self.works(run(*evaluate, "--json", self.out / "figures.json"), False)

    def test_photos_of_one_lighting(self):
        """Enough for what uses one lighting."""
        for view in json.loads((self.scene / "truth/cameras.json").read_text())["images"]:
            if not view["flash"] and not view["held_out"]:
                (self.photos / f"{view['name']}.DNG").unlink()
        self.keep()
        self.refuses(self.job(), "only flash photos")
        for more in (["--separation", "none"], ["--lighting", "flash"]):
            self.assert_works(self.job(*more))

    # ---- interruptions ----

    def test_killed_and_run_again(self):
        """What a stage left when it was killed is ours: nothing is in the way of the next run."""
        rng = random.Random(7)
        self.put(self.out / "linear/notes.txt")
        self.keep()
        words = [common.PROGRAM, "run", self.photos, "-o", self.out, "--poses", self.model, *QUICK]
        for kill in range(12):
            process = subprocess.Popen([str(w) for w in words + (["--force"] if kill % 3 else [])],
                                       stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True)
            time.sleep(rng.uniform(0.02, 1.5))
            process.send_signal(signal.SIGKILL)
            output = process.communicate()[0]
            self.assertNotIn("in the way", output)
            self.kept()
        self.works(self.job())
        self.assertEqual([p for p in self.out.rglob("*") if ".part" in p.name], [])

    def test_stopped_with_its_reader(self):
        """Ctrl-C reaches `tee`, too: nobody reads any more when the checkpoint is saved."""
        words = ["run", self.photos, "-o", self.out, "--poses", self.model, *QUICK, "--steps", 10**6]
        words[words.index("--checkpoint-every") + 1] = 10**6
        process = subprocess.Popen([common.PROGRAM, *map(str, words)], stdout=subprocess.PIPE,
                                   stderr=subprocess.STDOUT, text=True)
        for line in process.stdout:
            if line.startswith("train: photos of") or "/1000000" in line:
                break
        process.send_signal(signal.SIGINT)
        process.stdout.close()
        self.assertEqual(process.wait(timeout=60), 130)
        self.assertTrue((self.out / "checkpoint/state.json").exists())

    def test_two_at_once(self):
        """The second one is told so and touches nothing; one that was killed is in nobody's way."""
        words = [common.PROGRAM, "run", self.photos, "-o", self.out, "--poses", self.model, *QUICK, "--steps", 10**6]
        self.keep()
        with subprocess.Popen([str(w) for w in words], stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL) as first:
            try:
                while not (self.out / "checkpoint").exists() and first.poll() is None:
                    time.sleep(0.1)
                for second in (self.job(), run("train", self.out, *TRAIN), run("ingest", self.photos, "-o", self.out)):
                    self.refuses(second, self.out, "another flashsplat")
                self.assert_works(run("info", self.out))
                self.assertIsNone(first.poll())
            finally:
                first.kill()
        self.works(self.job())
        (self.out / ".flashsplat/lock").unlink()
        self.works(self.job())

    def test_render_beside_another(self):
        """Views may be had while another program trains, but not into what is the project's own."""
        self.copy()
        shutil.rmtree(self.out / "checkpoint")  # of the finished training: the next one's says that it is at work
        views = ["--cameras", self.scene / "truth/cameras.json", "--layers", "R"]
        with subprocess.Popen([str(w) for w in (common.PROGRAM, "train", self.out, *TRAIN, "--steps", 10**6)],
                              stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL) as first:
            try:
                while not (self.out / "checkpoint").exists() and first.poll() is None:
                    time.sleep(0.1)
                self.assert_fails(run("render", self.out, "-o", self.out / "renders", *views), 1, "another flashsplat")
                self.assert_works(run("render", self.out, "-o", self.dir / "views", *views))
                self.assertIsNone(first.poll())
            finally:
                first.kill()

    # ---- results are what their settings say ----

    def test_renders_where_other_results_are(self):
        self.copy()
        self.keep()
        for name in ("images", "clouds/new", "./start/../linear"):
            self.refuses(run("render", self.out, "-o", self.out / name), "is where other results go")
        self.works(run("render", self.out, "-o", self.out / "renders/more"))

    def test_lost_working_image(self):
        """It is told before what was made of it goes."""
        self.copy()
        (self.out / "linear/IMG_0002.tif").unlink()
        self.keep()
        job = self.job(photos=self.scene / "capture/raw", model=self.scene / "truth/sparse")
        self.refuses(job, "linear/IMG_0002.tif: is missing", "flashsplat ingest")

    def test_damaged_light_of_photos(self):
        self.copy()
        self.put(self.out / "clouds/photos.json", "{")
        for words in (["render", self.out], ["export", self.out, "--clean", "jpeg"]):
            self.refuses(run(*words), "clouds/photos.json", f"flashsplat train {self.out} --force")

    def test_lost_list_of_ours(self):
        self.copy()
        (self.out / ".flashsplat/made").unlink()
        (self.out / ".flashsplat/colmap").mkdir(exist_ok=True)
        page = self.put(self.out / "index.html")
        self.job()
        self.assertEqual(page.read_text(), "mine")

    def test_changed_settings(self):
        self.copy()
        more = ["train", self.out, *TRAIN, "--dssim", 0.5]
        process = run(*more, "--resume")
        self.assert_fails(process, 1, self.out / "checkpoint", "the setting dssim was 0 and is 0.5 now",
                          "without --resume")
        self.assertEqual(clouds(self.out), clouds(self.done))
        self.assertNotIn('"dssim": 0.5', (self.out / "done/train.json").read_text())
        self.assert_fails(run("train", self.out, *TRAIN, "--lighting", "flash", "--resume"), 1,
                          "the setting lighting was both and is flash now")  # of fewer photos, too
        self.assert_works(run(*more))
        self.assertNotEqual(clouds(self.out), clouds(self.done))
        mark = json.loads((self.out / "done/train.json").read_text())
        self.assertEqual(mark["settings"]["dssim"], 0.5)
        self.assertNotEqual(mark["settings"]["cpu"], "best")
        if mark["settings"]["cpu"] != "scalar":
            self.assert_fails(run(*more, "--resume", "--cpu", "scalar"), 1, "the setting cpu was")
        self.assert_works(run(*more, "--resume"))  # nothing differs
        self.works(self.job())

    def test_changed_settings_of_the_stages_before(self):
        """The checkpoint does not go with what it began with."""
        self.copy()
        (self.out / "done/train.json").unlink()  # interrupted, after its last step
        self.keep(self.out)
        was = {p: look(p) for folder in ("checkpoint", "start", "done", "linear") for p in (self.out / folder).rglob("*")}
        for more, what in ((["--init-count", 301], "init-count was 300 and is 301"), (["--seed", 2], "seed was"),
                           (["--long-edge", 64], "long-edge was 96 and is 64")):
            self.refuses(self.job(*more, "--resume"), self.out / "checkpoint", what, "without --resume")
            self.assertEqual({p: look(p) for p in was}, was)
        process = self.job("--resume")
        self.assertIn("goes on from the checkpoint", process.stdout)
        self.works(process)
        self.assert_works(self.job("--init-count", 301))

    def test_renders_of_an_earlier_training(self):
        out = self.copy()
        self.assert_works(run("train", out, *TRAIN, "--dssim", 0.5))
        self.assert_fails(run("evaluate", out, self.scene / "truth", "--views", "all"), 1, "renders", "earlier")
        self.assertFalse((out / "evaluate.json").exists())
        self.assert_works(run("render", out))
        self.assert_works(run("evaluate", out, self.scene / "truth", "--views", "all"))
        self.assertIn("Against the truth", (out / "index.html").read_text())
        self.assert_works(run("train", out, *TRAIN, "--dssim", 0.4))
        self.assertFalse((out / "evaluate.json").exists())  # of the training before
        for path in sorted(out.rglob("*"), reverse=True):  # as in a copy: clouds may be older than what is made of them
            os.utime(path)
        self.assert_fails(run("evaluate", out, self.scene / "truth", "--views", "all"), 1, "renders", "earlier")
        process = run("render", out, "--layers", "R")
        self.assertIn("files of an earlier training", process.stdout)
        self.assertFalse((out / "renders/T_N").exists())
        self.assertNotIn("Against the truth", (out / "index.html").read_text())

    def test_clouds_of_an_earlier_training(self):
        """What is rendered, exported and measured is of the photos that are there now."""
        out, truth = self.copy(), self.scene / "truth"
        for words in (["ingest", self.photos, "-o", out, "--long-edge", 90], ["poses", out, "--poses", self.model],
                      ["initialise", out, "--init-count", 300]):
            self.assert_works(run(*words))
        self.assertTrue((out / "clouds/T_N.ply").exists())
        for words in (["render", out], ["export", out], ["evaluate", out, truth, "--views", "capture"]):
            self.assert_fails(run(*words), 1, "train was not done since initialise was", "flashsplat train")
        views = ["render", out, "--layers", "R", "--cameras", truth / "cameras.json", "-o", self.dir / "views"]
        self.assertIn("clouds of an earlier training", run(*views).stderr)

    def test_figures_stay_where_nothing_can_be_measured(self):
        out, truth = self.copy(), self.scene / "truth"
        self.assert_works(run("evaluate", out, truth, "--views", "capture"))
        self.assert_fails(run("evaluate", out, truth), 1, "no picture of the truth at held_out views")
        self.assertTrue((out / "done/evaluate.json").exists())

    def test_depths_in_another_unit(self):
        out, scale = self.copy(), "--metres-per-unit"
        self.assert_works(run("render", out, scale, 1, "--layers", "T_N,depth_T"))
        self.assert_works(run("render", out, scale, 1, "--layers", "T_N"))
        self.assertTrue(list(out.glob("renders/depth_T/*.png")))
        self.assert_works(run("render", out, scale, 3, "--layers", "R"))
        self.assertFalse((out / "renders/depth_T").exists())
        self.assertTrue(list(out.glob("renders/T_N/*.png")))

    def test_anew_is_anew(self):
        process = self.assert_works(run("train", self.copy(), *TRAIN, "--force", "--resume"))
        self.assertNotIn("goes on", process.stdout)

    def test_notes_beside_a_model(self):
        self.copy()
        self.put(self.model / "notes.txt")
        self.assertIn("poses: done already", self.job().stdout)

    def test_renders_elsewhere_of_an_earlier_training(self):
        """Layers of two trainings do not get into one folder; what was kept of one may be measured."""
        out, views = self.copy(), self.dir / "views"
        render = ["render", out, "-o", views, "--cameras", self.scene / "truth/cameras.json", "--layers"]
        evaluate = ["evaluate", out, self.scene / "truth", "--output", views, "--views", "capture"]
        self.assert_works(run(*render, "T_N,R"))
        self.put(views / "R/mine.png")
        self.assertNotIn("another training", run(*evaluate).stderr)
        self.assert_works(run("train", out, *TRAIN, "--dssim", 0.5))
        process = self.assert_works(run(*evaluate))
        self.assertIn(f"{views}: of another training than the clouds in {out}", process.stderr)
        self.assert_works(run(*render, "T_N"))
        self.assertEqual([p.name for p in (views / "R").iterdir()], ["mine.png"])
        self.assert_works(run(*render, "T_F"))  # of the same training: beside it
        self.assertTrue(list(views.glob("T_N/*.png")))
        self.assertNotIn("another training", run(*evaluate).stderr)

    def test_views_with_the_names_of_others(self):
        """Views that are not where the photos of their names are do not take their place."""
        out, model = self.copy(), json.loads((self.scene / "truth/cameras.json").read_text())
        names = [v["name"] for v in model["images"]]
        for view, name in zip(model["images"], names[3:] + names[:3]):
            view["name"] = name
        (self.dir / "moved.json").write_text(json.dumps(model))
        was = contents(out / "renders")
        for more in ([], ["-o", out / "renders"]):
            self.assert_fails(run("render", out, "--cameras", self.dir / "moved.json", *more), 1, "moved.json", "-o DIR")
        self.assertEqual(contents(out / "renders"), was)
        self.assertTrue((out / "done/render.json").exists())
        process = self.assert_works(run("render", out, "--cameras", self.dir / "moved.json", "-o", self.dir / "views", "--layers", "R"))
        self.assertIn("rendered as they are", process.stderr)

    def test_views_beside_the_photos(self):
        """Views of other names leave the stage done; those of the photos' own do not, nor do depths in another unit."""
        out, model = self.copy(), json.loads((self.scene / "truth/cameras.json").read_text())
        all_views, place = model["images"], self.dir / "beside.json"
        cases = ((lambda view: view["held_out"], [], True), (lambda view: view["held_out"], ["--video"], True),
                 (lambda view: True, [], False), (lambda view: view["held_out"], ["--metres-per-unit", 3], False))
        for chosen, more, done in cases:
            model["images"] = [view for view in all_views if chosen(view)]
            place.write_text(json.dumps(model))
            self.assertEqual(run("evaluate", out, self.scene / "truth", "--views", "capture").returncode, 0)
            process = run("render", out, "--cameras", place, *more)
            self.assertEqual(process.returncode, 0, process.stderr)
            self.assertRegex(run("info", out).stdout, f"(?m)render +{'done' if done else 'begun'}")
            self.assertFalse((out / "done/evaluate.json").exists())  # they may have been of the views before
            self.assertEqual("render: done already" in self.job().stdout, done)
        self.assertTrue((out / "renders/T_N/TEST_01.png").exists())

    @contextlib.contextmanager
    def read_only(self):
        """All that is there can only be read, by who is to be the program's user."""
        user = {}
        if os.geteuid() == 0:  # whom nothing is read-only to
            user["user"] = 65534
            self.dir.chmod(0o755)
        for path in [*self.dir.rglob("*")]:
            path.chmod(0o755 if path.is_dir() and user else 0o555 if path.is_dir() else 0o444)
        try:
            yield user
        except PermissionError:
            self.skipTest("the program is in a folder of root's")
        finally:
            for path in [*self.dir.rglob("*")]:
                path.chmod(0o755)

    def test_place_that_is_read_only(self):
        """It is told before anything is measured."""
        self.copy()
        truth = shutil.copytree(self.scene / "truth", self.dir / "truth")
        with self.read_only() as user:
            process = run("evaluate", self.out, truth, "--views", "capture", **user)
        self.assert_fails(process, 1, self.out / "evaluate.json", "cannot write")
        self.assertNotIn("T_N", process.stdout)

    def test_finished_and_read_only(self):
        """All is done, but the page cannot be written anew; what is still to be done cannot be."""
        out, was = self.copy(), (self.done / "index.html").read_bytes()
        views = shutil.copy(self.scene / "truth/cameras.json", self.dir)
        with self.read_only() as user:
            done = [self.job(**user), run("export", out, **user), run("info", out, **user), run("view", out, **user)]
            failed = [self.job("--dssim", 0.5, **user), run("render", out, "--layers", "R", **user),
                      run("render", out, "--cameras", views, **user)]
        for process in done:
            self.assertEqual(process.returncode, 0, process.stderr)
        for process in done[:2]:
            self.assertIn(f"{out} cannot be written to: the page stays as it is", process.stderr)
        for process in failed:
            self.assert_fails(process, 1, "cannot write")
        self.assertEqual((out / "index.html").read_bytes(), was)
        (out / "index.html").unlink()
        with self.read_only() as user:
            process = self.job(**user)
        self.assert_fails(process, 1, out, "cannot")

    def test_clouds_that_are_gone(self):
        """Are trained again; a page without them would be no result."""
        shutil.rmtree(self.copy() / "clouds")
        process = self.assert_works(self.job())
        self.assertIn("train: done again, what it wrote is gone", process.stdout)
        self.assertTrue((self.out / "clouds/T_N.ply").exists())
        self.assertIn("scene.js", (self.out / "index.html").read_text())

    def test_single_results_that_are_gone(self):
        """Are made again, as they were; what nobody would make again does not ask for more."""
        out, known = self.copy(), contents(self.done)
        for name, stage in (("renders/T_F/IMG_0002.png", "render"), ("sheet.png", "render"), ("export/T_N.spz", "export"),
                            ("renders/R_scene", "render")):
            gone = out / name
            shutil.rmtree(gone) if gone.is_dir() else gone.unlink()
            process = self.job()
            self.assertEqual(process.returncode, 0, process.stderr)
            self.assertIn(f"{stage}: done again, some of what it wrote is gone", process.stdout)
            for path in [gone, *gone.rglob("*")]:
                self.assertEqual(look(path), known[self.done / path.relative_to(out)])
            self.assertNotIn("done again", self.job().stdout)
        self.assertEqual(run("export", out, "--formats", "ply,glb").returncode, 0)
        (out / "export/T_N.glb").unlink()
        self.assertIn("export: done beside", self.job().stdout)
        self.assertNotIn("export: done again", self.job().stdout)
        self.assertTrue((out / "export/T_F.glb").exists())
        (out / "progress").rename(self.dir / "progress")
        self.assertIn("train: done already", self.job().stdout)

    def test_unfinished_export(self):
        """Is not done, and says why it is made again."""
        path = self.copy() / "done/export.json"
        path.write_text(json.dumps(json.loads(path.read_text()) | {"settings": {}}))
        self.assertRegex(run("info", self.out).stdout, "(?m)export +begun")
        self.assertIn("it was not finished the last time", self.job().stdout)

    def test_path_of_an_earlier_training(self):
        """Goes with the renders, and they with the path; what the user put there stays, and what is of now."""
        out, path = self.copy(), ["--path", "spiral", "--path-views", 2]
        self.assert_works(run("render", out, *path))
        self.assertTrue(list(out.glob("path/T_N/*.png")))
        self.assertTrue(list(out.glob("renders/T_N/*.png")))  # not trained since
        (out / "path/T_N/mine.png").write_text("the user's")
        os.utime(out / "path/T_N/mine.png", (1, 1))
        self.assert_works(run("train", out, *TRAIN, "--dssim", 0.5))
        process = run("render", out)
        self.assertIn("files of an earlier training", process.stdout)
        self.assertEqual([p.name for p in (out / "path").rglob("*")], ["T_N", "mine.png"])
        self.assert_works(run("train", out, *TRAIN, "--dssim", 0.4))
        self.assert_works(run("render", out, *path))
        self.assertFalse((out / "renders").exists())
        (out / "path/T_N/mine.png").unlink()
        self.assertEqual(len(list(out.glob("path/T_N/*.png"))), 2)

    def test_changed_inputs(self):
        other = self.made / "other/capture/raw/IMG_0003.DNG"
        cases = (("the photos", self.photos / "IMG_0003.DNG", other.read_bytes(), "ingest"),
                 ("the model of --poses", self.model / "images.txt", None, "poses"))
        for what, path, data, stage in cases:
            self.copy()
            was, times = path.read_bytes(), (path.stat().st_atime_ns, path.stat().st_mtime_ns)
            path.write_bytes(data or was.replace(b" 0.", b" 0.0", 1))
            os.utime(path, ns=times)
            with self.subTest(what=what):
                self.assert_fails(self.job("--resume"), 1, self.out / "checkpoint", f"{what} changed", "without --resume")
                self.assertEqual(clouds(self.out), clouds(self.done))
                process = self.assert_works(self.job())
                self.assertIn(f"{stage}: done again, {what} changed", process.stdout)
                self.assertNotEqual(clouds(self.out), clouds(self.done))
                clouds_then = clouds(self.out)
                process = self.job("--resume")
                self.assertIn("train: done already", process.stdout)
                self.assertEqual(clouds(self.out), clouds_then)
            path.write_bytes(was)
            self.works(self.job())
            shutil.rmtree(self.out)

    def test_edited_inputs_within_the_project(self):
        for name, stage in (("views.json", "train"), ("start/model.json", "train"), ("images/IMG_0002_mask.png", "train"),
                            ("sparse/points3D.txt", "initialise"), ("clouds/model.json", "export")):
            self.copy()
            with (self.out / name).open("ab") as f:
                f.write(b" \n")
            options = {"train": TRAIN, "initialise": QUICK[4:6] + QUICK[-2:], "export": []}[stage]
            with self.subTest(name=name):
                text = run(stage, self.out, *options).stdout
                self.assertIn(f"{stage}: done again, {name.split('/', maxsplit=1)[0]} changed", text)
                if stage == "train":
                    self.assertIn("train: done already", run(stage, self.out, *options).stdout)
                    with (self.out / name).open("ab") as f:
                        f.write(b" \n")
                    self.assert_fails(run(stage, self.out, *options, "--resume"), 1, "checkpoint", "changed")
            shutil.rmtree(self.out)

    def test_gone_inputs(self):
        """Photos and the model may go once they are used; a name that nothing was made of is a slip."""
        self.works(self.job())
        self.refuses(self.job("--masks", self.dir / "marks"), "marks", "no such file or folder")
        self.works(self.job())
        link = self.dir / "link"
        link.symlink_to(self.photos)
        shutil.rmtree(self.photos)
        shutil.rmtree(self.model)
        shutil.rmtree(self.out / "linear")
        for photos in (self.photos, f"{self.photos}/", self.out / "../photos", link):
            self.works(self.job(photos=photos))
        for photos in (self.dir / "fotos", self.photos / "photos", self.dir / "fotos/photos"):
            self.refuses(self.job(photos=photos), photos, "no such folder", self.photos)
            self.refuses(run("ingest", photos, "-o", self.out), photos, "no such folder", self.photos)
        self.refuses(self.job(model=self.dir / "modle"), "modle", "no such file or folder")


common.main()
