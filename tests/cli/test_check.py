"""`flashsplat check`: it names each fault that is planted in a capture, and nothing in a good one."""
import array
import json
import os
import pathlib
import random
import shutil
import struct
import zlib

import common
from common import FolderTest, run

WIDTH, HEIGHT = 240, 160
GIVEN = pathlib.Path(__file__).parent.parent / "data/photos"


def entry(data, tag):
    """Where a tag's entry of a DNG lies, in its first directory or EXIF's."""
    def look(directory):
        count = struct.unpack_from("<H", data, directory)[0]
        return {struct.unpack_from("<H", data, directory + 2 + 12 * i)[0]: directory + 2 + 12 * i for i in range(count)}

    first = look(struct.unpack_from("<I", data, 4)[0])
    exif = look(struct.unpack_from("<I", data, first[0x8769] + 8)[0])
    return first.get(tag) or exif[tag]


def change(path, tag, *value):
    """A number, or the two of a fraction."""
    data = bytearray(path.read_bytes())
    at = entry(data, tag)
    if len(value) == 1:
        struct.pack_into("<H", data, at + 8, *value)
    else:
        struct.pack_into("<II", data, struct.unpack_from("<I", data, at + 8)[0], *value)
    path.write_bytes(data)


def change_pixels(path, new):
    """new(row of the sensor, black taken off) for every row."""
    data = bytearray(path.read_bytes())
    at = struct.unpack_from("<I", data, entry(data, 0x0111) + 8)[0]
    for _ in range(HEIGHT):
        row = array.array("H", bytes(data[at:at + 2 * WIDTH]))
        new_row = [min(16383, max(0, round(v) + 512)) for v in new([v - 512 for v in row])]
        data[at:at + 2 * WIDTH] = array.array("H", new_row).tobytes()
        at += 2 * WIDTH
    path.write_bytes(data)


def shake(row):
    """Six pixels of motion, each colour of the mosaic by itself."""
    n = len(row)
    return [(row[max(x - 2, x % 2)] + row[x] + row[min(x + 2, n - 2 + x % 2)]) / 3 for x in range(n)]


