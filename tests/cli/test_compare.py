"""bench/compare.py: methods over a small made capture and a published folder of it, in one page, CSV and LaTeX table;
what was measured is not measured again."""
import csv
import json
import os
import pathlib
import re
import shutil
import subprocess
import sys
import types

import common
from common import FolderTest, run
from pictures import give_points

common.need("cv2", "numpy")
from authors_folder import make_authors

COMPARE = pathlib.Path(__file__).resolve().parents[2] / "bench" / "compare.py"
OPTIONS = "--long-edge 96 --steps 6 --init-count 300 --max-splats 400"


def check_tex(test, text):
    """What LaTeX asks for: one number of columns a table, braces in pairs, no sign of its own that was meant as text,
    and fewer than some fifty tables until pages are made."""
    text = re.sub(r"(?m)(?<!\\)%.*$", "", text)
    depth = 0
    for sign in re.findall(r"(?<!\\)[{}]", text):
        depth += 1 if sign == "{" else -1
        test.assertGreaterEqual(depth, 0)
    test.assertEqual(depth, 0)
    test.assertNotRegex(re.sub(r"\$[TRI](_[NF])?\$", "", text), r"(?<!\\)[$_#^~]")
    for between in text.split("\\clearpage"):
        test.assertLess(between.count("\\begin{table}"), 30)
    tables = re.findall(r"\\begin{tabular}{([^\n]*)}\n(.*?)\\end{tabular}", text, re.S)
    test.assertEqual(len(tables), text.count("\\begin{table}"))
    for columns, body in tables:
        for line in body.splitlines():
            if not re.fullmatch(r"\\(top|mid|bottom)rule", line):
                test.assertEqual(len(re.findall(r"(?<!\\)&", line)), len(re.sub(r"p{.*?}", "p", columns)) - 1, line)
                test.assertTrue(line.endswith(r" \\"), line)


class Compare(FolderTest):
    def compare(self, *more):
        environment = dict(os.environ, PYTHONDONTWRITEBYTECODE="1")
        return subprocess.run([sys.executable, COMPARE, "--flashsplat", common.PROGRAM, "--scenes", self.dir / "scenes",
                               "--only", "small", "--options", OPTIONS, "--out", self.dir / "out", *map(str, more)],
                              text=True, capture_output=True, timeout=300, check=False, env=environment)

    def data(self):
        page = (self.dir / "out/compare.html").read_text()
        return json.loads(re.search(r"^const data = (.*);$", page, re.M)[1].replace("<\\/", "</"))

    def test_compare(self):
        scene, others = self.dir / "scenes/small", self.dir / "others/small"
        process = run("synth", "-o", scene, "--width", 96, "--height", 64, "--photos", 6, "--held-out", 2, "--seed", 5)
        self.assertEqual(process.returncode, 0, process.stderr)
        give_points(scene / "truth")
        (self.dir / "scenes/README.md").write_text(
            "| scene | variant, steps | T_N | R |\n|---|---|---|---|\n| small | full, 5000 | 31.25 / 0.950 | - |\n")
        (others / "T_N").mkdir(parents=True)
        for picture in (scene / "truth/T_N").glob("IMG_*"):  # as programs of single photos name theirs, and no other view
            shutil.copy(picture, others / "T_N" / f"{picture.stem}_l{picture.suffix}")
        published = self.dir / "published"
        shutil.copytree(scene / "capture/jpeg", published / "images")
        shutil.copytree(others, others.parent / "published")
        shutil.copytree(scene / "truth/sparse", published / "sparse/0")
        authors = self.dir / "authors"
        gains = make_authors(common.PROGRAM, scene, authors)
        shutil.rmtree(authors / "sparse")  # its photos are too small for points to be found in
        shutil.copytree(scene / "truth/sparse", authors / "sparse/0")
        photos = {p.stem.split("_", 2)[1]: p.name for p in (authors / "images").iterdir()}
        text = (authors / "sparse/0/images.txt").read_text()
        text = re.sub(r"IMG_(\d+)\.\w+", lambda m: photos[m[1]], text)
        (authors / "sparse/0/images.txt").write_text(text)
        wanted = ["--methods", "full,plain,no-such-option", "--method", f"copy={others.parent}", "--method-encoding",
                  "gamma", "--folders", f"{published},{authors}"]
        options = f"{OPTIONS} --npy-gains {','.join(map(str, gains))}"
        wanted += ["--options", options]
        process = self.compare(*wanted)
        self.assertEqual(process.returncode, 2)  # no such method
        wanted[1] = "full,plain"
        process = self.compare(*wanted, "--method", f"copy={self.dir / 'typo'}")
        self.assertEqual(process.returncode, 2)
        self.assertIn("copy: no folder", process.stderr)
        process = self.compare(*wanted)
        self.assertEqual(process.returncode, 0, process.stdout + process.stderr)

        with open(self.dir / "out/compare.csv", newline="") as f:
            rows = list(csv.DictReader(f))
        small = [r for r in rows if r["scene"] == "small"]
        psnr = {(r["method"], r["views"], r["layer"], r["kind"]): float(r["psnr"]) for r in small}
        self.assertEqual({r["method"] for r in rows if r["scene"] == "published"}, {"full", "plain", "copy"})
        beside = [r for r in rows if r["scene"] == "authors"]
        self.assertEqual({r["method"] for r in beside}, {"full", "plain", "published"})
        paper = next(r for r in beside if r["title"].endswith(": Flash-Splat"))
        self.assertEqual([paper[k] for k in ("views", "layer", "kind", "psnr", "lpips")],
                         ["capture", "T_N", "paper's convention", "20.42", "0.2868"])
        self.assertEqual(psnr["copy", "capture", "T_N", "as it is"], 120)
        self.assertEqual(psnr["published", "held_out", "T_N", "gain-fitted"], 31.25)
        told = json.loads((self.dir / "out/small-true/full-held_out.json").read_text())
        told = told["methods"]["flashsplat"]["layers"]
        for layer in ("T_N", "T_F", "R", "I_N", "I_F"):
            self.assertAlmostEqual(psnr["full", "held_out", layer, "gain-fitted"], told[layer]["psnr_gain"], delta=1e-2)
        paper = psnr["full", "held_out", "T_N", "paper's convention"]
        self.assertAlmostEqual(paper, told["T_N"]["psnr_paper"], delta=1e-2)
        self.assertNotIn(("plain", "held_out", "R", "gain-fitted"), psnr)
        for r in rows:
            if r["method"] in ("full", "plain"):
                self.assertTrue(min(float(r["seconds"]), float(r["cpu_seconds"])) > 0, r)
                self.assertTrue(10 < float(r["megabytes"]) < 4000 and r["splats"], r)

        data = self.data()
        found = [r["method"] for r in data["scenes"]["small"]]
        self.assertEqual(found, ["truth", "full", "plain", "copy", "published"])
        self.assertEqual([r["method"] for r in data["means"]], ["full", "plain", "copy"])
        self.assertEqual(data["means"][0]["scenes"], {views: ["small"] for views in ("held_out", "capture")})
        names = {r["method"]: {v for of in r["pictures"].values() for v in of} for r in data["scenes"]["small"]}
        self.assertTrue(names["copy"] and names["copy"] <= names["truth"] & names["full"], names)  # side by side
        self.assertTrue(any(v.startswith("TEST") for v in names["full"]))
        beside = {r["method"]: r["pictures"] for r in data["scenes"]["published"]}
        self.assertEqual(beside["copy"]["T_N"].keys(), beside["full"]["T_N"].keys())  # no figures, but pictures
        shown = [path for of in data["scenes"].values() for r in of for views in r["pictures"].values()
                 for path in views.values()]
        self.assertGreater(len(shown), 20)
        for path in shown:
            self.assertTrue((self.dir / "out" / path).is_file(), path)
        tex = (self.dir / "out/compare.tex").read_text()
        self.assertIn("\\textbf{", tex)
        check_tex(self, tex)
        self.assertRegex(tex, r"full & [\\{}a-z]*\d+\.\d\d\}?/\.\d{3}/\.\d{3} & .* & \d+ & \d+ & [1-9] \\\\")
        self.assertRegex(tex, r"small, held-out views, paper's convention")
        self.assertRegex(tex, r"authors, .*(.|\n)*full & -- &(.|\n)*Flash-Splat & \\textbf{20.42}/.287 &")

        logs = {p: p.stat().st_size for p in (self.dir / "out").glob("*.json")}
        before = (self.dir / "out/small-true/clouds/T_N.ply").stat().st_mtime_ns
        self.assertEqual(self.compare(*wanted).returncode, 0)
        self.assertEqual((self.dir / "out/small-true/clouds/T_N.ply").stat().st_mtime_ns, before)  # kept, not trained
        self.assertEqual({p: p.stat().st_size for p in (self.dir / "out").glob("*.json")}, logs)
        self.assertEqual(self.data()["scenes"], data["scenes"])
        shutil.rmtree(others)  # a folder of this name with nothing in it is told
        others.mkdir()
        process = self.compare(*wanted)
        self.assertEqual(process.returncode, 1)
        self.assertIn("small, true poses, copy:", process.stderr)


