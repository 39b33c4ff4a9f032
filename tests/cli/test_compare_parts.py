"""Parts of bench/compare.py and bench/quality.py: whose files are whose, what is measured again, what stands in tables and
how pictures are shown. Nothing is trained."""
import contextlib
import copy
import csv
import io
import json
import os
import pathlib
import re
import subprocess
import sys
import types
from unittest import mock

import common
from common import FolderTest
from tex import check_tex

common.need("cv2", "numpy")
import cv2
import numpy

BENCH = pathlib.Path(__file__).resolve().parents[2] / "bench"
sys.dont_write_bytecode = True
sys.path.insert(0, str(BENCH))
import compare
import compare_pictures
import compare_tables
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
        folder = self.dir / "a"
        for wrong in ("full=A", "truth=A", "published=A", "published: x=A", "x=A,x=A", "a/b=A", "..=A", "a\nb=A", " =A", "=A", "x="):
            given = ["compare.py", "--method", wrong.replace("A", str(folder))]
            said = io.StringIO()
            with self.assertRaises(SystemExit) as stopped, mock.patch("sys.argv", given), contextlib.redirect_stderr(said):
                compare.arguments()
            self.assertEqual(stopped.exception.code, 2, wrong)
            self.assertIn("error: --method: ", said.getvalue())
        with mock.patch("sys.argv", ["compare.py", "--method", f"a#b? c={folder},x={folder}"]):
            self.assertEqual([name for name, _ in compare.arguments().others], ["a#b? c", "x"])


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


class Tables(FolderTest):
    def test_scenes_of_each(self):
        """What has no held-out views is in the mean of the photos' places only, and the captions say so."""
        figures = {"T_N": {"gain": {"psnr": 30.0, "ssim": 0.9}}}
        with_both, without = {"held_out": figures, "capture": figures}, {"capture": figures}
        scenes = {name: [compare.row_of("full", "full", {}, {"figures": of})] for name, of in (("a", with_both), ("b", without))}
        means = compare.means(scenes)
        self.assertEqual(means[0]["scenes"], {"held_out": ["a"], "capture": ["a", "b"]})
        args = types.SimpleNamespace(commit="x", options="")
        text = compare_tables.tex_text(args, scenes, means)
        captions = re.findall("over scenes: (.*?)}", text)
        self.assertEqual(captions, ["a, held-out views, gain-fitted", "a, b, the photos' views, gain-fitted"])
        named = {f"50 % {{#{i}}} of_x & y^2 $~\\": scenes["a"] for i in range(60)}  # names of folders are anyone's
        text = compare_tables.tex_text(args, named, compare.means(scenes))
        self.assertEqual(text.count("\\begin{table}"), 122)
        self.assertIn("but for stages that an earlier method did", text.replace("\n% ", " "))
        check_tex(self, text)

    def test_missing_views(self):
        """Figures of some views are told from those of all: not in bold, not in the mean."""
        def row(method, psnr, missing):
            layer = {"n": 3 - missing, "missing": missing, "psnr_gain": psnr, "ssim_gain": 0.5}
            return compare.row_of(method, method, {}, compare.figures({"views": {"capture": {"layers": {"T_N": layer}}}}, ["T_N"]))
        scenes = {"a": [row("full", 20, 0), row("x", 30, 2), row("y", 10, 0)]}
        self.assertEqual([r["method"] for r in compare.means(scenes)], ["full", "y"])
        args = types.SimpleNamespace(commit="x", options="")
        text = compare_tables.tex_text(args, scenes, [])
        self.assertIn("full & \\textbf{20.00}", text)
        self.assertIn("x (1 of 3 views) & 30.00/", text)
        rows = {r["method"]: r for r in csv.DictReader(io.StringIO(compare_tables.csv_text(args, scenes)))}
        self.assertEqual([rows["x"][k] for k in ("views_measured", "views_of")], ["1", "3"])
        counts = {"capture": {"T_N": (1, 3), "R": (3, 3)}}
        self.assertEqual(compare_tables.partial({"counts": counts}, "capture"), "(T_N 1 of 3 views)")
        self.assertEqual(compare_tables.partial({"counts": counts}, "held_out"), "")


