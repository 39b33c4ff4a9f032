"""Parts of bench/compare.py and bench/quality.py: whose files are whose, and what is measured again. Nothing is trained."""
import os
import pathlib
import subprocess
import sys
import types
from unittest import mock

import common
from common import FolderTest

common.need("cv2", "numpy")
import numpy

BENCH = pathlib.Path(__file__).resolve().parents[2] / "bench"
sys.dont_write_bytecode = True
sys.path.insert(0, str(BENCH))
import compare
import made
import program
import quality


class Ours(FolderTest):
    """Nobody's files are lost in --out."""

    def setUp(self):
        super().setUp()
        self.out = self.dir / "out"
        self.made = made.Made(self.out)

    def test_files(self):
        page = self.out / "a/page.html"
        for text in ("1", "2", "2"):
            self.made.write(page, text)
        made.Made(self.out).write(page, "3")  # a later run
        self.assertEqual(page.read_text(), "3")
        page.write_text("mine now")
        for refused in (lambda: self.made.check(page), lambda: made.Made(self.out).write(page, "4")):
            with self.assertRaisesRegex(made.NotOurs, "page.html: in the way"):
                refused()
        self.assertEqual(page.read_text(), "mine now")
        (self.out / "b").write_text("mine")
        with self.assertRaisesRegex(made.NotOurs, "/b: in the way"):
            self.made.write(self.out / "b/c", "x")
        self.made.take_log(self.out / "log")
        (self.out / "log").write_text("more")
        self.made.take_log(self.out / "log")
        (self.out / "other.log").write_text("mine")
        with self.assertRaises(made.NotOurs):
            self.made.take_log(self.out / "other.log")
        self.assertEqual([p.name for p in self.out.rglob("*.part")], [])

    def test_links(self):
        (self.dir / "elsewhere").mkdir()
        (self.out / "link").symlink_to(self.dir / "elsewhere")
        for refused in (lambda: self.made.write(self.out / "link/x", "x"), lambda: self.made.empty(self.out / "link", 16 * "a")):
            self.assertRaises(made.NotOurs, refused)
        self.assertEqual(list((self.dir / "elsewhere").iterdir()), [])

    def test_folders(self):
        folder = self.out / "scene-true"
        self.assertIsNone(self.made.mark_of(folder))
        self.made.empty(folder, 16 * "a")
        (folder / "renders/full").mkdir(parents=True)
        self.made.empty(folder, 16 * "b")
        self.assertEqual([p.name for p in folder.iterdir()], ["program"])
        self.assertEqual(self.made.mark_of(folder), 16 * "b")
        (folder / "program").write_text("mine")
        with self.assertRaisesRegex(made.NotOurs, "scene-true: in the way"):
            self.made.empty(folder, 16 * "c")
        self.assertEqual((folder / "program").read_text(), "mine")

    def test_list(self):
        (self.out / made.LIST).write_text("[1")
        with self.assertRaisesRegex(made.NotOurs, "no list of ours"):
            made.Made(self.out)


