"""Known poses that are wrong, or of turned or cropped pictures, and stages whose input is not there."""
import json
import shutil
import struct

import common
import pictures
from common import FolderTest, run

FLASH = ["--flash-glob", "F_*"]


class Models(FolderTest):
    """Known poses that are wrong."""

    def setUp(self):
        super().setUp()
        self.out = self.dir / "out"
        self.names = [p.name for p in sorted(pictures.photos(self.dir / "photos", 6).iterdir())]
        self.assert_works(run("ingest", self.dir / "photos", "-o", self.out, *FLASH))

    def refuses(self, model, *words):
        process = run("poses", self.out, "--poses", model)
        self.assert_fails(process, 1, *words)
        self.assertFalse((self.out / "done" / "poses.json").exists())

    def test_missing(self):
        self.refuses(self.dir / "none", self.dir / "none")

    def test_damaged(self):
        model = pictures.model(self.dir / "model", self.names)
        for name, text in (("images.txt", "1 1 0 0\n"), ("images.txt", "1 nan 0 0 0 0 0 0 1 F_00.png\n\n"),
                           ("cameras.txt", "1 PINHOLE 99999999999 1 1 1 1 1\n"),
                           ("cameras.txt", "1 PINHOLE 48 32 0 0 0 0\n"),
                           ("cameras.txt", "1 FISH 48 32 0 0 0 0\n")):
            broken = shutil.copytree(model, self.dir / "broken", dirs_exist_ok=True)
            (broken / name).write_text(text)
            self.refuses(broken, broken)

    def test_too_few_photos(self):
        self.refuses(pictures.model(self.dir / "few", self.names[:7]), "N_")

    def test_names_of_other_photos(self):
        self.refuses(pictures.model(self.dir / "other", [f"DSC_{i}.JPG" for i in range(12)]))

    def test_json_that_is_not(self):
        path = self.dir / "transforms.json"
        for text in ("", "{", "[]", '{"frames": 3}', '{"frames": [{}]}', "\x00"):
            path.write_text(text)
            self.refuses(path, path)

    def test_stages_before_their_input(self):
        for command in ("initialise", "train", "render", "export"):
            process = run(command, self.out)
            self.assertEqual(process.returncode, 1, command)
            self.assertIn(str(self.out), process.stderr)


def turn(path, orientation):
    """What a JPEG's EXIF says of how it is to be turned."""
    data = bytearray(path.read_bytes())
    start = data.find(b"Exif\0\0") + 6
    order = ">" if data[start:start + 2] == b"MM" else "<"
    directory = start + struct.unpack_from(order + "I", data, start + 4)[0]
    for i in range(struct.unpack_from(order + "H", data, directory)[0]):
        at = directory + 2 + 12 * i
        if struct.unpack_from(order + "H", data, at)[0] == 0x112:
            struct.pack_into(order + "H", data, at + 8, orientation)
    path.write_bytes(data)


class Frames(FolderTest):
    """Models of pictures that lie in another way: COLMAP, which finds the points, tells whether the poses fit."""

    def setUp(self):
        super().setUp()
        self.made, self.out = self.dir / "made", self.dir / "out"
        self.model = self.made / "truth/sparse"
        self.assert_works(run("synth", "-o", self.made, "--width", 240, "--height", 160, "--photos", 12, "--held-out", 0))

    def pose(self, photos):
        self.assert_works(run("ingest", photos, "-o", self.out, "--long-edge", 240, "--force"))
        process = self.assert_works(run("poses", self.out, "--poses", self.model, "--force"))
        views = json.loads((self.out / "views.json").read_text())["views"]
        self.assertEqual(len(views), 12)
        return process.stdout, views[0]

    def test_turned(self):
        """COLMAP does not turn photos as EXIF says."""
        photos = self.made / "capture/jpeg"
        said, upright = self.pose(photos)
        self.assertNotIn("turned", said)
        for orientation, first in ((6, [-x for x in upright["w2c"][1]]), (3, [-x for x in upright["w2c"][0]])):
            for path in photos.iterdir():
                turn(path, orientation)
            said, view = self.pose(photos)
            self.assertIn("12 photos are not upright", said)
            self.assertEqual((view["width"], view["height"]), (160, 240) if orientation == 6 else (240, 160))
            for a, b in zip(view["w2c"][0], first):
                self.assertAlmostEqual(a, b, places=6)

    def test_folders(self):
        """flash/P_1.DNG and noflash/P_1.DNG, of which COLMAP had the JPEGs."""
        photos, text = self.dir / "photos", (self.model / "images.txt").read_text()
        flash = {v["name"]: v["flash"] for v in json.loads((self.made / "truth/cameras.json").read_text())["images"]}
        count = [0, 0]
        for path in sorted((self.made / "capture/raw").iterdir()):
            lit = flash[path.stem]
            count[lit] += 1
            name = f"{'flash' if lit else 'noflash'}/P_{count[lit]}"
            (photos / name).parent.mkdir(parents=True, exist_ok=True)
            path.rename(photos / f"{name}.DNG")
            text = text.replace(f"{path.stem}.JPG", f"{name}.JPG")
        (self.model / "images.txt").write_text(text)
        self.assertEqual(self.pose(photos)[1]["name"], "flash_P_1")

    def test_cropped(self):
        """Of RAW photos it had the camera's JPEGs, which are a little smaller."""
        text = (self.model / "cameras.txt").read_text()
        self.assertIn("240 160", text)
        smaller = text.replace("240 160", "236 158").replace(" 120 80", " 118 79")
        self.assertNotEqual(text, smaller)
        (self.model / "cameras.txt").write_text(smaller)
        said, view = self.pose(self.made / "capture/raw")
        self.assertIn("12 photos a little smaller", said)
        focal = float(text.splitlines()[-1].split()[4])
        for value, true in ((view["fx"], focal), (view["fy"], focal), (view["cx"], 120), (view["cy"], 80)):
            self.assertAlmostEqual(value, true, places=6)


common.main()
