"""Captures that cannot work, files that are damaged, disks that are full: one line that says what is missing, and
nothing half-written."""
import os
import pathlib
import re
import resource
import shutil
import signal
import struct
import subprocess
import unittest
import zlib

import common
import pictures
from common import FolderTest, run

FLASH = ["--flash-glob", "F_*"]
SMALL = ["--long-edge", 96, "--steps", 6, "--init-count", 300, "--max-splats", 400, "--threads", 1]


class Captures(FolderTest):
    def setUp(self):
        super().setUp()
        self.photos = self.dir / "photos"
        self.out = self.dir / "out"

    def refuses(self, *words, options=FLASH, command="run"):
        process = run(command, self.photos, "-o", self.out, *options)
        self.assert_fails(process, 1, *words)
        self.assertEqual(list(self.out.glob("done/*")), [])
        return process

    def test_missing(self):
        self.refuses(self.photos)

    def test_empty(self):
        self.photos.mkdir()
        self.refuses(self.photos)

    def test_a_file(self):
        self.photos.write_text("hello")
        self.refuses(self.photos)

    def test_no_photos(self):
        self.photos.mkdir()
        (self.photos / "notes.txt").write_text("hello")
        self.refuses(self.photos)

    def test_one_photo(self):
        pictures.photos(self.photos, 1)
        (self.photos / "N_00.png").unlink()
        self.refuses("flash")

    def test_only_flash(self):
        pictures.photos(self.photos, 3)
        for path in self.photos.glob("N_*"):
            path.unlink()
        self.refuses("only flash photos")

    def test_no_flash(self):
        pictures.photos(self.photos, 3)
        for path in self.photos.glob("F_*"):
            path.unlink()
        self.refuses("flash")

    def test_flash_not_known(self):
        pictures.photos(self.photos, 3)
        self.refuses("--flash-glob", options=[])

    def leaves_out(self, name):
        """A damaged photo does not stop the others: a warning names it."""
        process = self.assert_works(run("ingest", self.photos, "-o", self.out, *FLASH, "--force"))
        self.assertRegex(process.stderr, rf"(?m)^warning: .*{re.escape(name)}: ")

    def test_damaged_photos(self):
        good = pictures.photos(self.photos, 3) / "F_01.png"
        data = good.read_bytes()
        lying = data[:16] + b"\x7f\xff\xff\xff\x7f\xff\xff\xff" + data[24:]
        for damaged in (b"", data[:7], data[:60], data[:len(data) // 2], lying, bytes(len(data))):
            good.write_bytes(damaged)
            self.leaves_out("F_01.png")
        for name in ("IMG.DNG", "IMG.CR2", "IMG.JPG", "IMG.TIF", "IMG.NEF"):
            wrong = self.photos / name
            wrong.write_bytes(b"II*\0\x08\0\0\0\xff\xff" + bytes(range(256)) * 4)
            self.leaves_out(name)
            wrong.unlink()

    def test_damaged_photos_and_the_estimate(self):
        """A header that says more pixels than there can be asks for no memory, and one photo that cannot be read, the
        middle one, does not end the trial."""
        lying = pictures.photos(self.photos, 6) / "F_01.png"
        data = lying.read_bytes()
        header = data[12:16] + b"\x7f\xff\xff\xff" * 2 + data[24:29]
        lying.write_bytes(data[:12] + header + struct.pack(">I", zlib.crc32(header)) + data[33:])
        (self.photos / "N_00.png").write_bytes(data[:60])
        process = run("run", self.photos, "-o", self.out, *FLASH, "--steps", 300, "--colmap", "false")
        self.assert_fails(process, 1, "does not answer like COLMAP")
        self.assertIn("estimate: 12 photos as 48 x 32 pixels", process.stdout)
        self.assertRegex(process.stderr, "(?m)^warning: .*F_01.png: its header says 2147483647 x 2147483647 pixels")
        self.assertRegex(process.stderr, "(?m)^warning: .*N_00.png: ")

    def test_subfolder_that_cannot_be_read(self):
        """lost+found, on every stick, is passed over."""
        pictures.photos(self.photos / "100CANON", 5)
        found = self.photos / "lost+found"
        found.mkdir()
        found.chmod(0)
        user = {"user": 65534} if os.geteuid() == 0 else {}  # whom nothing is closed to
        for path in (self.dir, *self.photos.rglob("*")):
            if path != found:
                path.chmod(0o755)
        try:
            process = run("check", self.photos, "--flash-glob", "F_*", **user)
        except PermissionError:
            self.skipTest("the program is in a folder of root's")
        self.assertIn("lost+found", process.stderr)
        self.assertIn("passed over", process.stderr)
        self.assertIn("10 photos: 5 with flash, 5 without", process.stdout)

    def test_empty_files(self):
        pictures.photos(self.photos, 3)
        for name in ("a.dng", "b.jpg", "c.heic", "d.tif", "e.png", "f.npy"):
            path = self.dir / name
            path.touch()
            self.assert_fails(run("info", path), 1, path, "0 bytes", "copy it again")
        (self.photos / "F_99.jpg").touch()
        self.leaves_out("F_99.jpg")
        shutil.rmtree(self.out)
        for path in self.photos.iterdir():
            path.write_bytes(b"")
        self.refuses("is empty", "copy it again", options=[])

    def test_pipe(self):
        os.mkfifo(pictures.photos(self.photos, 3) / "F_99.jpg")
        for words in (["check", self.photos], ["info", self.photos], ["ingest", self.photos, "-o", self.out]):
            process = run(*words, *(FLASH if words[0] != "info" else []), timeout=60)
            self.assertIn("F_99.jpg: not a regular file", process.stderr)
        for name in ("x.json", "x.ply", "x.npy", "x.png"):
            os.mkfifo(self.dir / name)
            self.assert_fails(run("info", self.dir / name, timeout=60), 1, name, "not a regular file")
        self.assert_fails(run("ingest", self.photos, "-o", self.out, "--flash-list", self.dir / "x.json", timeout=60),
                          1, "x.json", "not a regular file")

    def test_masks_of_nothing(self):
        masks = self.dir / "masks"
        masks.mkdir()
        for photo in pictures.photos(self.photos, 5).iterdir():
            (masks / (photo.name + ".png")).write_bytes(pictures.png(48, 32, lambda x, y: (0, 0, 0)))
        self.refuses("leaves nothing of its photo", options=[*FLASH, "--masks", masks])

    def test_empty_values(self):
        """A variable of a script that is not set is not silently COLMAP."""
        pictures.photos(self.photos, 3)
        for words in (["--poses", ""], ["--poses="], ["--masks", ""]):
            self.assert_fails(run("run", self.photos, "-o", self.out, *words), 2, "needs a value")

    def test_damaged_list(self):
        pictures.photos(self.photos, 3)
        (self.out / ".flashsplat").mkdir(parents=True)
        for damaged in (b"", b"abc", b"flashsplat project"):
            (self.out / ".flashsplat/made").write_bytes(damaged)
            self.assert_fails(run("ingest", self.photos, "-o", self.out, *FLASH), 1, ".flashsplat/made", "damaged")

    def test_json_in_the_way(self):
        """--json replaces what the same command wrote, and no other file of ours."""
        pictures.photos(self.photos, 3)
        self.assert_works(run("ingest", self.photos, "-o", self.out, *FLASH))
        wanted = {path: path.read_bytes() for path in (self.out / "ingest.json", next(self.out.glob("linear/*.tif")))}
        for path, data in wanted.items():
            self.assert_fails(run("check", self.photos, *FLASH, "--json", path), 1, path, "in the way")
            self.assertEqual(path.read_bytes(), data)
        for _ in range(2):
            process = run("check", self.photos, *FLASH, "--json", self.out / "check.json")
            self.assertNotIn("in the way", process.stderr)

    def test_what_options_name(self):
        pictures.photos(self.photos, 3)
        for option in ("--poses", "--points", "--cameras", "--originals", "--masks"):
            beside = ["--clean", "jpeg"] if option == "--originals" else []
            self.refuses("nosuch", option, options=[*FLASH, option, self.dir / "nosuch", *beside])
            self.assertFalse(self.out.exists())
        self.assert_fails(run("check", self.photos, "--flash-list", self.dir / "nosuch"), 1, "nosuch", "--flash-list")

    def test_all_photos_damaged(self):
        for path in pictures.photos(self.photos, 3).iterdir():
            path.write_bytes(path.read_bytes()[:100])
        self.refuses(self.photos)

    def test_folder_that_cannot_be_made(self):
        pictures.photos(self.photos, 3)
        (self.dir / "file").write_text("x")
        (self.dir / "link").symlink_to("nowhere")
        for out in (self.dir / "file", self.dir / "file" / "out", self.dir / "link", "/proc/flashsplat-test"):
            self.assert_fails(run("run", self.photos, "-o", out, *FLASH), 1, out)

    @unittest.skipIf(os.geteuid() == 0, "root may write everywhere")
    def test_read_only_folder(self):
        pictures.photos(self.photos, 3)
        self.out.mkdir(mode=0o555)
        self.assert_fails(run("run", self.photos, "-o", self.out, *FLASH), 1, self.out)


class Finished(FolderTest):
    """A small job that is done: what is wrong afterwards costs nothing of it."""

    @classmethod
    def setUpClass(cls):
        cls.made = cls.shared_folder()
        cls.scene, cls.done = cls.made / "scene", cls.made / "done"
        cls.assert_works(run("synth", "-o", cls.scene, "--width", 96, "--height", 64, "--photos", 6, "--held-out", 1, "--seed", 5))
        pictures.give_points(cls.scene / "truth")
        cls.job = ["run", cls.scene / "capture/raw", "--poses", cls.scene / "truth/sparse", *SMALL]
        cls.assert_works(run(*cls.job, "-o", cls.done))

    def setUp(self):
        super().setUp()
        self.out = pathlib.Path(shutil.copytree(self.done, self.dir / "out"))

    def names(self):
        return sorted(str(p) for p in self.out.rglob("*") if "warnings" not in str(p))

    def test_input_that_is_missing_costs_nothing(self):
        """What a stage needs is looked at before what it made earlier goes."""
        points = self.dir / "cut.ply"
        points.write_bytes((self.out / "start/transmitted.ply").read_bytes()[:200])
        before = self.names()
        self.assert_fails(run("poses", self.out, "--colmap", "nosuch"), 1, "nosuch", "COLMAP")
        self.assert_fails(run("initialise", self.out, "--points", points), 1, points)
        self.assertEqual(self.names(), before)

    def test_values_that_cannot_be(self):
        """Are told before the first stage works, and before figures go."""
        new = self.dir / "new"
        (self.dir / "notes.txt").write_text("hello")
        self.assert_fails(run(*self.job, "-o", new, "--cameras", self.dir), 1, self.dir, "no COLMAP model")
        self.assert_fails(run(*self.job, "-o", new, "--cameras", self.dir / "notes.txt"), 1, "notes.txt")
        other = "neon" if os.uname().machine == "x86_64" else "avx512"
        self.assert_fails(run(*self.job, "-o", new, "--cpu", other), 2, "--cpu", other)
        self.assertEqual(list(new.glob("*")), [])
        truth = self.scene / "truth"
        self.assert_works(run("evaluate", self.out, truth, "--views", "capture"))
        before = self.names()
        self.assert_fails(run("evaluate", self.out, truth, "--method", "x"), 2, "--method", "NAME=DIR")
        self.assert_fails(run("evaluate", self.out, truth, "--method", "x=nosuch"), 1, "nosuch")
        self.assertEqual(self.names(), before)

    def test_results_that_are_missing(self):
        """What made them is told, though its mark says that it is done."""
        again = [("clouds/R.ply", ["render"], "train"), ("clouds/model.json", ["export"], "train"),
                 ("start/R.ply", ["train", "--steps", 6], "initialise"), ("sparse/images.txt", ["initialise"], "poses"),
                 ("images/IMG_0001.tif", ["train", "--steps", 6], "poses"), ("ingest.json", ["poses"], "ingest PHOTOS -o")]
        for name, (stage, *options), made in again:
            path = self.out / name
            data = path.read_bytes()
            path.unlink()
            where = path.parent if path.parent.name == "sparse" else path
            self.assert_fails(run(stage, self.out, *options, "--force"), 1, f"{where}: is missing", f"`flashsplat {made}",
                              "--force")
            (self.out / "done" / f"{made.split()[0]}.json").unlink()
            self.assert_fails(run(stage, self.out, *options, "--force"), 1, f"first run `flashsplat {made}")
            shutil.rmtree(self.out)
            shutil.copytree(self.done, self.out)
            self.assertEqual(path.read_bytes(), data)
        (self.out / "checkpoint/R.ply").unlink()
        (self.out / "done/train.json").unlink()
        self.assert_fails(run("train", self.out, *SMALL[2:4], *SMALL[6:], "--resume"), 1, "checkpoint/R.ply", "--resume")
        shutil.rmtree(self.out / "renders")
        self.assert_fails(run("evaluate", self.out, self.scene / "truth"), 1, "renders: is missing", "flashsplat render")

    def test_truth_that_is_none(self):
        empty = self.dir / "empty"
        empty.mkdir()
        self.assert_fails(run("evaluate", self.out, empty), 1, empty, "cameras.json", "flashsplat synth")
        self.assert_fails(run("evaluate", self.out, self.dir / "nosuch"), 1, "nosuch: no such folder", "cameras.json")
        self.assert_fails(run("evaluate", self.out, self.scene), 1, f"name {self.scene}/truth")

    def test_folders_that_are_passed_over(self):
        for folder in (self.scene, self.scene / "capture"):
            for words in (["check", folder], ["ingest", folder, "-o", self.dir / "new"]):
                self.assert_fails(run(*words), 1, folder, "flashsplat made", self.scene / "capture/raw")
        self.assert_fails(run("check", self.out), 1, self.out, "flashsplat made")

    def test_all_among_others(self):
        self.assert_works(run("render", self.out, "--layers", "R,all", "-o", self.dir / "renders"))
        self.assertTrue((self.dir / "renders/T_N").exists())


class FullDisk(FolderTest):
    """A file-size limit stops every write at some byte, as a full disk does."""

    def limited(self, limit, *words, **options):
        """With the signal that ends programs at the limit, as a shell's ulimit has it."""
        def limited():
            signal.signal(signal.SIGXFSZ, signal.SIG_DFL)
            resource.setrlimit(resource.RLIMIT_FSIZE, (limit, limit))
        return run(*words, preexec_fn=limited, **options)

    def ingest(self, out, limit):
        return self.limited(limit, "ingest", pictures.photos(self.dir / "photos", 6), "-o", out, *FLASH)

    def check(self, process, out):
        self.assert_fails(process, 1, out)
        self.assertFalse((out / "done" / "ingest.json").exists())
        self.assertEqual([p for p in out.rglob("*") if ".part" in p.name], [])

    def test_little_stack(self):
        """As `ulimit -s 100` has it."""
        def limited():
            resource.setrlimit(resource.RLIMIT_STACK, (100 << 10, 100 << 10))
        photos, out = pictures.photos(self.dir / "photos", 6), self.dir / "out"
        self.assert_fails(run("check", self.dir / "none", preexec_fn=limited), 1, "none")
        process = run("ingest", photos, "-o", out, *FLASH, preexec_fn=limited)
        self.assertEqual(process.returncode, 0, process.stderr)
        self.assertEqual(run("info", out, preexec_fn=limited).returncode, 0)

    def test_writes_that_fail(self):
        out = self.dir / "out"
        for limit in (0, 100, 4096):
            self.check(self.ingest(out, limit), out)
        self.assert_works(self.ingest(out, 10**8))

    def test_single_files_that_cannot_be_written(self):
        photos, file = pictures.photos(self.dir / "photos", 3), self.dir / "file"
        flash, other = photos / "F_00.png", photos / "N_00.png"
        for words in (["check", photos, *FLASH, "--json", file], ["pair", flash, other, "-o", file.with_suffix(".png")],
                      ["pair", flash, other, "--linear", "-o", file.with_suffix(".png")]):
            self.assert_fails(self.limited(64, *words), 1, file, "cannot write")
            self.assertEqual([p.name for p in self.dir.iterdir()], ["photos"])
        self.assert_fails(self.limited(64, "synth", "-o", file, "--photos", 2, "--width", 32, "--height", 32), 1, file)

    @unittest.skipUnless(os.geteuid() == 0, "only root can mount a small disk")
    def test_small_disk(self):
        disk = self.dir / "disk"
        disk.mkdir()
        mount = subprocess.run(["mount", "-t", "tmpfs", "-o", "size=40k", "tmpfs", disk], check=False,
                               stderr=subprocess.DEVNULL)
        if mount.returncode != 0:
            self.skipTest("no right to mount a small disk here")
        try:
            out = disk / "out"
            photos = pictures.photos(self.dir / "photos", 6)
            self.check(run("ingest", photos, "-o", out, *FLASH), out)
        finally:
            subprocess.run(["umount", disk], check=True)


class Odd(FolderTest):
    """Scenes that hold nothing, photos of a few pixels: what can be had is had, the rest is told before work is done."""

    def made(self, width, height):
        self.scene, self.out = self.dir / "scene", self.dir / "out"
        self.assert_works(run("synth", "-o", self.scene, "--width", width, "--height", height, "--photos", 6, "--held-out", 1))
        pictures.give_points(self.scene / "truth")
        return ["--poses", self.scene / "truth/sparse", "--init-count", 300, "--max-splats", 400, "--threads", 1]

    def works(self, *words):
        return self.assert_works(run(*words))

    def test_nothing_mirrored(self):
        """Where R's Gaussians all are transparent there is none to put the others beside: R is empty."""
        more = self.made(64, 48)
        self.works("ingest", self.scene / "capture/raw", "-o", self.out)
        self.works("poses", self.out, *more[:2])
        self.works("initialise", self.out, *more[2:4])
        path = self.out / "start/R.ply"
        data = path.read_bytes()
        head, _, rows = data.partition(b"end_header\n")
        names = [line.split()[-1] for line in head.splitlines() if line.startswith(b"property")]
        at, n = names.index(b"opacity"), len(rows) // (4 * len(names))
        values = list(struct.unpack(f"<{n * len(names)}f", rows))
        values[at::len(names)] = n * [-12.0]
        path.write_bytes(head + b"end_header\n" + struct.pack(f"<{len(values)}f", *values))
        self.works("train", self.out, *more[4:], "--steps", 1000, "--no-photographer")
        self.assertIn("R is empty", self.works("render", self.out).stderr)

    def test_few_pixels(self):
        more = self.made(64, 48)
        job = ["run", self.scene / "capture/raw", *more, "--steps", 6, "--long-edge"]
        process = self.works(*job, 3, "-o", self.out, "--formats", "ply,mesh")
        self.assertIn("no mesh", process.stderr)
        self.assertTrue((self.out / "export/T_N.ply").exists())
        self.works(*job, 8, "-o", self.dir / "field", "--preset", "flash-nerf")

    def test_one_pixel_wide(self):
        """Halved photos keep their pixel where training is tried for the estimate."""
        photos = self.dir / "photos"
        photos.mkdir()
        for i in range(6):
            rows = [bytes([(7 * y + 31 * i) % 256] * 3) for y in range(400)]
            (photos / f"{'FN'[i % 2]}_{i}.png").write_bytes(pictures.png_of_rows(1, 400, rows))
        process = run("run", photos, "-o", self.dir / "out", *FLASH, "--poses", photos, "--steps", 250, "--threads", 1)
        self.assertIn("estimate: 6 photos as 1 x 400 pixels", process.stdout, process.stderr)

    def test_one_place(self):
        """Though the model has points."""
        more = self.made(64, 48)
        images = self.scene / "truth/sparse/images.txt"
        lines = images.read_text().splitlines()
        pose = lines[0].split()[1:8]
        for i in range(0, len(lines), 2):
            word = lines[i].split()
            lines[i] = " ".join([word[0], *pose, *word[8:]])
        images.write_text("\n".join(lines) + "\n")
        process = run("run", self.scene / "capture/raw", "-o", self.out, *more, "--steps", 6)
        self.assert_fails(process, 1, "at one place")
        self.assertFalse((self.out / "start").exists())


common.main()