class Means(FolderTest):
    def test_scenes_of_each(self):
        """What has no held-out views is in the mean of the photos' places only, and the captions say so."""
        sys.dont_write_bytecode = True
        sys.path.insert(0, str(COMPARE.parent))
        import compare  # pylint: disable=import-outside-toplevel
        figures = {"T_N": {"gain": {"psnr": 30.0, "ssim": 0.9}}}
        with_both, without = {"held_out": figures, "capture": figures}, {"capture": figures}
        scenes = {name: [compare.row_of("full", "full", {}, of, {})] for name, of in (("a", with_both), ("b", without))}
        means = compare.means(scenes)
        self.assertEqual(means[0]["scenes"], {"held_out": ["a"], "capture": ["a", "b"]})
        args = types.SimpleNamespace(commit="x", options="")
        captions = re.findall("over scenes: (.*?)}", compare.tex_text(args, scenes, means))
        self.assertEqual(captions, ["a, held-out views, gain-fitted", "a, b, the photos' views, gain-fitted"])
        named = {f"50 % {{#{i}}} of_x & y^2 $~\\": scenes["a"] for i in range(60)}  # names of folders are anyone's
        text = compare.tex_text(args, named, compare.means(scenes))
        self.assertEqual(text.count("\\begin{table}"), 122)
        check_tex(self, text)

    def test_pictures_of_others(self):
        """A file is of the longest name that it begins with, and of none where two begin with it."""
        sys.path.insert(0, str(COMPARE.parent))
        import compare  # pylint: disable=import-outside-toplevel
        for name in ("a_1_flash_l.png", "a_2_l.png", "a_2_r.png", "b[3]_l.PNG"):
            (self.dir / name).write_text("x")
        views = ["a_1", "a_1_flash", "a_2", "b[3]"]
        found = [compare.find_picture(self.dir, v, views) for v in views]
        self.assertEqual([p and p.name for p in found], [None, "a_1_flash_l.png", None, "b[3]_l.PNG"])


if __name__ == "__main__":
    common.main()