class Runs(FolderTest):
    """The scripts as they are called: what they refuse is refused before any work."""

    def setUp(self):
        super().setUp()
        (self.dir / "scenes/small/truth").mkdir(parents=True)
        (self.dir / "scenes/small/truth/cameras.json").write_text("{}")

    def call(self, script, *more):
        return subprocess.run([sys.executable, BENCH / script, "--flashsplat", common.PROGRAM, "--scenes", self.dir / "scenes",
                               "--only", "small", "--out", self.dir / "out", *map(str, more)], text=True, capture_output=True,
                              timeout=60, check=False, env=dict(os.environ, PYTHONDONTWRITEBYTECODE="1"))

    def test_in_the_way(self):
        curve = ("--variants", "full", "--curve")
        for script, name, more in (("compare.py", "small-true/notes.txt", ()), ("compare.py", "compare.html", ()),
                                   ("compare.py", "pictures/small-true/full/T_N/a.png", ()),
                                   ("quality.py", "small-true/notes.txt", ()), ("quality.py", "small-true-full.png", ()),
                                   ("quality.py", "small-true-full-curve/notes.txt", curve), ("quality.py", "curve.svg", curve)):
            mine = self.dir / "out" / name
            mine.parent.mkdir(parents=True, exist_ok=True)
            mine.write_text("mine")
            process = self.call(script, *more)
            self.assertEqual(process.returncode, 1, process.stderr)
            self.assertIn(name.removesuffix("/notes.txt") + ": in the way", process.stderr)
            self.assertEqual(mine.read_text(), "mine")
            self.assertFalse((self.dir / "out/small-true/done").exists())
            mine.unlink()

    def test_no_folder(self):
        (self.dir / "out").write_text("mine")
        for script in ("compare.py", "quality.py"):
            process = self.call(script)
            self.assertEqual(process.returncode, 1)
            self.assertRegex(process.stderr, r"^--out .*/out: .*\n$")

    def test_names(self):
        """Rows, folders and pictures go by names."""
        for name in ("a/sc", "b/sc", "c/small"):
            (self.dir / name).mkdir(parents=True)
        for folders in ("a/sc,b/sc", "c/small"):
            process = self.call("compare.py", "--folders", ",".join(str(self.dir / f) for f in folders.split(",")))
            self.assertEqual(process.returncode, 2, process.stderr)
            self.assertIn("two scenes are named " + folders[-5:].split("/")[-1], process.stderr)


class Kept(FolderTest):
    def test_content(self):
        """Figures are of what the photos and the truth hold, whatever their names and sizes."""
        photo, truth = self.dir / "s/capture/raw/1.DNG", self.dir / "s/truth/T_N/1.png"
        for p in (photo, truth):
            p.parent.mkdir(parents=True)
            p.write_text("a")
        args = types.SimpleNamespace(out=self.dir / "out", made=made.Made(self.dir / "out"), program="p", options="", force=False,
                                     commit="c")
        trained, told = [], ["warning: 1 of 3 views are missing"]
        case = quality.Case(args, "s", self.dir / "s", "raw", True)
        folder = compare.FolderCase(args, self.dir / "s")
        with mock.patch.object(quality, "run_variant", lambda *_: trained.append(1) or (1, "1", [])), \
                mock.patch.object(quality, "evaluate", lambda *_: ({"layers": {}}, told)):
            for path, text in ((None, ""), (photo, "b"), (truth, "b")):
                before = folder.ready(args)
                if path:
                    path.write_text(text)
                    self.assertNotEqual(folder.ready(args), before)
                (case.out / "renders").mkdir(parents=True, exist_ok=True)
                (case.out / "program").write_text(16 * "0")
                trained.clear()
                for _ in range(2):
                    result = quality.measure(args, case, "full")
                self.assertEqual(len(trained), 1, path)
                self.assertFalse((case.out / "renders").exists())
        self.assertEqual(result["warnings"], 2 * told)

    def test_what_it_took(self):
        """Of the program alone, however large the script that runs it."""
        large = numpy.ones(300 << 20, numpy.uint8)
        small, more = {}, {}
        program.call([common.PROGRAM, "--version"], self.dir / "log", small)
        fill = "x = bytearray(100 << 20)\nfor i in range(0, len(x), 4096): x[i] = 1"
        program.call([sys.executable, "-c", fill], self.dir / "log", more)
        self.assertLess(small["bytes"], 200e6)
        self.assertTrue(100e6 < more["bytes"] < large.nbytes, more)
        self.assertGreater(more["cpu_seconds"], 0)

    def test_what_failed(self):
        with self.assertRaisesRegex(program.Failed, "flashsplat: .*no-such-folder"):
            program.call([common.PROGRAM, "evaluate", self.dir, self.dir / "no-such-folder"], self.dir / "log")
        said = "flashsplat: --views: no 'x'\nTry: flashsplat evaluate --help\n"
        self.assertEqual(program.complaint(said), "flashsplat: --views: no 'x'")
        self.assertEqual(program.complaint("a\nb"), "b")


if __name__ == "__main__":
    common.main()