class Check(FolderTest):
    @classmethod
    def setUpClass(cls):
        cls.made = cls.shared_folder() / "made"
        cls.assert_works(run("synth", "-o", cls.made, "--width", WIDTH, "--height", HEIGHT, "--photos", 20, "--held-out", 0,
                             timeout=600))
        views = json.loads((cls.made / "truth/cameras.json").read_text())["images"]
        cls.flash = {view["name"]: view["flash"] for view in views}

    def setUp(self):
        super().setUp()
        self.photos = self.dir / "photos"
        shutil.copytree(self.made / "capture/raw", self.photos)

    def some(self, flash, n):
        """The nth such photo's file."""
        return self.photos / ([name for name, lit in sorted(self.flash.items()) if lit == flash][n] + ".DNG")

    def check(self, *more, code=3):
        path = self.dir / "check.json"
        if not hasattr(os, "getxattr") or not path.exists() or "user.flashsplat" not in os.listxattr(path):
            path.unlink(missing_ok=True)  # else it is replaced
        process = run("check", self.photos, "--json", path, *more)
        self.assertEqual(process.returncode, code, process.stderr + process.stdout)
        self.result = json.loads(path.read_text())
        for finding in self.result["findings"]:
            self.assertIn(finding["text"], process.stdout)
        return {f["kind"]: f["text"] for f in self.result["findings"] if f["weight"] != "hint"}

    def finds(self, kind, *paths):
        found = self.check()
        self.assertEqual(set(found) - {"few"}, {kind})  # 10 of each kind: one less is told of
        for path in paths:
            self.assertIn(path.name, found[kind])

    def test_good(self):
        self.assertEqual(self.check(code=0), {})
        self.assertEqual(self.result["verdict"], "good")
        self.assertEqual(len(self.result["photos"]), 20)
        self.assertGreater(self.result["flash_adds"], 0.3)
        for photo in self.result["photos"]:
            self.assertEqual(photo["flash"], self.flash[photo["name"]])
            self.assertNotEqual(self.flash[photo["beside"]], photo["flash"])
        text = run("check", self.photos, "-q").stdout
        self.assertRegex(text, r"IMG_0001.DNG +(no )?flash +1/40 s, ISO 200, f/5.6.*sharp \d+ %, clipped .*beside IMG_")

    def test_order(self):
        """Neighbours are those taken one after the other, whatever the names."""
        for n, name in enumerate(sorted(self.flash)):
            (self.photos / f"{name}.DNG").rename(self.photos / f"{'with' if self.flash[name] else 'without'} ({n}).DNG")
        self.assertEqual(self.check(code=0), {})
        number = lambda name: int(name.split("(")[1][:-1])
        for photo in self.result["photos"]:
            nearest = min(abs(number(photo["name"]) - number(p["name"])) for p in self.result["photos"] if p["flash"] != photo["flash"])
            self.assertEqual(abs(number(photo["name"]) - number(photo["beside"])), nearest, photo)

    def test_jpeg(self):
        shutil.rmtree(self.photos)
        shutil.copytree(self.made / "capture/jpeg", self.photos)
        self.assertEqual(self.check(code=0), {})
        self.assertIn("set the camera to RAW", self.result["findings"][0]["text"])

    def test_untold(self):
        """16 bits are no RAW, and what a photo does not say is not told as 0."""
        shutil.rmtree(self.photos)
        for folder in ("flash", "noflash"):
            (self.photos / folder).mkdir(parents=True)
            for n in range(10):
                shutil.copy(GIVEN / "rgb16.png", self.photos / folder / f"{folder}{n}.png")
        self.check(code=1)  # the flash adds nothing
        self.assertIn("untold", [finding["kind"] for finding in self.result["findings"]])
        self.assertEqual({photo["raw"] for photo in self.result["photos"]}, {False})
        text = run("check", self.photos).stdout
        self.assertIn("exposure unknown, ISO unknown, aperture unknown", text)
        self.assertIn("20 photos: 10 with flash, 10 without, 0 RAW", text)

    def test_blur(self):
        for path in (self.some(True, 5), self.some(False, 8)):
            change_pixels(path, lambda row: shake(shake(row)))
        self.finds("blur", self.some(True, 5), self.some(False, 8))

    def test_wrong_flash(self):
        change(self.some(True, 4), 0x9209, 16)
        self.finds("wrong-flash", self.some(True, 4))
        change(self.some(True, 4), 0x9209, 9)
        change(self.some(False, 6), 0x9209, 9)
        self.finds("wrong-flash", self.some(False, 6))

    def test_misfire(self):
        change(self.some(False, 3), 0x9209, 8)  # on, did not fire
        self.finds("misfire", self.some(False, 3))
        self.assertIn("did not fire in 1 of 11", self.result["findings"][0]["text"])

    def test_zoom(self):
        change(self.some(True, 2), 0x920A, 35, 1)
        self.finds("zoom", self.some(True, 2))
        shutil.copy(self.made / "capture/raw" / self.some(True, 2).name, self.some(True, 2))
        change(self.some(False, 3), 0xA405, 52)  # a phone's, that cuts it out
        self.finds("zoom", self.some(False, 3))

    def test_body(self):
        path = self.some(True, 6)
        data = bytearray(path.read_bytes())
        at = entry(data, 0x0110)
        size, place = struct.unpack_from("<II", data, at + 4)
        model = bytes(data[place:place + size - 1]).decode()
        data[place:place + 1] = b"Z"
        path.write_bytes(data)
        self.finds("body", path)
        self.assertIn(f"(Z{model[1:]}, the others {model})", self.check()["body"])

    def test_lens(self):
        """The aperture's entry becomes the lens's name, where its fraction was."""
        for path in self.photos.iterdir():
            data = bytearray(path.read_bytes())
            at = entry(data, 0x829D)
            struct.pack_into("<HHI", data, at, 0xA434, 2, 8)
            place = struct.unpack_from("<I", data, at + 8)[0]
            data[place:place + 8] = b"35 f/2 B" if path == self.some(False, 6) else b"35 f/2 A"
            path.write_bytes(data)
        self.finds("lens", self.some(False, 6))
        self.assertIn("(35 f/2 B, the others 35 f/2 A)", self.check()["lens"])
        change(self.some(False, 6), 0x920A, 50, 1)  # that it is another focal length is enough
        self.finds("zoom", self.some(False, 6))

    def test_grey(self):
        """A photo without colour, of a size and lighting as the others."""
        path = self.some(False, 5)
        data = path.read_bytes()
        at = struct.unpack_from("<I", data, entry(data, 0x0111) + 8)[0]
        rows = [array.array("H", data[at + 2 * WIDTH * y:at + 2 * WIDTH * (y + 1)]) for y in range(HEIGHT)]
        bright = lambda v: min(255, round(255 * (max(v - 512, 0) / 15871) ** 0.45))
        lines = b"".join(b"\0" + bytes(bright(rows[y // 2 * 2][x // 2 * 2 + 1]) for x in range(WIDTH)) for y in range(HEIGHT))
        chunk = lambda kind, text: struct.pack(">I", len(text)) + kind + text + struct.pack(">I", zlib.crc32(kind + text))
        (self.photos / (path.stem + "_noflash.png")).write_bytes(
            b"\x89PNG\r\n\x1a\n" + chunk(b"IHDR", struct.pack(">IIBBBBB", WIDTH, HEIGHT, 8, 0, 0, 0, 0)) +
            chunk(b"IDAT", zlib.compress(lines)) + chunk(b"IEND", b""))
        path.unlink()
        found = self.check()
        self.assertEqual(set(found), {"grey"})
        self.assertIn(path.stem + "_noflash.png", found["grey"])

    def test_profile(self):
        """A colour profile that is none."""
        shutil.rmtree(self.photos)
        shutil.copytree(self.made / "capture/jpeg", self.photos)
        path = self.photos / (self.some(True, 3).stem + ".JPG")
        data, profile = path.read_bytes(), b"ICC_PROFILE\0\1\1" + bytes(300)
        path.write_bytes(data[:2] + b"\xff\xe2" + struct.pack(">H", 2 + len(profile)) + profile + data[2:])
        self.finds("profile", path)
        process = run("ingest", self.photos, "-o", self.dir / "out", "--long-edge", 240)
        self.assertIn(self.check()["profile"], process.stderr)

    def test_focus(self):
        """Another distance is another size of the picture."""
        for path in self.photos.iterdir():  # the aperture's entry becomes one of 5.6 m
            data = bytearray(path.read_bytes())
            struct.pack_into("<H", data, entry(data, 0x829D), 0x9206)
            path.write_bytes(data)
        self.assertEqual(self.check(code=0), {})
        change(self.some(True, 2), 0x9206, 5, 10)
        self.finds("focus", self.some(True, 2))
        self.assertIn("(0.5 m: the picture is 4.6 % larger)", self.result["findings"][0]["text"])

    def test_white_balance(self):
        for n in range(3):
            change(self.some(False, n), 0xA403, 0)
        self.assertEqual(self.check(code=0), {})  # of RAW files it does not matter
        self.assertEqual([p["white_balance_set"] for p in self.result["photos"]].count("automatic"), 3)
        shutil.rmtree(self.photos)
        shutil.copytree(self.made / "capture/jpeg", self.photos)
        path = self.photos / (self.some(True, 0).stem + ".JPG")
        data = bytearray(path.read_bytes())
        at = data.index(struct.pack("<HHI", 0xA403, 3, 1))
        data[at + 8] = 0
        path.write_bytes(data)
        self.assertIn("1 of 20 photos have an automatic white balance", self.hint("white"))
        self.assertRegex(run("check", self.photos).stdout, path.name + ".*white balance automatic")

    def test_exposure(self):
        change(self.some(False, 2), 0x829A, 1, 20)
        change(self.some(False, 2), 0x8827, 100)  # the same product
        found = self.check()
        self.assertIn("exposure", found)
        self.assertIn("another ISO than ISO 200: " + self.some(False, 2).name, found["exposure"])

    def test_gap(self):
        names = sorted(self.flash)
        lost = [name for name in names[8:14] if self.flash[name]]
        for name in lost:
            (self.photos / f"{name}.DNG").unlink()
        found = self.check()
        self.assertEqual(set(found) - {"few"}, {"gap"})
        self.assertRegex(found["gap"], "no photo with flash near IMG_00(09|1[0-3]).DNG")

    def test_clipped(self):
        change_pixels(self.some(False, 7), lambda row: [8 * v for v in row])
        self.finds("clipped", self.some(False, 7))

    def test_unusable(self):
        for n in range(7):
            self.some(True, n).unlink()
        self.assertIn("only 3 photos with flash", self.check(code=1)["few"])
        self.assert_fails(run("check", self.photos), 1, "not usable")
        self.assert_fails(run("check", self.dir / "none"), 1, "none")
        (self.dir / "mine.json").write_text("{}")
        self.assert_fails(run("check", self.photos, "--json", self.dir / "mine.json"), 1, "mine.json")

    def test_one(self):
        """The first photo that is tried: it says what it is."""
        for path in self.photos.iterdir():
            if path != self.some(True, 0):
                path.unlink()
        self.check(code=1)
        self.assertEqual([photo["flash"] for photo in self.result["photos"]], [True])

    def test_json_that_cannot_be_written(self):
        """What was found is said all the same."""
        process = run("check", self.photos, "--json", self.dir / "none/x.json")
        self.assert_fails(process, 1, "none/x.json")
        self.assertIn("20 photos: 10 with flash", process.stdout)

    def test_weak_flash(self):
        for n in range(10):  # the others' pictures, with a little more light
            shutil.copy(self.some(False, n), self.some(True, n))
            change(self.some(True, n), 0x9209, 9)
            change_pixels(self.some(True, n), lambda row: [1.06 * v for v in row])
        found = self.check()
        self.assertRegex(found["weak-flash"], "the flash adds [4-8] % of light: go closer")

    def test_damaged(self):
        path = self.some(True, 1)
        path.write_bytes(path.read_bytes()[:9000])
        found = self.check()
        self.assertEqual(set(found) - {"few"}, {"unreadable"})
        self.assertRegex(found["unreadable"], f"left out: {path.name} .*cannot read")
        self.assertEqual(self.result["verdict"], "doubts")
        self.assertEqual(len(self.result["photos"]), 19)
        path.rename(self.photos / os.fsdecode(b"caf\xe9.DNG"))  # Latin-1, as old cards have it
        latin = self.dir / "latin.json"
        self.assertEqual(run("check", self.photos, "--json", latin, errors="replace").returncode, 3)
        found = {f["kind"]: f["text"] for f in json.loads(latin.read_text())["findings"]}
        self.assertIn("left out: caf\xe9.DNG ", found["unreadable"])

    def hint(self, kind):
        """The one finding of a kind, which is no reason to doubt."""
        self.assertEqual(self.check(code=0), {})
        texts = [finding["text"] for finding in self.result["findings"] if finding["kind"] == kind]
        self.assertEqual(len(texts), 1, self.result["findings"])
        return texts[0]

    def test_copy(self):
        """A photo once more under another name, and with another header."""
        for name, more in (("ZZ.DNG", b""), ("XX.DNG", b"more")):
            (self.photos / name).write_bytes(self.some(True, 3).read_bytes() + more)
        self.assertIn("2 photos are others under another name and are left out: XX.DNG, ZZ.DNG", self.hint("copy"))
        self.assertEqual({photo["name"] for photo in self.result["photos"]}, set(self.flash))
        process = run("ingest", self.photos, "-o", self.dir / "out", "--long-edge", 240)
        self.assertIn("left out: XX.DNG, ZZ.DNG", process.stderr)
        ingested = json.loads((self.dir / "out/ingest.json").read_text())["photos"]
        self.assertEqual({photo["name"] for photo in ingested}, set(self.flash))
        self.assertEqual(sorted(path.stem for path in (self.dir / "out/linear").glob("*.tif")), sorted(self.flash))

        change(self.photos / "ZZ.DNG", 0x9209, 16)  # the same picture as one without flash
        found = self.check()
        self.assertIn("both", found)
        self.assertIn("ZZ.DNG", found["both"])
        self.assertIn(self.some(True, 3).name, found["both"])

    def test_twin(self):
        """The same place once more: other noise, a little more light, the hand moved by two pixels."""
        noise = random.Random(5)
        twin = self.photos / "IMG_0021.DNG"
        shutil.copy(self.some(False, 4), twin)
        change_pixels(twin, lambda row: [1.03 * v + noise.gauss(0, 3 + 0.2 * max(v, 0) ** 0.5)
                                         for v in row[2:] + row[-2:]])
        text = self.hint("twin")
        self.assertIn("taken from one place: " + self.some(False, 4).name + ", IMG_0021.DNG", text)
        twins = {photo["name"]: photo["twin_of"] for photo in self.result["photos"] if photo["twin_of"]}
        self.assertEqual(twins, {"IMG_0021": self.some(False, 4).stem})
        for n in (5, 6):  # the rest of which are not enough then
            self.some(False, n).unlink()
        self.assertIn("only 8 photos without flash from different places", self.check()["few"])
        self.assertIn(text, run("ingest", self.photos, "-o", self.dir / "out", "--long-edge", 240).stderr)

    def test_stranger(self):
        """Photos of another place, at the end and between the others."""
        other = self.dir / "other"
        self.assert_works(run("synth", "-o", other, "--seed", 2, "--width", WIDTH, "--height", HEIGHT, "--photos", 4,
                              "--held-out", 0))
        strangers = sorted((other / "capture/raw").iterdir())[1:3]
        shutil.copy(strangers[0], self.photos / "IMG_0021.DNG")
        shutil.copy(strangers[1], self.some(True, 4))
        found = self.check()
        self.assertEqual(set(found) - {"few"}, {"stranger"})
        for name in (self.some(True, 4).name, "IMG_0021.DNG"):
            self.assertIn(name, found["stranger"].split(":")[1])
        self.assertEqual({photo["name"] for photo in self.result["photos"] if photo["stranger"]},
                         {self.some(True, 4).stem, "IMG_0021"})
        process = run("ingest", self.photos, "-o", self.dir / "out", "--long-edge", 240)
        self.assertIn(found["stranger"], process.stderr)

    def test_black(self):
        """Anything shows what a black photo shows, times nothing."""
        change_pixels(self.some(False, 4), lambda row: [x % 3 - 1 for x in range(len(row))])
        self.check()
        self.assertEqual([photo["name"] for photo in self.result["photos"] if photo["twin_of"]], [])
        self.assertIn(self.some(False, 4).name, {f["kind"]: f["text"] for f in self.result["findings"]}["dark"])

    def test_turned(self):
        """Held down, cameras do not know which way is up: such a photo shows the same place."""
        for n, orientation in enumerate((3, 6, 8)):
            change(self.some(n % 2 == 0, 3 + n), 0x0112, orientation)
        self.check(code=0)
        self.assertEqual([photo["name"] for photo in self.result["photos"] if photo["stranger"]], [])

    def test_run_says_the_same(self):
        change_pixels(self.some(True, 5), lambda row: shake(shake(shake(shake(row)))))
        change_pixels(self.some(False, 7), lambda row: [8 * v for v in row])
        change_pixels(self.some(False, 2), lambda row: [v / 100 for v in row])
        process = self.assert_works(run("ingest", self.photos, "-o", self.dir / "out", "--long-edge", 240))
        self.assertIn("blurred: " + self.some(True, 5).name, process.stderr)
        self.assertIn("clipped: " + self.some(False, 7).name, process.stderr)
        self.assertIn("very dark: " + self.some(False, 2).name, process.stderr)
        self.assertIn("blurred: " + self.some(True, 5).name, (self.dir / "out/warnings/ingest.txt").read_text())
        for words in (["poses", self.dir / "out", "--poses", self.made / "truth/sparse"],
                      ["initialise", self.dir / "out", "--init-count", 500]):
            process = self.assert_works(run(*words))
        self.assertIn("1 blurred photos are left out, here and in training", process.stdout)


common.main()
