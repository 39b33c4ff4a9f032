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

import common
from common import FolderTest, run
from pictures import give_points
from tex import check_tex

common.need("cv2", "numpy")
from authors_folder import make_authors

COMPARE = pathlib.Path(__file__).resolve().parents[2] / "bench" / "compare.py"
OPTIONS = "--long-edge 96 --steps 6 --init-count 300 --max-splats 400"


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
        self.assert_works(run("synth", "-o", scene, "--width", 96, "--height", 64, "--photos", 8, "--held-out", 2, "--seed", 5))
        give_points(scene / "truth")
        (self.dir / "scenes/README.md").write_text(
            "| scene | variant, steps | T_N | R |\n|---|---|---|---|\n| small | full, 5000 | 31.25 / 0.950 | - |\n")
        (others / "T_N").mkdir(parents=True)
        for picture in (scene / "truth/T_N").glob("IMG_*"):  # as programs of single photos name theirs, and no other view
            shutil.copy(picture, others / "T_N" / f"{picture.stem}_l{picture.suffix}")
        some = self.dir / "some/small/T_N"  # of one photo only, as good as can be
        some.mkdir(parents=True)
        shutil.copy(next((scene / "truth/T_N").glob("IMG_*")), some)
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
        wanted = ["--methods", "full,plain,no-such-option", "--method", f"some={some.parents[1]},copy={others.parent}",
                  "--method-encoding", "gamma", "--folders", f"{published},{authors}"]
        options = f"{OPTIONS} --npy-gains {','.join(map(str, gains))}"
        wanted += ["--options", options]
        process = self.compare(*wanted)
        self.assertEqual(process.returncode, 2)  # no such method
        wanted[1] = "full,plain"
        process = self.compare(*wanted, "--method", f"copy={self.dir / 'typo'}")
        self.assertEqual(process.returncode, 2)
        self.assertIn("copy: no folder", process.stderr)
        self.assert_works(self.compare(*wanted))

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
        measured = {r["method"]: (r["views_measured"], r["views_of"]) for r in small if (r["views"], r["layer"]) == ("capture", "T_N")}
        self.assertEqual(measured["some"][0], "1")
        self.assertEqual(len(set(measured["copy"])), 1)
        self.assertEqual(measured["copy"][1], measured["some"][1])
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
        self.assertEqual(found, ["truth", "full", "plain", "some", "copy", "published"])
        row = {r["method"]: r for r in data["scenes"]["small"]}
        self.assertRegex(row["some"]["partial"]["capture"], r"^\(1 of \d+ views\)$")
        self.assertTrue(any("views are missing" in w for w in row["some"]["warnings"]), row["some"]["warnings"])
        self.assertFalse(any(r["partial"].get("capture") for name, r in row.items() if name != "some"))
        for view, of in row["full"]["of_view"]["T_N"].items():  # what stands under a picture is of that picture
            which = "held_out" if view.startswith("TEST") else "capture"
            here = json.loads((self.dir / f"out/small-true/full-{which}.json").read_text())
            here = here["methods"]["flashsplat"]["layers"]["T_N"]["views"][view]
            self.assertAlmostEqual(of["gain"], here["psnr_gain"], delta=1e-2)
        self.assertEqual({of[""] for of in row["copy"]["of_view"]["T_N"].values()}, {120})
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
        self.assertRegex(tex, r"some \(1 of \d views\) & \d+\.\d\d/")  # never in bold
        self.assertRegex(tex, r"authors, .*(.|\n)*full & -- &(.|\n)*Flash-Splat & \\textbf{20.42}/.287 &")

        logs = {p: p.stat().st_size for p in (self.dir / "out").glob("*.json")}
        before = (self.dir / "out/small-true/clouds/T_N.ply").stat().st_mtime_ns
        self.assert_works(self.compare(*wanted))
        self.assertEqual((self.dir / "out/small-true/clouds/T_N.ply").stat().st_mtime_ns, before)  # kept, not trained
        self.assertEqual({p: p.stat().st_size for p in (self.dir / "out").glob("*.json")}, logs)
        self.assertEqual(self.data()["scenes"], data["scenes"])
        shutil.rmtree(others)  # a folder of this name with nothing in it is told
        others.mkdir()
        process = self.compare(*wanted)
        self.assertEqual(process.returncode, 1)
        self.assertIn("small, true poses, copy:", process.stderr)


if __name__ == "__main__":
    common.main()
