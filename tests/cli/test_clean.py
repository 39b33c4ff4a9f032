#!/usr/bin/env python3
"""Photos without the reflection at their full size, of a made capture that is trained small: how near they are to the
truth, what other programs read in them, and what happens where the photos are not what they were."""
import json
import shutil
import struct
import subprocess

import common

common.need("cv2", "numpy", also=not shutil.which("exiftool") and "exiftool is not here (libimage-exiftool-perl)")
import cv2
import numpy as np

GAMMA = 0.22
WIDTH, HEIGHT, EDGE = 480, 320, 120


def exiftool(*arguments):
    process = subprocess.run(["exiftool", *map(str, arguments)], stdout=subprocess.PIPE, stderr=subprocess.PIPE,
                             text=True, check=False)
    return common.ProgramTest.assert_works(process).stdout


def tags(path):
    return json.loads(exiftool("-json", "-n", path))[0]


def fine(*arguments, **options):
    return common.ProgramTest.assert_works(common.run(*arguments, timeout=300, **options)).stdout


def display_p3():
    """An ICC profile (version 4) as telephones' photos have it: P3's primaries at D65, sRGB's curve."""
    fixed = lambda *values: b"".join(struct.pack(">i", round(65536 * v)) for v in values)
    text = lambda words: b"mluc\0\0\0\0" + struct.pack(">II2s2sII", 1, 12, b"en", b"US", 2 * len(words), 28) + \
        words.encode("utf-16-be")
    xyz = lambda *values: b"XYZ \0\0\0\0" + fixed(*values)
    curve = b"para\0\0\0\0" + struct.pack(">HH", 3, 0) + fixed(2.4, 1 / 1.055, 0.055 / 1.055, 1 / 12.92, 0.04045)
    parts = [(b"desc", text("Display P3")), (b"cprt", text("CC0")), (b"wtpt", xyz(0.9642, 1, 0.8249)),
             (b"rXYZ", xyz(0.51512, 0.2412, -0.00105)), (b"gXYZ", xyz(0.29198, 0.69225, 0.04189)),
             (b"bXYZ", xyz(0.1571, 0.06657, 0.78407))] + [(name, curve) for name in (b"rTRC", b"gTRC", b"bTRC")]
    table, body, at = struct.pack(">I", len(parts)), b"", 132 + 12 * len(parts)
    for name, data in parts:
        data += bytes(-len(data) % 4)
        table += struct.pack(">4sII", name, at + len(body), len(data))
        body += data
    head = struct.pack(">I4sI4s4s4s", at + len(body), b"\0" * 4, 0x04000000, b"mntr", b"RGB ", b"XYZ ") + bytes(12) + \
        b"acsp" + bytes(28) + fixed(0.9642, 1, 0.8249) + bytes(48)
    return head + table + body


def linear_dng(path):
    """The values of a linear DNG of ours: behind the head, row by row."""
    values = np.fromfile(path, np.uint16, count=WIDTH * HEIGHT * 3, offset=8)
    return values.reshape(HEIGHT, WIDTH, 3).astype(np.float32) / 65535


def psnr(truth, estimate):
    gain = (truth * estimate).sum((0, 1)) / (estimate ** 2).sum((0, 1))
    off = np.clip(truth, 0, 1) ** GAMMA - np.clip(estimate * gain, 0, 1) ** GAMMA
    return -10 * np.log10((off ** 2).mean())


def picture(path):
    return cv2.imread(str(path), cv2.IMREAD_UNCHANGED)[..., ::-1].astype(np.float32)


