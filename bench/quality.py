#!/usr/bin/env python3
"""Separation quality over many scenes and variants: one table (markdown) and one contact sheet per scene.

Trains every scene of --scenes (rendered captures with ground truth: capture/raw, truth) and a set of captures made by
`flashsplat synth`, and lets `flashsplat evaluate` compare each with its truth at held-out and at capture views. What
was measured before with the same program and the same options is taken from the folder --out and not run again.
With --curve instead: how good it gets by how many seconds, a table and a plot.
Contact sheets and the two difference variants need python3-opencv; without it they are left out.
"""
import argparse, concurrent.futures, copy, datetime, fnmatch, json, os, pathlib, re, shutil, subprocess, sys, tempfile
import threading, time

from captures import ONLY_NAMED, SYNTH
from made import Made, NotOurs, digest
from program import Failed, call, content

try:
    import cv2, numpy
    cv2.setNumThreads(1)
except ImportError:
    cv2 = None

ROOT = pathlib.Path(__file__).resolve().parent.parent
LAYERS = "T_N T_F R I_N I_F".split()
# The paper's settings with a start and a budget for 300 pixels; its 350000 points a layer are for 1200.
PAPER = ["--preset", "paper", "--init-count", "24000", "--max-splats", "60000"]
OUR_CUE = [*PAPER, "--flash-cue", "contrast"]  # a start that works on all scenes: ablations tell what they lack
VARIANTS = {  # name: (options of `run`, layers it has)
    "full": ([], LAYERS),
    "preview": (["--preset", "preview"], LAYERS),  # beside full with --options ""
    "flashless": (["--separation", "flashless"], LAYERS),
    "linear": (["--separation", "linear"], LAYERS),
    "none": (["--separation", "none"], "T_N T_F I_N I_F".split()),
    "paper": (PAPER, LAYERS),
    "contrast-cue": (OUR_CUE, LAYERS),
    "no-linearity": ([*OUR_CUE, "--linearity", "0"], LAYERS),
    "no-smoothness": ([*OUR_CUE, "--depth-smooth", "0", "--beta-smooth", "0"], LAYERS),
    "intensity-cue": ([*PAPER, "--flash-cue", "intensity"], LAYERS),  # as the paper words it, the other is its program's
    "paper-flashless": ([*OUR_CUE, "--separation", "flashless"], LAYERS),
    "paper-linear": ([*OUR_CUE, "--separation", "linear"], LAYERS),
    "no-cue": ([*PAPER, "--flash-cue", "none"], LAYERS),  # all points start both scenes
    "separate-poses": ([*OUR_CUE, "--align", "separate"], LAYERS),  # of flash and no-flash photos, where COLMAP finds them
    "nerf": (["--preset", "nerf"], "T_N T_F I_N I_F".split()),
    "nerfren": (["--preset", "nerfren"], LAYERS),
    "flash-nerf": (["--preset", "flash-nerf"], LAYERS),
    "pseudo-pair": (None, ["T_N"]),  # gamma(F - N) of two scenes, one trained on flash photos only, one on the others
    "true-pair": (None, ["T_N"]),  # gamma(I_F - I_N) of the true composites: no training
}
SHARES = (1 / 8, 1 / 4, 1 / 2, 1)  # of the steps, --curve


def common_arguments(description, out):
    p = argparse.ArgumentParser(description=description, formatter_class=argparse.RawDescriptionHelpFormatter)
    p.add_argument("--flashsplat", default=str(ROOT / "build" / "flashsplat"), help="the program")
    p.add_argument("--scenes", default=str(ROOT.parent / "shared" / "scenes"), help="folder of captures with truth")
    p.add_argument("--only", default="", help="names of scenes, comma-separated, * for any letters (default: all but full-*, field-*, straight-*, faint-* and lit-*)")
    p.add_argument("--jpeg", action="store_true", help="every scene from its JPEG files instead of RAW")
    p.add_argument("--out", default=str(ROOT / "demo" / out), help="folder for everything this makes")
    p.add_argument("--options", default="--preset preview --long-edge 300", help="options of every run")
    p.add_argument("--synth-options", default="", help="options of every made capture, e.g. '--width 300 --height 200'")
    p.add_argument("--jobs", type=int, default=1, help="scenes at once, the cores shared out among them (default: 1)")
    p.add_argument("--force", action="store_true", help="measure again what was measured before")
    return p