class Pictures(FolderTest):
    def test_names(self):
        """A file is of the longest name that it begins with, and of none where two begin with it."""
        for name in ("a_1_flash_l.png", "a_2_l.png", "a_2_r.png", "b[3]_l.PNG", "c.tif", "c_l.png", "d_fl.png"):
            (self.dir / name).write_text("x")
        views = ["a_1", "a_1_flash", "a_2", "b[3]", "c", "d", "d_f"]
        found = [compare_pictures.find_picture(self.dir, v, views) for v in views]
        self.assertEqual([p and p.name for p in found], [None, "a_1_flash_l.png", None, "b[3]_l.PNG", "c.tif", "d_fl.png", None])

    def test_replaced(self):
        """Of this run, whatever the times of those that an earlier one left."""
        truth = self.dir / "s/truth"
        source = truth / "T_N/TEST_1.png"
        source.parent.mkdir(parents=True)
        args = types.SimpleNamespace(out=self.dir / "out", made=made.Made(self.dir / "out"), others=[], colmap=False, pictures=1)
        case = quality.Case(args, "s", self.dir / "s", "raw", True)
        for text in ("first", "then"):
            source.write_text(text)
            os.utime(source, (1, 1))
            kept, note = compare.keep_pictures(args, case, "truth", truth)
            self.assertEqual((self.dir / "out" / kept["T_N"]["TEST_1"]).read_text(), text)
            self.assertEqual(note, "")

    def test_encodings(self):
        """Pictures of others are shown as ours are, linear^0.22."""
        light = numpy.tile(numpy.linspace(0, 1, 64, dtype=numpy.float32)[None, :, None], (8, 1, 3))
        srgb = numpy.where(light <= 0.0031308, 12.92 * light, 1.055 * light ** (1 / 2.4) - 0.055)
        ours = numpy.rint(255 * light ** 0.22)
        cv2.imwrite(str(self.dir / "srgb.png"), numpy.rint(65535 * srgb).astype(numpy.uint16))
        cv2.imwrite(str(self.dir / "linear.tif"), light)
        cv2.imwrite(str(self.dir / "gamma.png"), ours.astype(numpy.uint8))
        for name in ("srgb.png", "linear.tif", "gamma.png"):
            suffix, content, note = compare_pictures.to_show(self.dir / name, name.split(".", maxsplit=1)[0])
            shown = cv2.imdecode(numpy.frombuffer(content, numpy.uint8), cv2.IMREAD_COLOR)
            self.assertEqual((suffix, note), (".png", ""))
            self.assertLessEqual(numpy.abs(shown[:, 1:] - ours[:, 1:]).max(), 1, name)
        with mock.patch.object(compare_pictures, "cv2", None):
            suffix, content, note = compare_pictures.to_show(self.dir / "srgb.png", "srgb")
            self.assertEqual((suffix, content), (".png", (self.dir / "srgb.png").read_bytes()))
            self.assertIn("(srgb), not in our encoding", note)
            suffix, _, note = compare_pictures.to_show(self.dir / "linear.tif", "linear")
            self.assertEqual(suffix, None)
            self.assertIn("no .tif", note)

    def test_page(self):
        """Names are anyone's, and end neither the script nor an address."""
        name = "</script><!--<script>a#b?c%"
        row = compare.row_of(name, name, {}, {}, ({"T_N": {"v": f"pictures/{name}.png"}}, "a note"))
        args = types.SimpleNamespace(commit="x", options="")
        page = compare.page_text(args, {name: [copy.copy(row)]}, [], [])
        data = re.search(r"^const data = (.*);$", page, re.M)[1]
        self.assertNotIn("<", data)
        self.assertEqual(json.loads(data)["scenes"][name][0], row | {"partial": {}})
        self.assertEqual(page.count("address(path)"), 2)
        self.assertNotIn("encodeURI(", page)


if __name__ == "__main__":
    common.main()
