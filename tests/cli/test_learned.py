"""What training learns of the camera: each photo's white balance, the response, vignetting; other shutters of flash photos."""
import json
import math
import pathlib
import sys

import common
from common import FolderTest, run

common.need("cv2", "numpy")
import cv2
import numpy

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parent.parent.parent / "bench"))
import seen_clear

SIZE = ["--width", 192, "--height", 128, "--photos", 16, "--held-out", 4, "--seed", 31]
TRAIN = ["--preset", "preview", "--long-edge", 192, "--init-count", 3000, "--steps", 500]


class Learned(FolderTest):
    def setUp(self):
        super().setUp()
        self.scene, self.out = self.dir / "scene", self.dir / "out"

    def make(self, faults):
        self.assert_works(run("synth", "-o", self.scene, *SIZE, "--field", faults))
        return json.loads((self.scene / "truth/nuisance.json").read_text())

    def train(self, photos, *options):
        words = ["run", self.scene / "capture" / photos, "-o", self.out, "--poses", self.scene / "truth/sparse", *TRAIN, *options]
        self.assert_works(run(*words))
        read = lambda name: json.loads((self.out / "clouds" / name).read_text())
        return read("model.json"), {p["name"]: p for p in read("photos.json")["photos"]}

    def composite_psnr(self):
        truth = self.scene / "truth"
        self.assert_works(run("render", self.out, "--output", self.dir / "views", "--cameras", truth / "cameras.json", "--layers", "I_N,I_F"))
        figures = self.dir / f"figures-{len(list(self.dir.iterdir()))}.json"
        self.assert_works(run("evaluate", self.out, truth, "--output", self.dir / "views", "--json", figures))
        layers = next(iter(json.loads(figures.read_text())["methods"].values()))["layers"]
        return sum(layers[l]["psnr_gain"] for l in ("I_N", "I_F")) / 2

    def test_photographer(self):
        size = ["--width", 300, "--height", 200, "--photos", 16, "--held-out", 4, "--seed", 33]
        words = ["--poses", self.scene / "truth/sparse", "--preset", "preview", "--init-count", 8000, "--steps", 1100]
        figures, clouds = {}, {}
        for faults in ("photographer", ""):
            self.assert_works(run("synth", "-o", self.scene, *size, *(["--field", faults] if faults else [])))
            for option in ("--photographer", "--no-photographer"):
                out = self.dir / f"out{faults}{option}"
                self.assert_works(run("run", self.scene / "capture/raw", "-o", out, *words, option))
                share = self.shares_of(out, "photographer")
                self.assertLess(sum(self.shares_of(out, "passers_by")), 0.01 * len(share))  # nobody does
                found = bool(faults) and option == "--photographer"
                self.assertEqual(found, "photographer is mirrored" in (out / "index.html").read_text())
                self.assertEqual(found, max(share) > 0.03, share)
                if not found:
                    self.assertEqual(max(share), 0)
                self.assert_works(run("render", out, "--output", self.dir / "views", "--cameras",
                                      self.scene / "truth/cameras.json", "--layers", "R,T_N", "--force"))
                report = self.dir / f"{out.name}.json"
                self.assert_works(run("evaluate", out, self.scene / "truth", "--output", self.dir / "views", "--views",
                                      "held_out", "--json", report))
                layers = next(iter(json.loads(report.read_text())["methods"].values()))["layers"]
                figures[faults, option] = {l: layers[l]["psnr_gain"] for l in ("R", "T_N")}
                clouds[faults, option] = [(out / "clouds" / n).read_bytes() for n in ("T_N.ply", "R.ply", "model.json")]
                self.assertEqual(found, (out / "renders/unseen").is_dir())
                if found:
                    self.check_unseen(out)
                    self.check_damage(out, ["run", self.scene / "capture/raw", *words, option, "--resume"])
        with_him = figures["photographer", "--photographer"]
        self.assertGreater(with_him["R"], figures["photographer", "--no-photographer"]["R"] + 0.2)
        self.assertGreater(with_him["T_N"], figures["photographer", "--no-photographer"]["T_N"] + 0.3)
        self.assertTrue(clouds["", "--photographer"] == clouds["", "--no-photographer"])  # as if nobody had looked

    def test_photographer_over_a_case(self):
        """Seen upside down, and turned with the photos: where the truth has people, and hardly elsewhere; no bars."""
        size = ["--width", 300, "--height", 200, "--photos", 16, "--held-out", 1, "--seed", 42]
        self.assert_works(run("synth", "-o", self.scene, *size, "--field", "photographer"))
        self.assert_works(run("run", self.scene / "capture/raw", "-o", self.out, "--poses", self.scene / "truth/sparse",
                              "--preset", "preview", "--init-count", 8000, "--steps", 1300))
        both = found = there = 0
        learned = json.loads((self.out / "clouds/photos.json").read_text())
        self.assertEqual(learned["bars"], 0)
        for photo in learned["photos"]:
            hidden = numpy.array([[int(digit) > 4 for digit in row] for row in photo["hidden"]])
            figure = cv2.imread(str(self.scene / "truth/figures" / f"{photo['name']}.png"), cv2.IMREAD_GRAYSCALE)
            figure = cv2.resize(figure, hidden.shape[::-1], interpolation=cv2.INTER_AREA) > 127
            both, found, there = both + (hidden & figure).sum(), found + hidden.sum(), there + figure.sum()
        self.assertGreater(both / found, 0.75)
        self.assertGreater(both / there, 0.5)

    def test_passers_by(self):
        """Someone walks by in six photos of ten."""
        size = ["--width", 300, "--height", 200, "--photos", 16, "--held-out", 4, "--seed", 36]
        words = ["--poses", self.scene / "truth/sparse", "--preset", "preview", "--init-count", 8000, "--steps", 1400,
                 "--no-photographer"]
        figures = {}
        self.assert_works(run("synth", "-o", self.scene, *size, "--field", "pedestrian"))
        for option in ("--passers-by", "--no-passers-by"):
            self.out = self.dir / f"out{option}"
            self.assert_works(run("run", self.scene / "capture/raw", "-o", self.out, *words, option))
            share = self.shares_of(self.out, "passers_by")
            found = option == "--passers-by"
            self.assertTrue(not found or sum(s > 0 for s in share) > 3, share)
            self.assertLess(sum(share) / len(share), 0.04 if found else 1e-9)
            said = "photos show something that the others do not" in (self.out / "index.html").read_text()
            self.assertEqual(found, said)
            figures[option] = self.composite_psnr()
        self.assertGreater(figures["--passers-by"], figures["--no-passers-by"] + 0.2)

    def shares_of(self, out, what):
        return [p[what] for p in json.loads((out / "clouds/photos.json").read_text())["photos"]]

    def test_bars(self):
        words = ["--poses", self.scene / "truth/sparse", "--preset", "preview", "--steps", 1250, "--max-splats", 12000]
        large = ["--width", 300, "--height", 200, "--hard", "frame"], ["--init-count", 8000]
        small = ["--width", 120, "--height", 80], ["--init-count", 1500, "--no-photographer"]
        figures, clouds = {}, {}
        for hard, (size, start) in (("frame", large), ("", small)):
            self.assert_works(run("synth", "-o", self.scene, *size, "--photos", 16, "--held-out", 4, "--seed", 301))
            for option in ("--bars", "--no-bars"):
                out = self.dir / f"out{hard}{option}"
                process = self.assert_works(run("run", self.scene / "capture/raw", "-o", out, *words, *start, option))
                found = bool(hard) and option == "--bars"
                self.assertEqual(found, "where nothing is mirrored" in process.stdout + process.stderr)
                self.assertEqual(found, json.loads((out / "clouds/photos.json").read_text())["bars"] > 0.02)
                self.assertEqual(found, "Nothing is mirrored there" in (out / "index.html").read_text())
                self.assertEqual(found, b"property float cover" in (out / "clouds/T_N.ply").read_bytes()[:2000])
                clouds[hard, option] = [(out / "clouds" / n).read_bytes() for n in ("T_N.ply", "R.ply", "model.json")]
                if hard:
                    figures[option] = self.figures_of(out)
        self.assertGreater(figures["--bars"]["R"], figures["--no-bars"]["R"] + 2)
        self.assertGreater(figures["--bars"]["beta"], figures["--no-bars"]["beta"] + 3)
        self.assertGreater(figures["--bars"]["T_F"], figures["--no-bars"]["T_F"] - 1)
        self.assertTrue(clouds["", "--bars"] == clouds["", "--no-bars"])  # as if nobody had looked

    def test_bars_among_the_mirrored(self):
        """The start has them in R: they are found all the same, and T begins with them."""
        words = ["--poses", self.scene / "truth/sparse", "--preset", "preview", "--init-count", 8000, "--max-splats", 9000]
        self.assert_works(run("synth", "-o", self.scene, "--width", 300, "--height", 200, "--hard", "frame", "--photos", 16,
                              "--held-out", 4, "--seed", 301))
        self.assert_works(run("run", self.scene / "capture/raw", "-o", self.out, *words, "--steps", 20))
        self.bars_to_mirrored()
        process = self.assert_works(run("train", self.out, "--preset", "preview", "--steps", 1250, "--max-splats", 9000, "--no-photographer", "--no-dirt", "--force"))
        self.assertIn("found bars, where nothing is mirrored", process.stdout + process.stderr)
        self.assertGreater(json.loads((self.out / "clouds/photos.json").read_text())["bars"], 0.02)

    def bars_to_mirrored(self):
        """What T begins with where most views of the truth mirror nothing becomes R's."""
        heads, rows = {}, {}
        for name in ("T_N", "R"):
            head, data = (self.out / f"start/{name}.ply").read_bytes().split(b"end_header\n")
            heads[name], rows[name] = head, numpy.frombuffer(data, "<f4").reshape(-1, head.count(b"property"))
        votes = numpy.zeros((2, len(rows["T_N"])))
        for view in json.loads((self.scene / "truth/cameras.json").read_text())["images"]:
            path = self.scene / f"truth/beta/{view['name']}.png"
            if not path.exists():
                continue
            beta = cv2.imread(str(path), cv2.IMREAD_UNCHANGED)
            at = rows["T_N"][:, :3] @ numpy.array(view["w2c"])[:3, :3].T + numpy.array(view["w2c"])[:3, 3]
            x, y = (view[f] * at[:, k] / at[:, 2] + view[c] for k, f, c in ((0, "fx", "cx"), (1, "fy", "cy")))
            seen = (at[:, 2] > 0) & (x >= 0) & (x < beta.shape[1]) & (y >= 0) & (y < beta.shape[0])
            votes[:, seen] += [beta.reshape(*beta.shape[:2], -1)[y[seen].astype(int), x[seen].astype(int), 0] == 0, numpy.ones(seen.sum())]
        near = votes[0] > votes[1] / 2
        self.assertGreater(near.mean(), 0.04)
        width = rows["R"].shape[1]  # R has no gains, which are T's last
        rows = {"T_N": rows["T_N"][~near], "R": numpy.concatenate([rows["R"], rows["T_N"][near][:, :width]])}
        model = json.loads((self.out / "start/model.json").read_text())
        for name, table in rows.items():
            head = heads[name].replace(b"element vertex %d\n" % model["clouds"][name], b"element vertex %d\n" % len(table))
            (self.out / f"start/{name}.ply").write_bytes(head + b"end_header\n" + table.astype("<f4").tobytes())
            model["clouds"][name] = len(table)
        (self.out / "start/model.json").write_text(json.dumps(model))

    def figures_of(self, out):
        """PSNR at the held-out views; of beta against the best multiple of the truth, since its unit is free."""
        views, truth, report = self.dir / "views", self.scene / "truth", self.dir / f"{out.name}.json"
        self.assert_works(run("render", out, "--output", views, "--cameras", truth / "cameras.json", "--layers", "R,T_F,beta", "--force"))
        self.assert_works(run("evaluate", out, truth, "--output", views, "--views", "held_out", "--json", report))
        layers = next(iter(json.loads(report.read_text())["methods"].values()))["layers"]
        errors = []
        for path in sorted((views / "beta").glob("TEST_*.png")):
            found, true = (cv2.imread(str(p), cv2.IMREAD_UNCHANGED).astype(float) for p in (path, truth / "beta" / path.name))
            found, true = (x[..., 0] if x.ndim > 2 else x for x in (found, true))
            found = (found / found.max()) * (true * found / found.max()).sum() / ((found / found.max()) ** 2).sum()
            errors.append(((found - true) ** 2).mean() / (true ** 2).mean())
        self.assertTrue(errors)
        return {"R": layers["R"]["psnr_gain"], "T_F": layers["T_F"]["psnr_gain"], "beta": -10 * math.log10(sum(errors) / len(errors))}

    def check_unseen(self, out):
        """White is what fewer than a quarter of the photos show clear of the true figures, but for their outlines; R is worse there."""
        self.assert_works(run("render", out, "--output", self.dir / "depths", "--cameras", self.scene / "truth/cameras.json",
                              "--layers", "R,depth_R", "--metres-per-unit", 1))
        cameras = json.loads((self.scene / "truth/cameras.json").read_text())["images"]
        photos = [c for c in cameras if not c["held_out"]]
        both = either = 0
        errors = {True: [], False: []}
        for camera in (c for c in cameras if c["held_out"]):
            name = f"{camera['name']}.png"
            white = cv2.imread(str(self.dir / "depths/unseen" / name), cv2.IMREAD_UNCHANGED)
            self.assertEqual(set(numpy.unique(white)) - {0, 255}, set())
            depth = cv2.imread(str(self.dir / "depths/depth_R" / name), cv2.IMREAD_UNCHANGED) / 1000
            points = seen_clear.points_of(camera, depth)
            hidden = seen_clear.photos_that_see(points, photos, self.scene / "truth/figures") < 4
            both += (hidden & (white > 0)).sum()
            either += (hidden | (white > 0)).sum()
            R, truth = (cv2.imread(str(folder / "R" / name)).astype(float) for folder in (self.dir / "depths", self.scene / "truth"))
            for guess in errors:
                errors[guess].append(numpy.abs(R - truth).mean(-1)[(white > 0) == guess])
        print(f"unseen: {both / either:.2f} of the union, error there {numpy.concatenate(errors[True]).mean():.1f}, "
              f"elsewhere {numpy.concatenate(errors[False]).mean():.1f}")
        self.assertGreater(both / either, 0.4)
        self.check_damaged_cells(out)
        self.assertGreater(numpy.concatenate(errors[True]).mean(), 2 * numpy.concatenate(errors[False]).mean())

    def check_damaged_cells(self, out):
        path = out / "clouds/photos.json"
        text = path.read_text()
        for found, damage in (('"00000000', '"000000x0'), ('"00000000', '"0')):
            path.write_text(text.replace(found, damage, 1))
            self.assert_fails(run("render", out, "--output", self.dir / "depths", "--force"), 1, "photos.json")
        path.write_text(text)

    def check_damage(self, out, words):
        """A checkpoint with a share of light that is no number is refused."""
        path = out / "checkpoint/occlusion.bin"
        data = path.read_bytes()
        path.write_bytes(data[:4000] + b"\xff" * 4 + data[4004:])
        (out / "done/train.json").unlink()
        process = run(*words, "-o", out)
        self.assertEqual(process.returncode, 1, process.stdout + process.stderr)
        self.assertIn("occlusion.bin: ", process.stderr)

    def test_jpeg(self):
        truth = self.make("jpeg,white-balance")
        model, photos = self.train("jpeg")
        white = {p["name"]: p["white_balance"] for p in truth["photos"]}
        for c in (0, 2):  # against green and the mean of all photos
            found = {n: math.log(p["white_balance"][c] / p["white_balance"][1]) for n, p in photos.items()}
            true = {n: math.log(white[n][c] / white[n][1]) for n in found}
            middle = sum(found[n] - true[n] for n in found) / len(found)
            rms = lambda x: math.sqrt(sum(v * v for v in x) / len(found))
            self.assertGreater(rms(true.values()), 0.03)
            self.assertLess(rms(found[n] - true[n] - middle for n in found), 0.45 * rms(true.values()))
        response = model["response"]
        self.assertEqual(len(response), 11)
        self.assertEqual(response[0], 0)
        self.assertLess(response[8], -0.02)  # the shoulder: white is darker than straight on
        page = (self.out / "index.html").read_text()
        self.assertIn("tone curve", page)
        self.assertIn("Behind the glass</th>", page)
        learned = self.composite_psnr()
        self.train("jpeg", "--response", "as-is")
        self.assertGreater(learned, self.composite_psnr() + 0.5)

    def test_raw(self):
        truth = self.make("vignetting,flash-jitter=0.2")
        model, photos = self.train("raw")
        self.assertEqual(model["response"], [0] * 11)
        self.assertTrue(all(p["white_balance"] == [1, 1, 1] for p in photos.values()))
        corner = (1 + sum(model["vignetting"])) ** (1 / 0.22)
        self.assertLess(corner, 0.92)
        flash = [(math.log(photos[p["name"]]["flash"]), math.log(p["gain_flash"])) for p in truth["photos"] if p["flash"]]
        means = [sum(f[k] for f in flash) / len(flash) for k in (0, 1)]
        products = [sum((f[i] - means[i]) * (f[j] - means[j]) for f in flash) for i, j in ((0, 1), (0, 0), (1, 1))]
        self.assertGreater(products[0] / math.sqrt(products[1] * products[2]), 0.7)  # correlation

    def test_off(self):
        self.make("vignetting")
        model, photos = self.train("raw", "--no-vignetting", "--no-photo-light", "--steps", 20)
        self.assertEqual(model["vignetting"], [0, 0, 0])
        self.assertTrue(all(p["flash"] == p["mirrored"] == p["transmitted"] == 1 for p in photos.values()))
        self.assertNotIn("corners of the photos", (self.out / "index.html").read_text())

    def test_under(self):
        """Photos 4 stops darker: nearly as good a separation, that much darker, however bright training sees them."""
        light, figures = {}, {}
        for faults in ("under=4", ""):
            self.assert_works(run("synth", "-o", self.scene, *SIZE, *(["--field", faults] if faults else [])))
            for options in ((), ("--brightness", "0")):
                self.train("raw", "--force", *options)
                self.assert_works(run("render", self.out, "--output", self.dir / "views", "--cameras",
                                      self.scene / "truth/cameras.json", "--layers", "T_N,R", "--force"))
                report = self.dir / "report.json"
                self.assert_works(run("evaluate", self.out, self.scene / "truth", "--output", self.dir / "views",
                                      "--views", "held_out", "--json", report))
                layers = next(iter(json.loads(report.read_text())["methods"].values()))["layers"]
                figures[faults, options] = layers["T_N"]["psnr_gain"] + layers["R"]["psnr_gain"]
                pictures = [cv2.imread(str(p)) for p in sorted((self.dir / "views/T_N").glob("TEST*"))]
                light[faults, options] = numpy.mean((numpy.array(pictures) / 255) ** (1 / 0.22))
        for options in ((), ("--brightness", "0")):
            self.assertLess(abs(math.log2(light["", options] / light["under=4", options]) - 4), 0.2, light)
        self.assertGreater(figures["under=4", ()], figures["", ()] - 2, figures)
        self.assertNotEqual(figures["under=4", ()], figures["under=4", ("--brightness", "0")])
        self.assertEqual(figures["", ()], figures["", ("--brightness", "0")])  # bright enough

    def test_shutter(self):
        truth = self.make("shutter=0.9")
        process = self.assert_works(run("run", self.scene / "capture/raw", "-o", self.out, "--poses", self.scene / "truth/sparse", *TRAIN, "--steps", 20))
        views = {v["name"]: v for v in json.loads((self.out / "views.json").read_text())["views"]}
        flash = [p for p in truth["photos"] if p["flash"]]
        self.assertGreater(len({p["shutter"] for p in flash}), 1)
        for p in flash:
            self.assertAlmostEqual(p["exposure_flash"] / p["exposure_ambient"], views[p["name"]]["flash_gain"]
                                   * flash[0]["exposure_flash"] / flash[0]["exposure_ambient"] / views[flash[0]["name"]]["flash_gain"],
                                   delta=0.05)
        lit = [p["exposure_ambient"] * views[p["name"]]["exposure_gain"] for p in truth["photos"] if p["name"] in views]
        self.assertGreater(len({views[p["name"]]["exposure_gain"] for p in truth["photos"] if p["name"] in views}), 1)
        self.assertLess(max(lit) / min(lit), 1.05)
        self.assertIn("flash photos have another shutter time", process.stderr)


class Little(FolderTest):
    def test_little_is_mirrored(self):
        """Where few points and little light are, the start says so, and training takes what is ambiguous for transmitted."""
        for share, little in ((0.12, True), (0.45, False)):
            made, out = self.dir / f"made-{share}", self.dir / f"out-{share}"
            for words in (["synth", "-o", made, "--seed", 5, "--width", 240, "--height", 160, "--photos", 18, "--held-out",
                           0, "--reflection", share],
                          ["ingest", made / "capture/raw", "-o", out, "--long-edge", 240],
                          ["poses", out, "--poses", made / "truth/sparse"], ["initialise", out, "--init-count", 3000]):
                process = self.assert_works(run(*words))
            self.assertEqual("little is mirrored" in process.stdout, little)
            self.assertEqual(json.loads((out / "start/model.json").read_text())["rare"] > 0, little)


common.main()