def arguments():
    p = common_arguments(__doc__, "quality")
    p.add_argument("--variants", default="full", help="of " + ", ".join(VARIANTS))
    p.add_argument("--colmap", action="store_true", help="with COLMAP's poses too, measured at the capture views")
    p.add_argument("--curve", action="store_true", help="measure after an eighth, a quarter, half and all of the steps")
    return p.parse_args()


def prepare(args):
    """The program and the commit that figures are of, and what of the machine each scene gets."""
    if not pathlib.Path(args.flashsplat).is_file():
        sys.exit(f"{args.flashsplat}: no program there; run `make` first or give --flashsplat")
    args.flashsplat = str(pathlib.Path(args.flashsplat).resolve())
    args.program = digest(pathlib.Path(args.flashsplat).read_bytes())
    git = subprocess.run(["git", "-C", ROOT, "describe", "--always", "--dirty"], capture_output=True, text=True)
    args.commit = git.stdout.strip() or "unknown"
    args.share = ["--threads", max(1, len(os.sched_getaffinity(0)) // args.jobs)] if args.jobs > 1 else []
    try:
        args.made = Made(args.out)
    except OSError as e:
        sys.exit(str(e) if isinstance(e, NotOurs) else f"--out {args.out}: no folder can be made or written there: {e.strerror}")


class Case:
    """A scene, its photos and the poses they are given; where its runs and figures are kept."""

    def __init__(self, args, name, scene, photos, true_poses, recipe=None):
        self.name, self.scene, self.true_poses, self.recipe = name, scene, true_poses, recipe
        self.photos = scene / "capture" / photos
        self.poses = "true" if true_poses else "COLMAP"
        self.base = pathlib.Path(args.out)
        self.out = self.base / f"{name}-{self.poses}"
        self.log = self.base / f"{name}-{self.poses}.log"
        self.most = {}  # memory and CPU time of the last variant's runs

    def views(self, variant):
        """Where it is measured."""
        return (["held_out"] if self.true_poses else []) + (["capture"] if variant != "true-pair" else [])

    def lens_model(self):
        """The true poses with the lens that the photos were taken with."""
        lens = self.scene / "truth" / "sparse_opencv"
        return lens if lens.is_dir() and not self.photos.name.endswith("-clean") else self.scene / "truth" / "sparse"

    def ready(self, args):
        """Hash of what the photos and the truth hold; a made capture is made first, where what is there is of another
        recipe."""
        if self.recipe:
            self.make(args)
        return content(self.photos, self.scene / "truth")

    def make(self, args):
        key = digest(self.recipe, args.synth_options, *(f.read_bytes() for f in sorted((ROOT / "src/synth").glob("*.?"))))
        mark = self.scene.parent / f"{self.scene.name}.key"
        with MAKING.setdefault(str(self.scene), threading.Lock()):
            if not self.photos.is_dir() or not mark.is_file() or mark.read_text() != key:
                seed, hard, *options = self.recipe
                self.scene.parent.mkdir(parents=True, exist_ok=True)
                call([args.flashsplat, "synth", "-o", self.scene, "--seed", seed, *(["--hard", hard] if hard else []),
                      *" ".join(options).split(), *args.synth_options.split(), *args.share], self.scene.parent / f"{self.scene.name}.log")
                args.made.write(mark, key)

    def kept(self, variant, more=""):
        """Where its figures are."""
        return self.base / f"{self.name}-{self.poses}-{variant}{more}.json"

    def take(self, args, variants):
        """Refuses what is not ours where this will write."""
        args.made.mark_of(self.out)
        args.made.take_log(self.log)
        if self.recipe:
            args.made.check(self.scene.parent / f"{self.scene.name}.key")
            args.made.take_log(self.scene.parent / f"{self.scene.name}.log")
        for variant in variants:
            curve_of = self.kept(variant, "-curve")
            args.made.mark_of(curve_of.with_suffix(""))
            for path in (self.kept(variant), self.kept(variant).with_suffix(".png"), curve_of):
                args.made.check(path)


MAKING = {}


def cases_of(args):
    only = [s for s in args.only.split(",") if s]
    found = {d.name: d for d in sorted(pathlib.Path(args.scenes).glob("*")) if (d / "truth" / "cameras.json").is_file()}
    if not found:
        print(f"{args.scenes}: no captures there; only made ones are measured", file=sys.stderr)
    captures = pathlib.Path(args.out) / "captures"
    scenes = [(n, d, "raw", None) for n, d in found.items()]
    scenes += [(f"{n}-{p.name[4:]}", d, p.name, None) for n, d in found.items() for p in sorted(d.glob("capture/raw-*")) if not args.jpeg]
    scenes += [(n, captures / n, photos, (seed, hard, *options)) for n, (seed, hard, photos, *options) in SYNTH.items()]
    names = [s[0] for s in scenes]
    unknown = [o for o in only if not fnmatch.filter(names, o)]
    if unknown:
        sys.exit(f"--only: no scene {', '.join(sorted(unknown))}; there are {', '.join(names)}")
    return [Case(args, n + ("-jpeg" if args.jpeg and photos == "raw" else ""), d, "jpeg" if args.jpeg else photos, true_poses, recipe)
            for n, d, photos, recipe in scenes
            if (any(fnmatch.fnmatch(n, o) for o in only) if only else not any(fnmatch.fnmatch(n, o) for o in ONLY_NAMED))
            for true_poses in ((True, False) if args.colmap else (True,))]


def take_places(args, cases, variants, reports):
    """Before any work: each case has a name of its own, and nothing that is not ours is where its files will be."""
    seen = {}
    for c in cases:
        others = seen.setdefault(c.name, [])
        if c.poses in others or (others and "own" in (c.poses, *others)):
            print(f"two scenes are named {c.name}: files and figures go by names, so rename one of them", file=sys.stderr)
            sys.exit(2)
        others.append(c.poses)
    try:
        for name in reports:
            args.made.check(pathlib.Path(args.out) / name)
        for c in cases:
            c.take(args, variants)
    except OSError as e:
        sys.exit(str(e))


def splats(out):
    """Of each cloud; of radiance fields their parameters."""
    clouds = json.loads((out / "clouds" / "model.json").read_text())["clouds"]
    field = out / "clouds" / "field.bin"
    return "+".join(str(n) for n in clouds.values()) or (f"{field.stat().st_size // 4} parameters" if field.is_file() else "-")


def train(args, case, options, renders):
    """One whole run and its renders; (seconds, splat counts, warnings)."""
    begin = time.monotonic()
    # --poses may be off by a capture's pose noise; the views to render are exact.
    poses = ["--poses", case.lens_model()] if case.true_poses else []
    warnings = call([args.flashsplat, "run", case.photos, "-o", case.out, *poses, *args.options.split(), *options,
                     *args.share], case.log, case.most)
    seconds = time.monotonic() - begin
    cameras = ["--cameras", case.scene / "truth" / "cameras.json", "--metres-per-unit", "1"] if case.true_poses else []
    shutil.rmtree(renders, ignore_errors=True)
    call([args.flashsplat, "render", case.out, "--output", renders, *cameras, *args.share, "--force"], case.log)
    return seconds, splats(case.out), warnings


def decode(path):
    image = cv2.imread(str(path), cv2.IMREAD_COLOR)
    return None if image is None else (image.astype(numpy.float64) / 255) ** (1 / 0.22)


def picture(folder, view):
    return next((p for e in ("png", "jpg") if (p := folder / f"{view}.{e}").is_file()), None)


def difference(with_flash, without, to):
    """to/T_N: gamma(F - N) of the pictures of the same names in two folders."""
    shutil.rmtree(to, ignore_errors=True)
    (to / "T_N").mkdir(parents=True)
    for f in sorted(with_flash.glob("*.*")):
        n = picture(without, f.stem)
        if n:
            d = numpy.clip(decode(f) - decode(n), 0, 1) ** 0.22
            cv2.imwrite(str(to / "T_N" / f"{f.stem}.png"), numpy.rint(d * 255))


def run_variant(args, case, variant):
    renders = case.out / "renders" / variant
    if variant == "true-pair":
        difference(case.scene / "truth" / "I_F", case.scene / "truth" / "I_N", renders)
        return 0, "-", []
    if variant != "pseudo-pair":
        return train(args, case, VARIANTS[variant][0], renders)
    seconds, counts = 0, []
    for lighting in ("flash", "noflash"):
        options = ["--separation", "none", "--lighting", lighting]
        s, count, warnings = train(args, case, options, case.out / "renders" / lighting)
        seconds += s
        counts.append(count)
    difference(case.out / "renders" / "flash" / "I_F", case.out / "renders" / "noflash" / "I_N", renders)
    return seconds, "+".join(counts), warnings


def evaluate(args, case, variant, views, more=()):
    """Figures of the variant's renders, or of the last method where `more` names others; warnings."""
    report = case.out / f"{variant}-{views}.json"
    weights = getattr(args, "lpips_weights", "")
    warnings = call([args.flashsplat, "evaluate", case.out, case.scene / "truth", "--output", case.out / "renders" / variant, "--views",
          views, "--json", report, *(["--lpips-weights", weights] if weights else []), *more], case.log)
    return list(json.loads(report.read_text())["methods"].values())[-1], warnings


def measure(args, case, variant):
    """The figures of one variant: kept ones where there are any of the same program, capture and options."""
    capture = case.ready(args)
    key = digest(args.program, capture, args.options, VARIANTS[variant], variant, getattr(args, "lpips_weights", ""))
    kept = case.kept(variant)
    if kept.is_file() and not args.force:
        result = json.loads(kept.read_text())
        if result["key"] == key:
            return result
    mark = digest(args.program, capture)
    if args.force or args.made.mark_of(case.out) != mark:  # stages done by another program, or of other photos
        args.made.empty(case.out, mark)
    case.most = {}
    seconds, count, warnings = run_variant(args, case, variant)
    views = {}
    for v in case.views(variant):
        views[v], told = evaluate(args, case, variant, v)
        warnings = warnings + (told if VARIANTS[variant][0] is not None else [])  # a pair is of one layer, by its nature
    result = {"key": key, "commit": args.commit, "seconds": seconds, "cpu_seconds": case.most.get("cpu_seconds", 0),
              "bytes": case.most.get("bytes", 0), "splats": count, "warnings": warnings, "views": views}
    args.made.write(kept, json.dumps(result, indent=1))
    if cv2 is not None and views:
        sheet(args, case, variant, kept.with_suffix(".png"))
    return result


def steps_of(args, options):
    """The steps that the program takes with these options of `run`."""
    p = argparse.ArgumentParser()
    p.add_argument("--steps", type=int)
    p.add_argument("--preset", default="standard")
    given = p.parse_known_args([*args.options.split(), *options])[0]
    help_text = subprocess.run([args.flashsplat, "run", "--help"], capture_output=True, text=True, check=True).stdout
    preset = re.search(rf"(?m)^  {re.escape(given.preset)} .*--steps (\d+)", help_text)
    return given.steps or int((preset or re.search(r"(?m)^  --steps N .*default: (\d+)", help_text))[1])


def curve(args, case, variant):
    """Figures after shares of the steps, each a schedule of its own, from one start; and the seconds from the photos to
    the clouds: of the start as `run` took it once, and of each training with the look at what is done before it."""
    options = VARIANTS[variant][0]
    key = digest(args.program, case.ready(args), args.options, options, SHARES)
    kept = case.kept(variant, "-curve")
    if kept.is_file() and not args.force:
        result = json.loads(kept.read_text())
        if result["key"] == key:
            return result
    case = copy.copy(case)
    case.out = case.base / kept.stem
    args.made.empty(case.out, digest(args.program, key))
    done, views, start, points = case.out / "done", "held_out" if case.true_poses else "capture", 0, []
    for share in SHARES:
        steps, begin = max(1, round(share * steps_of(args, options))), time.time()
        train(args, case, [*options, "--steps", steps], case.out / "renders" / str(steps))
        seconds = (done / "train.json").stat().st_mtime - begin
        points.append({"steps": steps, "seconds": start + seconds, "views": {views: evaluate(args, case, str(steps), views)[0]}})
        if not start:
            start = (done / "initialise.json").stat().st_mtime - begin
    result = {"key": key, "commit": args.commit, "views": views, "points": points}
    args.made.write(kept, json.dumps(result, indent=1))
    return result


def figures(result, variant, views):
    """What a row of the table shows: layer -> five numbers or None; depth error."""
    method = result["views"][views]
    layers = {}
    for l in LAYERS:
        m = method["layers"].get(l)
        shown = m and m.get("n") and l in VARIANTS[variant][1]
        names = ("psnr_gain", "ssim_gain", "ms_ssim_gain", "psnr", "ssim")
        layers[l] = [m.get(k, float("nan")) for k in names] if shown else None
    return layers, method.get("depth_T", {}).get("median_relative_error")


def cell(numbers):
    return "{:.2f} / {:.3f} / {:.3f} ({:.2f} / {:.3f})".format(*numbers) if numbers else "-"


def row(name, poses, variant, views, layers, depth, seconds, count):
    cells = [name, poses, variant, views, *(cell(layers[l]) for l in LAYERS), f"{100 * depth:.1f}" if depth is not None else "-",
             f"{seconds:.0f}", count]
    return "| " + " | ".join(cells) + " |"


def mean(values):
    values = [v for v in values if v is not None]
    if not values:
        return None
    return [sum(v) / len(values) for v in zip(*values)] if isinstance(values[0], list) else sum(values) / len(values)


def means(results, variants):
    """Rows of the mean of each variant over the cases that all variants have figures of."""
    lines = []
    for poses, views in (("true", "held_out"), ("true", "capture"), ("COLMAP", "capture")):
        judged = [v for v in variants if any(k[1:] == (poses, v) and views in r["views"] for k, r in results.items())]
        names = sorted({k[0] for k in results if k[1] == poses and
                        all(views in results.get((k[0], poses, v), {"views": {}})["views"] for v in judged)})
        for v in judged if names else []:
            all_of = [figures(results[n, poses, v], v, views) for n in names]
            layers = {l: mean([f[0][l] for f in all_of]) for l in LAYERS}
            seconds = mean([results[n, poses, v]["seconds"] for n in names])
            lines.append(row(f"mean of {len(names)}", poses, v, views, layers, mean([f[1] for f in all_of]), seconds, ""))
    return lines


def table(args, cases, results, failures):
    commits = sorted({r["commit"] for r in results.values()})
    lines = [f"Commit {', '.join(commits)}, {datetime.date.today()}, `{args.options}`. PSNR in dB / SSIM / MS-SSIM: gain-fitted "
             "(raw); depth: median relative error of T in %; s: seconds of the run on this machine, "
             f"{args.jobs} at once, stages that an earlier variant did left out.", "",
             "| scene | poses | variant | views | " + " | ".join(LAYERS) + " | depth | s | splats |", "|---" * 12 + "|"]
    for case in cases:
        for variant in args.variants:
            result = results.get((case.name, case.poses, variant))
            for views in result["views"] if result else []:
                lines.append(row(case.name, case.poses, variant, views, *figures(result, variant, views), result["seconds"],
                                 result["splats"]))
    lines += means(results, args.variants)
    notes = [f"- {n}, {p} poses, {v}: {w}" for (n, p, v), r in sorted(results.items()) for w in r["warnings"]]
    notes += [f"- failed: {f}" for f in failures]
    return lines + (["", "What the program said:", "", *notes] if notes else [])


def curve_rows(args, cases, results):
    """scene, variant, steps, seconds, figures of the layers, depth error; the last rows are means over the scenes that
    all variants have (true and COLMAP's poses each for themselves)."""
    rows, whole = [], set()
    for case in cases:
        name = "" if case.true_poses else ", COLMAP"
        for v in args.variants:
            r = results.get((case.name, case.poses, v))
            rows += [(case.name, v + name, p["steps"], p["seconds"], *figures(p, v, r["views"])) for p in (r["points"] if r else [])]
        if all((case.name, case.poses, v) in results for v in args.variants):
            whole |= {(case.name, v + name) for v in args.variants}
    for key in dict.fromkeys(row[1:3] for row in rows if row[:2] in whole):
        of = [row for row in rows if row[1:3] == key and row[:2] in whole]
        rows.append((f"mean of {len(of)}", *key, mean([r[3] for r in of]),
                     {l: mean([r[4][l] for r in of]) for l in LAYERS}, mean([r[5] for r in of])))
    return rows


def write_curve(args, cases, results, failures):
    rows, base = curve_rows(args, cases, results), pathlib.Path(args.out)
    commits = ", ".join(sorted({r["commit"] for r in results.values()}))
    lines = [f"Commit {commits}, {datetime.date.today()}, `{args.options}`. s: seconds from the photos to the clouds; PSNR in dB "
             "/ SSIM / MS-SSIM: gain-fitted (raw); depth: median relative error of T in %.", "",
             "| scene | variant | steps | s | " + " | ".join(LAYERS) + " | depth |", "|---" * 10 + "|"]
    for scene, variant, steps, seconds, layers, depth in rows:
        shown = f"{100 * depth:.1f}" if depth is not None else "-"
        lines.append(f"| {scene} | {variant} | {steps} | {seconds:.0f} | " + " | ".join(cell(layers[l]) for l in LAYERS) + f" | {shown} |")
    args.made.write(base / "curve.md", "\n".join(lines + [f"- failed: {f}" for f in failures]) + "\n")
    names = ("scene", "variant", "steps", "seconds", "layers", "depth")
    args.made.write(base / "curve.json", json.dumps([dict(zip(names, row)) for row in rows], indent=1))
    if any(row[0].startswith("mean of") for row in rows):  # of several variants there is none before the last
        with tempfile.TemporaryDirectory() as folder:
            plot = pathlib.Path(folder) / "curve.svg"
            subprocess.run([sys.executable, ROOT / "tools" / "plot_curve.py", base / "curve.json", plot], check=True)
            args.made.write(base / "curve.svg", plot.read_bytes())
    return lines


def sheet(args, case, variant, path):
    """Truth, estimate, difference (twice as large, on grey) of T_N and R at a few views."""
    rows = []
    views = sorted(p.stem for p in (case.scene / "truth" / "T_N").glob("*.*"))
    held = [v for v in views if v.startswith("TEST") == case.true_poses] or views
    for view in held[:3]:
        tiles = []
        for layer in ("T_N", "R"):
            truth = picture(case.scene / "truth" / layer, view)
            guess = picture(case.out / "renders" / variant / layer, view)
            if not truth or not guess:
                continue
            e = cv2.imread(str(guess)).astype(numpy.float64)
            t = 255 * cv2.resize(decode(truth), e.shape[1::-1], interpolation=cv2.INTER_AREA) ** 0.22
            tiles += [t, e, numpy.clip(128 + 2 * (e - t), 0, 255)]
        if tiles:
            rows.append(numpy.hstack(tiles))
    if rows and all(r.shape == rows[0].shape for r in rows):
        args.made.write(path, cv2.imencode(".png", numpy.vstack(rows))[1].tobytes())


def run_case(args, case, results, failures, lock, cases):
    for variant in args.variants:
        try:
            result = (curve if args.curve else measure)(args, case, variant)
        except (Failed, OSError, ValueError, KeyError) as e:  # the other cases go on
            with lock:
                failures.append(f"{case.name}, {case.poses} poses, {variant}: {e} (all of it: {case.log})")
                print(failures[-1], file=sys.stderr, flush=True)
            continue
        with lock:
            results[case.name, case.poses, variant] = result
            if args.curve:
                lines = write_curve(args, cases, results, failures)
                print("\n".join(l for l in lines if l.startswith(f"| {case.name} | {variant}{'' if case.true_poses else ', COLMAP'} |")), flush=True)
                continue
            for views in result["views"]:
                print(row(case.name, case.poses, variant, views, *figures(result, variant, views), result["seconds"],
                          result["splats"]), flush=True)
            for warning in result["warnings"]:
                print(f"  {warning}", flush=True)
            args.made.write(case.base / "quality.md", "\n".join(table(args, cases, results, failures)) + "\n")


def main():
    args = arguments()
    args.variants = args.variants.split(",")
    for v in args.variants:
        if v not in VARIANTS:
            sys.exit(f"--variants: no variant '{v}'; known are {', '.join(VARIANTS)}")
    if cv2 is None:
        print("no python3-opencv: no contact sheets, no pseudo-pair, no true-pair", file=sys.stderr)
    if cv2 is None or args.curve:
        args.variants = [v for v in args.variants if VARIANTS[v][0] is not None]
    if args.curve and args.jobs > 1:
        sys.exit("--curve: measures seconds, so one scene at a time (--jobs 1)")
    prepare(args)
    base = pathlib.Path(args.out)
    cases, results, failures, lock = cases_of(args), {}, [], threading.Lock()
    take_places(args, cases, args.variants, ("quality.md", "curve.md", "curve.json", "curve.svg"))
    with concurrent.futures.ThreadPoolExecutor(max(1, args.jobs)) as pool:
        for done in [pool.submit(run_case, args, c, results, failures, lock, cases) for c in cases]:
            done.result()
    name = "curve.md" if args.curve else "quality.md"
    lines = (write_curve if args.curve else table)(args, cases, results, failures)
    if not args.curve:
        args.made.write(base / name, "\n".join(lines) + "\n")
    print("\n".join(line for line in lines if line.startswith("| mean")))
    print(f"table: {base / name}; {'plot' if args.curve else 'contact sheets'} beside it", file=sys.stderr)
    return 1 if failures else 0


if __name__ == "__main__":
    try:
        sys.exit(main())
    except OSError as e:  # a full disk; what came in the way since
        sys.exit(str(e))
