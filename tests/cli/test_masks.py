"""Masks that the user gives: what they cover is not used, by COLMAP's names."""
import json
import shutil

import common
import pictures
from common import FolderTest, run

W, H = 96, 64


def png(path, gray):  # rows of bytes
    path.write_bytes(pictures.png_of_rows(len(gray[0]), len(gray), map(bytes, gray), grey=True))


def values(path):  # of a PNG of 8 bits, grey
    return [list(row) for row in pictures.read_png(path)]


class Masks(FolderTest):
    def setUp(self):
        super().setUp()
        self.scene, self.out, self.masks = self.dir / "scene", self.dir / "out", self.dir / "masks"
        self.works("synth", "-o", self.scene, "--width", W, "--height", H, "--photos", 8, "--held-out", 1, "--seed", 5)
        self.masks.mkdir()
        self.photos = self.scene / "capture/raw"

    def works(self, *words):
        return self.assert_works(run(*words))

    def ingest(self, *options):
        return self.works("ingest", self.photos, "-o", self.out, "--long-edge", W // 2, *options)

    def test_masks(self):
        left = [[0] * (W // 2) + [255] * (W // 2)] * H
        png(self.masks / "IMG_0001.DNG.png", left)
        png(self.masks / "IMG_0002.png", [[255] * W] * (H // 2) + [[0] * W] * (H // 2))
        self.ingest("--masks", self.masks)
        mask = lambda name: values(self.out / f"linear/IMG_{name}_mask.png")
        self.assertTrue(all(row[:W // 4] == [0] * (W // 4) and max(row[W // 4:]) == 255 for row in mask("0001")))
        self.assertTrue(all(max(row) == (255 if y < H // 4 else 0) for y, row in enumerate(mask("0002"))))
        self.assertEqual(max(max(row) for row in mask("0003")), 255)
        for_colmap = values(self.out / "linear/features_masks/IMG_0001.png.png")
        self.assertEqual(for_colmap, left)
        self.assertFalse((self.out / "linear/features_masks/IMG_0003.png.png").exists())
        self.assertIn("skipped", self.ingest("--masks", self.masks).stdout)
        png(self.masks / "IMG_0003.png", left)  # another mask: done again
        self.assertIn("the photos or their masks changed", self.ingest("--masks", self.masks).stdout)
        self.assertEqual(mask("0003")[0][0], 0)
        self.ingest()  # and without any
        self.assertEqual(max(mask("0001")[0][:W // 4]), 255)
        self.assertFalse((self.out / "linear/features_masks/IMG_0001.png.png").exists())
        self.assertEqual(len(list(self.masks.iterdir())), 3)

    def test_names(self):
        """Any case of letters will do; a mask of no photo is told of."""
        png(self.masks / "img_0001.dng.PNG", [[0] * (W // 2) + [255] * (W // 2)] * H)
        png(self.masks / "IMG_0004.png.png", [[255] * W] * H)
        said = self.ingest("--masks", self.masks)
        self.assertIn("1 of 8 photos have a mask", said.stdout + said.stderr)
        self.assertIn("1 masks are of no photo, e.g. IMG_0004.png.png", said.stdout + said.stderr)
        self.assertEqual(values(self.out / "linear/IMG_0001_mask.png")[0][0], 0)

    def test_subfolders(self):
        """In the subfolder of the photo, or without it where no other photo may be meant."""
        white = [[255] * W] * H
        raw = sorted(self.photos.iterdir())
        self.photos = self.dir / "card"
        for i, path in enumerate(raw):
            folder = self.photos / ("flash" if "flash" in path.name else f"10{i % 2}CANON")
            folder.mkdir(parents=True, exist_ok=True)
            path.rename(folder / path.name)
        png(self.masks / "img_0001.PNG", white)
        (self.masks / "101CANON").mkdir()
        png(self.masks / "101CANON/IMG_0002.DNG.png", white)
        png(self.masks / "101CANON/img_0004.png", white)
        png(self.masks / "101CANON/img_0005.png", white)  # which is in the other folder
        said = self.ingest("--masks", self.masks)
        self.assertIn("3 of 8 photos have a mask", said.stdout + said.stderr)
        self.assertIn("1 masks are of no photo, e.g. img_0005.png", said.stdout + said.stderr)
        folder = self.photos / "101CANON"
        for path in sorted(folder.iterdir()):  # names that repeat
            path.rename(folder / (f"IMG_{int(path.stem[4:]) - 1:04}.DNG"))
        said = self.ingest("--masks", self.masks, "--force")
        self.assertIn("1 of 8 photos have a mask", said.stdout + said.stderr)

    def test_refused(self):
        self.assert_fails(run("ingest", self.photos, "-o", self.out, "--masks", self.masks), 1, str(self.masks), "IMG_0001.DNG.png")
        self.assert_fails(run("ingest", self.photos, "-o", self.out, "--masks", self.dir / "none"), 1, "none")
        png(self.masks / "IMG_0001.png", [[255] * H] * W)  # lying
        process = run("ingest", self.photos, "-o", self.out, "--masks", self.masks)
        self.assertIn("IMG_0001.png: 64 x 96 pixels, expected the size of its photo", process.stdout + process.stderr)
        (self.masks / "IMG_0001.png").write_bytes(b"\x89PNG\r\n\x1a\nnothing")
        process = run("ingest", self.photos, "-o", self.out, "--masks", self.masks)
        self.assertIn("IMG_0001.png", process.stdout + process.stderr)

    def test_people_are_left_out(self):
        """The photographer in the pane spoils R where he stood, and not where he is masked."""
        poses = ["--poses", self.scene / "truth/sparse"]
        shutil.rmtree(self.scene)
        self.works("synth", "-o", self.scene, "--width", 192, "--height", 128, "--photos", 16, "--held-out", 1, "--seed", 31, "--field", "photographer")
        figures = self.scene / "truth/figures"
        for mask in figures.iterdir():
            rows = [[0 if v else 255 for v in row] for row in values(mask)]
            png(self.masks / mask.name, rows)
        psnr = []
        for options in ([], ["--masks", self.masks]):
            self.works("run", self.photos, "-o", self.out, *poses, "--preset", "preview", "--long-edge", 192, "--steps", 300,
                       "--init-count", 3000, *options)
            self.works("render", self.out, "--cameras", self.scene / "truth/cameras.json", "--output", self.dir / "views", "--layers", "R")
            json_path = self.dir / f"{len(psnr)}.json"
            self.works("evaluate", self.out, self.scene / "truth", "--output", self.dir / "views", "--json", json_path)
            psnr.append(next(iter(json.loads(json_path.read_text())["methods"].values()))["layers"]["R"]["psnr_gain"])
        self.assertGreater(psnr[1], psnr[0] + 0.5, psnr)


common.main()
