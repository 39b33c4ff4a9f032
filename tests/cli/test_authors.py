"""Folders as Flash-Splat's authors and NeRFReN's published theirs: known when seen, as good as the RAW files they were
made of; dense clouds to start from. Needs Debian's python3-numpy and python3-opencv; skipped without."""
import json
import re
import shutil

import common
from common import FolderTest, run

common.need("cv2", "numpy")
import cv2
import numpy
import authors_folder

QUICK = ["--preset", "preview", "--long-edge", 192, "--steps", 150, "--init-count", 4000, "--max-splats", 5000,
         "--threads", 2]
FEW = ["--long-edge", 96, "--steps", 4, "--init-count", 300, "--max-splats", 400, "--threads", 1]


def read_points(path):
    """(n, 3) of our own PLY of points: x y z red green blue [value]."""
    head, body = path.read_bytes().split(b"end_header\n", 1)
    size = 19 if b" value" in head else 15
    rows = numpy.frombuffer(body, numpy.uint8).reshape(-1, size)
    return rows[:, :12].copy().view("<f4")


class Authors(FolderTest):
    @classmethod
    def setUpClass(cls):
        cls.made = cls.shared_folder()
        cls.capture, cls.raw, cls.scene = cls.made / "capture", cls.made / "raw", cls.made / "scene"
        cls.good("synth", "-o", cls.capture, "--width", 192, "--height", 128, "--photos", 12, "--held-out", 2, "--seed",
                 31)
        cls.gains = authors_folder.make_authors(common.PROGRAM, cls.capture, cls.scene)
        cls.balance = ["--npy-gains", ",".join(map(str, cls.gains))]
        cls.good("run", cls.capture / "capture/raw", "-o", cls.raw, "--poses", cls.capture / "truth/sparse", *QUICK)

    @classmethod
    def good(cls, *words):
        return cls.assert_works(run(*words, timeout=300))

    def psnr(self, out, layer="T_N"):
        truth, renders = self.capture / "truth", self.dir / f"renders-{out.name}"
        self.good("render", out, "--output", renders, "--cameras", truth / "cameras.json", "--layers", layer)
        self.good("evaluate", out, truth, "--output", renders, "--json", renders.with_suffix(".json"))
        method = json.loads((renders.with_suffix(".json")).read_text())["methods"]["flashsplat"]
        return method["layers"][layer]["psnr_gain"]

    def largest_difference(self, out, raw):
        """Of the photos as they are trained on: of the folder and of the RAW files it was made of, where both are trusted.
        What is clipped is whitened in the RAW's mosaic, and in pixels around what is full in the folder's."""
        photos = sorted(out.glob("linear/*.tif"))
        self.assertEqual(len(photos), 12)
        largest = 0
        for photo in photos:
            names = photo, raw / f"linear/{photo.stem.rsplit('_', 1)[0]}.tif"
            a, b = (cv2.imread(str(name), cv2.IMREAD_UNCHANGED) for name in names)
            masks = (cv2.imread(str(name.with_name(name.stem + "_mask.png")), cv2.IMREAD_UNCHANGED) for name in names)
            trusted = numpy.minimum(*masks) == 255
            self.assertGreater(trusted.mean(), 0.9)
            largest = max(largest, abs(a - b)[trusted].max())
        return largest

    def test_as_good_as_the_raw_files(self):
        # the same start: the points that the RAW run found, in a model of the folder's own names. The photos are the
        # same to a float's last bits; those lead training to another end, as far from the true one: T_N of so small a
        # capture moves by 0.15 dB, as with another --seed.
        scene = self.dir / "scene"
        authors_folder.make_authors(common.PROGRAM, self.capture, scene, ">f4", "F")
        shutil.rmtree(scene / "sparse")
        model = shutil.copytree(self.raw / "sparse", scene / "sparse/0")
        names = {p.stem.rsplit("_", 1)[0]: p.stem for p in scene.glob("images/*.png")}
        text = (model / "images.txt").read_text()
        (model / "images.txt").write_text(re.sub(r"(IMG_\d+)\.tif", lambda m: names[m[1]] + ".png", text))
        process = self.good("run", scene, "-o", self.dir / "out", *self.balance, *QUICK)
        said = process.stdout + process.stderr
        self.assertIn("a scene folder: photos from images_npy, poses from", said)
        self.assertIn("12 photos: 6 with flash, 6 without (their names)", said)
        self.assertLess(self.largest_difference(self.dir / "out", self.raw), 2e-7)
        raw, npy = self.psnr(self.raw), self.psnr(self.dir / "out")
        self.assertGreater(raw, 20)
        self.assertLess(abs(raw - npy), 0.4)

    def test_all_in_the_folder_is_understood(self):
        out = self.dir / "out"
        self.good("ingest", self.scene, "-o", out, "--long-edge", 96, *self.balance)
        told = {p["name"]: p for p in json.loads((out / "ingest.json").read_text())["photos"]}
        self.assertEqual(len(told), 12)
        for name, photo in told.items():
            self.assertEqual(photo["flash"], name.endswith("_flash"), name)
            self.assertEqual((photo["file"], photo["quality"]), (f"images_npy/{name}.npy", "raw"))
        # poses of the binary model and of poses_bounds.npy are the same, and those of the capture
        views = {}
        for poses in ("sparse/0", "poses_bounds.npy"):
            shutil.rmtree(out, ignore_errors=True)
            self.good("ingest", self.scene, "-o", out, "--long-edge", 96, *self.balance)
            self.good("poses", out, "--poses", self.scene / poses)
            views[poses] = json.loads((out / "views.json").read_text())["views"]
        true = {v["name"]: v for v in json.loads((self.capture / "truth/cameras.json").read_text())["images"]}
        for a, b in zip(*views.values()):
            want = true[a["name"].rsplit("_", 1)[0]]
            self.assertEqual(a["name"], b["name"])
            self.assertAlmostEqual(a["fx"], want["fx"] / 2, delta=1e-3)
            for v in (a, b):
                numpy.testing.assert_allclose(numpy.array(v["w2c"])[:3], numpy.array(want["w2c"])[:3], atol=1e-6)
        scene = shutil.copytree(self.scene, self.dir / "scene")
        for i in range(4):  # as many pictures beside them as make a folder of photos elsewhere
            shutil.copy(next((scene / "images").iterdir()), scene / f"plot{i}.png")
        for folder in self.scene, scene:
            process = self.good("info", folder)
            self.assertIn("12 photos: 6 with flash, 6 without", process.stdout)

    def test_values_are_those_of_the_raw_files(self):
        self.good("ingest", self.scene, "-o", self.dir / "out", *self.balance)
        self.good("ingest", self.capture / "capture/raw", "-o", self.dir / "raw")
        # half of a step of 13047, by the largest gain
        self.assertLess(self.largest_difference(self.dir / "out", self.dir / "raw"), 1e-4)

    def test_other_cameras(self):
        defaults = run("ingest", self.scene, "-o", self.dir / "a", "--long-edge", 96)
        self.assertIn("white balance 2.157 0.9403 1.287", defaults.stderr + defaults.stdout)
        ingest = ["ingest", self.scene, "-o", self.dir / "a"]
        self.assert_fails(run(*ingest, "--npy-gains", "1,2"), 2, "--npy-gains", "R,G,B")
        self.assert_fails(run(*ingest, "--npy-white", "5"), 2, "--npy-white 5")
        self.assert_fails(run(*ingest, "--npy-black", "60000", "--npy-white", "65535"), 1, "black level", "--npy-black")

    def test_no_flash(self):
        scene = self.dir / "rffr"
        authors_folder.make_rffr(common.PROGRAM, self.capture, scene)
        self.assert_fails(run("ingest", scene, "-o", self.dir / "out"), 1, "none of the 6 photos tells")
        for separation in ("none", "flashless"):
            out = self.dir / separation
            self.good("ingest", scene, "-o", out, "--separation", separation, "--long-edge", 96)
            self.good("poses", out, "--separation", separation, "--poses", scene)
            authors_folder.write_dense(self.dir / "dense.ply", read_points(self.raw / "start/transmitted_surface.ply"))
            self.good("initialise", out, "--separation", separation, "--points", self.dir / "dense.ply", *FEW[4:6])
            self.good("train", out, "--separation", separation, *FEW[2:4], *FEW[6:])
            self.assertEqual((out / "clouds/R.ply").exists(), separation == "flashless")

    def test_dense_cloud(self):
        kinds = ("transmitted", "reflected")
        points = numpy.concatenate([read_points(self.raw / f"start/{k}_surface.ply") for k in kinds])
        out, dense = self.dir / "out", self.dir / "30_views/dense/fused.ply"
        shutil.copytree(self.raw, out, ignore=shutil.ignore_patterns("*.html"))
        authors_folder.write_dense(dense, points)
        process = self.good("initialise", out, "--points", dense, *QUICK[:2], *QUICK[6:8])
        self.assertRegex(process.stdout + process.stderr, r"initialise: \d+ dense points transmitted, \d+ reflected")
        self.assertGreater(len(read_points(out / "start/transmitted.ply")), 1000)  # classified, not sparse ones
        self.good("train", out, *QUICK[:2], *QUICK[4:6], *QUICK[8:])
        self.assertGreater(self.psnr(out), self.psnr(self.raw) - 1)
        # the same as text is the same start; another cloud is another one
        text = self.dir / "text.ply"
        authors_folder.write_dense(text, points, ascii=True)
        first = (out / "start/T_N.ply").read_bytes()
        self.good("initialise", out, "--points", text, *QUICK[:2], *QUICK[6:8])
        self.assertEqual((out / "start/T_N.ply").read_bytes(), first)
        authors_folder.write_dense(text, points[::2])
        process = self.good("initialise", out, "--points", text, *QUICK[:2], *QUICK[6:8])
        self.assertIn("the cloud of --points changed", process.stdout + process.stderr)
        self.assertNotEqual((out / "start/T_N.ply").read_bytes(), first)
        # the paper's preset parts it by the depth that the points of the poses tell
        process = self.good("initialise", out, "--points", text, "--preset", "paper", *QUICK[6:8])
        said = re.search(r"parted at a depth of \S+: (\d+) points transmitted, (\d+) reflected", process.stdout + process.stderr)
        self.assertGreater(min(map(int, said.groups())), 50)
        # as the paper words its cue, by how much the light grows
        process = self.good("initialise", out, "--flash-cue", "intensity", *QUICK[:2], *QUICK[6:8])
        said = re.search(r"parted at a growth of the light of (\S+): (\d+) points transmitted, (\d+) reflected",
                         process.stdout + process.stderr)
        self.assertTrue(1 < float(said[1]) < 6 and min(int(said[2]), int(said[3])) > 20, said[0])
        authors_folder.write_dense(text, points + 100)
        process = run("initialise", out, "--points", text, *QUICK[:2], *QUICK[6:8])
        self.assert_fails(process, 1, text, "frame of the poses")

    def test_clouds_of_either_lighting(self):
        scene, out = shutil.copytree(self.scene, self.dir / "scene"), self.dir / "out"
        transmitted, reflected = (read_points(self.raw / f"start/{k}_surface.ply") for k in ("transmitted", "reflected"))
        authors_folder.write_dense(scene / "15_flash_fused.ply", numpy.concatenate([transmitted, reflected[::2]]))
        authors_folder.write_dense(scene / "15_noflash_fused.ply", numpy.concatenate([transmitted[::4], reflected]))
        few = [*FEW, "--preset", "paper", *self.balance]
        process = self.good("run", scene, "-o", out, *few)
        said = process.stdout + process.stderr
        self.assertIn("parted by its clouds of either lighting: 15_flash_fused.ply and 15_noflash_fused.ply", said)
        depth = float(re.search(r"parted at a depth of (\S+):", said)[1])
        first = (out / "start/T_N.ply").read_bytes()
        clouds = ["--flash-points", scene / "15_flash_fused.ply", "--noflash-points", scene / "15_noflash_fused.ply"]
        alone = ["initialise", out, "--preset", "paper", *FEW[4:6], *FEW[8:]]
        self.good(*alone, *clouds, "--force")
        self.assertEqual((out / "start/T_N.ply").read_bytes(), first)
        process = self.good(*alone)  # without them it goes by the points of the poses
        other = float(re.search(r"parted at a depth of (\S+):", process.stdout + process.stderr)[1])
        self.assertNotEqual(depth, other)
        self.assert_fails(run(*alone, *clouds[:2]), 2, "give both")
        authors_folder.write_dense(self.dir / "few.ply", transmitted[:5])
        process = run(*alone, *clouds[:2], "--noflash-points", self.dir / "few.ply")
        self.assert_fails(process, 1, self.dir / "few.ply", "5 points", "without flash")
        self.assert_fails(run("initialise", out, *clouds), 2, "--flash-cue depth")
        self.assert_fails(run("run", scene, "-o", self.dir / "b", "--flash-points", "no.ply", *clouds[2:], *few), 1, "no.ply")

    def test_ablations_of_the_paper(self):
        for separation in ("flashless", "linear", "none"):
            out = self.dir / separation
            self.good("run", self.scene, "-o", out, *self.balance, *FEW, "--preset", "paper", "--separation", separation)
            there = {p.stem for p in (out / "clouds").glob("*.ply")}
            self.assertEqual(there, {"T_N"} if separation == "none" else {"T_N", "R", "beta"})


if __name__ == "__main__":
    common.main()