class Clean(common.FolderTest):
    @classmethod
    def setUpClass(cls):
        """One capture with a lens that distorts, one training."""
        cls.top = cls.shared_folder()
        cls.photos, cls.out = cls.top / "photos", cls.top / "out"
        fine("synth", "-o", cls.top / "cap", "--seed", "31", "--width", WIDTH, "--height", HEIGHT, "--photos", "12",
             "--held-out", "0", "--field", "distortion")
        shutil.copytree(cls.top / "cap/capture/raw", cls.photos)
        # A photo that has no truth to compare with is not to be used on its left third.
        cls.masks = cls.top / "masks"
        cls.masks.mkdir()
        names = sorted(p.stem for p in cls.photos.iterdir())
        cls.masked = next(n for n in names if not any((cls.top / "cap/truth" / layer / (n + ".png")).exists() for layer in ("T_N", "T_F")))
        mask = np.full((HEIGHT, WIDTH), 255, np.uint8)
        mask[:, :WIDTH // 3] = 0
        cv2.imwrite(str(cls.masks / (cls.masked + ".png")), mask)
        said = fine("run", cls.photos, "--masks", cls.masks, "-o", cls.out, "--poses", cls.top / "cap/truth/sparse_opencv", "--preset",
                    "preview", "--long-edge", EDGE, "--steps", "500", "--progress-every", "0", "--clean", "jpeg,tiff,dng")
        assert "cleaned photos 0:" in said, said  # in the estimate
        cls.made = cls.out / "export/photos"
        cls.cameras = {image["name"]: image
                       for image in json.loads((cls.top / "cap/truth/cameras.json").read_text())["images"]}
        cls.balance = json.loads((cls.out / "ingest.json").read_text())["white_balance"]

    def undistort(self, image):
        """A full-size picture as the ideal camera of the truth sees it, by OpenCV."""
        line = (self.top / "cap/truth/sparse_opencv/cameras.txt").read_text().split("\n")
        fields = next(text for text in line if text and text[0] != "#").split()
        self.assertEqual(fields[1], "OPENCV")
        fx, fy, cx, cy, *bend = map(float, fields[4:])
        matrix = np.array([[fx, 0, cx - 0.5], [0, fy, cy - 0.5], [0, 0, 1]])
        return cv2.undistort(image, matrix, np.array(bend))

    def test_names(self):
        self.assertEqual({p.name for p in self.made.iterdir()},
                         {p.stem + ending for p in self.photos.iterdir() for ending in (".jpg", ".tif", ".dng")})

    def test_better_than_the_render(self):
        """At every photo that has a truth, flash or not, away from the border that the ideal camera does not see."""
        inner = np.s_[16:-16, 24:-24]
        gains = []
        for name, camera in self.cameras.items():
            layer = "T_F" if camera["flash"] else "T_N"
            path = self.top / "cap/truth" / layer / (name + ".png")
            if not path.exists():
                continue
            truth = (picture(path) / 255) ** (1 / GAMMA)
            render = picture(self.out / "renders" / layer / (name + ".png")) / 255
            render = cv2.resize(render, (WIDTH, HEIGHT), interpolation=cv2.INTER_CUBIC).clip(0, 1) ** (1 / GAMMA)
            clean = self.undistort(linear_dng(self.made / (name + ".dng")) * np.float32(self.balance))
            photo = self.undistort(picture(self.top / "out/linear" / (name + ".tif")))
            photo = cv2.resize(photo, (WIDTH, HEIGHT), interpolation=cv2.INTER_CUBIC)
            ours = psnr(truth[inner], clean[inner])
            gains.append(ours - psnr(truth[inner], render[inner]))
            self.assertGreater(ours, psnr(truth[inner], photo[inner].clip(0)) + 2, name)
        self.assertEqual(len(gains), 6)
        self.assertGreater(min(gains), 0.4)
        self.assertGreater(sum(gains) / len(gains), 1)

    def test_masked(self):
        """What is not to be used of a photo is black in what training sees, where the lens was undone, too; and the photo
        is still taken for the one that was ingested."""
        seen = picture(self.out / "images" / (self.masked + ".tif"))
        inner = np.s_[10:-10, 10:seen.shape[1] // 3 - 10]
        self.assertEqual(seen[inner].max(), 0)
        self.assertGreater(seen[10:-10, seen.shape[1] // 2:].mean(), 0.01)
        self.assertTrue((self.made / (self.masked + ".dng")).exists())

    def test_exif_and_profile(self):
        for original in sorted(self.photos.iterdir())[:3]:
            was = tags(original)
            for ending in (".jpg", ".tif", ".dng"):
                now = tags(self.made / (original.stem + ending))
                for key in ("Make", "Model", "ExposureTime", "FNumber", "ISO", "FocalLength", "Flash",
                            "DateTimeOriginal", "ImageWidth", "ImageHeight", "FocalLengthIn35mmFormat"):
                    self.assertEqual(now[key], was[key], f"{key} of {original.stem}{ending}")
                self.assertEqual(now["Orientation"], 1)
                if ending != ".dng":
                    self.assertEqual((now["ProfileDescription"], now["ColorSpace"]), ("sRGB", 1))
        self.assertIn("Validate                        : OK", exiftool("-validate", self.made / "IMG_0001.dng"))
        self.assertIn("Validate                        : OK", exiftool("-validate", self.made / "IMG_0001.jpg"))

    def test_same_picture_in_all_formats(self):
        jpeg, tiff = picture(self.made / "IMG_0002.jpg"), picture(self.made / "IMG_0002.tif")
        self.assertEqual(cv2.imread(str(self.made / "IMG_0002.tif"), cv2.IMREAD_UNCHANGED).dtype, np.uint16)
        self.assertLess(np.abs(jpeg - tiff / 257).mean(), 1.5)

    def test_dng_is_developed_like_the_original(self):
        """LibRaw, by `ingest`: the light that was written, at the white balance of the photo."""
        folder = self.dir / "dng"
        shutil.copytree(self.made, folder, ignore=shutil.ignore_patterns("*.jpg", "*.tif"))
        fine("ingest", folder, "-o", self.dir / "out", "--long-edge", "0")
        again = json.loads((self.dir / "out/ingest.json").read_text())
        was = json.loads((self.out / "ingest.json").read_text())
        for key in ("white_balance", "srgb_from_camera"):
            self.assertLess(np.abs(np.array(again[key]) - np.array(was[key])).max(), 1e-3, key)
        read = picture(self.dir / "out/linear/IMG_0003.tif")
        written = linear_dng(self.made / "IMG_0003.dng") * np.float32(self.balance)
        self.assertLess(np.abs(read - written).mean(), 0.002 * written.mean())

    def export(self, *options):
        return common.run("export", self.out, "--clean", "jpeg", *options, timeout=300)

    def test_photo_is_missing(self):
        folder = self.dir / "some"
        shutil.copytree(self.photos, folder, ignore=shutil.ignore_patterns("IMG_0005.DNG"))
        before = sorted(p.name for p in self.made.iterdir())
        self.assert_fails(self.export("--originals", folder), 1, "IMG_0005", "--originals")
        self.assert_fails(self.export("--originals", self.dir / "none"), 1, "none", "--originals")
        self.assertEqual(sorted(p.name for p in self.made.iterdir()), before)

    def test_photo_is_another(self):
        folder = self.dir / "changed"
        shutil.copytree(self.photos, folder)
        shutil.copy(folder / "IMG_0003.DNG", folder / "IMG_0001.DNG")
        out = self.dir / "out"
        shutil.copytree(self.out, out)
        names = lambda: sorted(str(p) for p in out.rglob("*") if "warnings" not in str(p))
        before = names()
        for _ in range(2):  # what was cleaned before stays
            process = common.run("export", out, "--clean", "jpeg", "--originals", folder, timeout=300)
            self.assert_fails(process, 1, "IMG_0001.DNG", "another picture")
            self.assertEqual(names(), before)
        shutil.rmtree(out / "export/photos")
        process = common.run("export", out, "--clean", "jpeg", "--originals", folder, timeout=300)
        self.assert_fails(process, 1, "IMG_0001.DNG", "another picture")

    def test_lens_of_an_earlier_version(self):
        """Whose photos are distorted was not told then: one camera of several is enough."""
        out = self.dir / "out"
        shutil.copytree(self.out, out)
        views = json.loads((out / "views.json").read_text())
        for view in views["views"]:
            del view["lens"]
        (out / "views.json").write_text(json.dumps(views))
        for name in ("IMG_0001", "IMG_0002"):
            shutil.copy(out / f"linear/{name}.tif", out / f"images/{name}.tif")
        process = common.run("export", out, "--clean", "jpeg", "--force", timeout=300)
        self.assert_fails(process, 1, "views.json", "lens")

    def test_folder_that_is_only_looked_at(self):
        """A run of an earlier version, which did not note where the photos are, in a place that cannot be written."""
        out = self.dir / "out"
        shutil.copytree(self.out, out)
        (out / "originals.json").unlink()
        (out / "originals.json").mkdir()
        process = self.assert_works(common.run("ingest", self.photos, "-o", out, "--long-edge", EDGE, "--masks", self.masks, timeout=300))
        self.assertIn("done already", process.stdout)
        self.assertIn("--originals", process.stderr)

    def test_users_file_stays(self):
        out = self.dir / "out"
        shutil.copytree(self.out, out)
        mine = out / "export/photos/IMG_0004.jpg"
        mine.write_bytes(b"retouched")
        self.assert_fails(common.run("export", out, "--clean", "jpeg,dng", timeout=300), 1, "IMG_0004.jpg")
        self.assertEqual(mine.read_bytes(), b"retouched")

    def test_wrong_format(self):
        self.assert_fails(self.export("--clean", "jpeg,gif"), 2, "--clean", "gif")


class Turned(common.FolderTest):
    def test_jpegs_that_lie(self):
        """JPEGs stored on their side, as their EXIF says, come back upright, and where nothing mirrors as they were; in
        Display P3 where they are, with a red that sRGB has not."""
        fine("synth", "-o", self.dir / "cap", "--seed", "31", "--width", "288", "--height", "192", "--photos", "10",
             "--held-out", "0")
        photos = self.dir / "photos"
        photos.mkdir()
        for path in sorted((self.dir / "cap/capture/jpeg").iterdir()):
            upright = cv2.imread(str(path))
            upright[:32, :32] = (0, 0, 250)
            cv2.imwrite(str(photos / path.name), cv2.rotate(upright, cv2.ROTATE_90_COUNTERCLOCKWISE),
                        [cv2.IMWRITE_JPEG_QUALITY, 98])
            exiftool("-q", "-overwrite_original", "-TagsFromFile", path, "-all:all", "-Orientation#=6", photos / path.name)
        (self.dir / "words").write_text(50000 * "x")  # of a program that keeps its settings there
        (self.dir / "p3.icc").write_bytes(display_p3())
        first, *others = sorted(photos.iterdir())
        wide = others[::2]
        exiftool("-q", "-overwrite_original", f"-ICC_Profile<={self.dir / 'p3.icc'}", *wide)
        exiftool("-q", "-overwrite_original", f"-UserComment<={self.dir / 'words'}", "-Artist=somebody", first)
        fine("run", photos, "-o", self.dir / "out", "--poses", self.dir / "cap/truth/sparse", "--preset", "preview",
             "--long-edge", "144", "--steps", "60", "--progress-every", "0", "--separation", "none", "--clean", "jpeg")
        for path in sorted(photos.iterdir()):
            clean = self.dir / "out/export/photos" / (path.stem + ".jpg")
            self.assertEqual(tags(clean)["Orientation"], 1)
            self.assertEqual(tags(clean)["ProfileDescription"], "Display P3" if path in wide else "sRGB")
            upright = picture(self.dir / "cap/capture/jpeg" / path.name)
            now = picture(clean)
            self.assertEqual(now.shape, upright.shape)
            off = np.abs(now - upright)[32:, 32:]
            self.assertLess(off.mean(), 4, path.name)  # there is no R: the photo as it was
            red = np.abs(now[8:24, 8:24] - [250, 0, 0]).mean((0, 1))
            self.assertLess(red.max(), 8, path.name)
        self.assertEqual(tags(self.dir / "out/export/photos" / first.name.replace("JPG", "jpg"))["Artist"], "somebody")


if __name__ == "__main__":
    common.main()
