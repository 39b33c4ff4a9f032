#!/usr/bin/env python3
"""Separation quality over many scenes and variants: one table (markdown) and one contact sheet per scene.

Trains every scene of --scenes (rendered captures with ground truth: capture/raw, truth) and a set of captures made by
`flashsplat synth`, one run after the other, and lets `flashsplat evaluate` compare each with its truth at held-out and
at capture views. Contact sheets and the two difference variants need python3-opencv; without it they are left out.
"""
import argparse, datetime, json, pathlib, subprocess, sys, time

try:
    import cv2, numpy
except ImportError:
    cv2 = None

ROOT = pathlib.Path(__file__).resolve().parent.parent
LAYERS = "T_N T_F R I_N I_F".split()
VARIANTS = {  # name: options of `run`
    "full": [],
    "flashless": ["--separation", "flashless"],
    "linear": ["--separation", "linear"],
    "none": ["--separation", "none"],
    "paper": ["--preset", "paper"],
    "no-linearity": ["--preset", "paper", "--linearity", "0"],
    "pseudo-pair": None,  # gamma(F - N) of two scenes, one trained on flash photos only, one on the others
    "true-pair": None,  # gamma(I_F - I_N) of the true composites: no training
}
SYNTH = {  # name: seed (it chooses the layout too), difficulties
    "synth-1": (1, ""), "synth-2": (2, ""), "synth-3": (3, ""), "synth-4": (4, ""),
    "weak-flash": (5, "weak-flash"), "strong-reflection": (6, "strong-reflection"), "few-photos": (7, "few-photos"),
    "low-texture": (8, "low-texture"), "depth-overlap": (9, "depth-overlap"), "frame": (10, "frame"),
    "flash-return": (11, "flash-return"), "bright-near-room": (12, "bright-near-room"), "pose-noise": (13, "pose-noise"),
}


def arguments():
    p = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    p.add_argument("--flashsplat", default=str(ROOT / "build" / "flashsplat"), help="the program")
    p.add_argument("--scenes", default=str(ROOT.parent / "shared" / "scenes"), help="folder of captures with truth")
    p.add_argument("--only", default="", help="names of scenes, comma-separated (default: all)")
    p.add_argument("--variants", default="full", help="of " + ", ".join(VARIANTS))
    p.add_argument("--colmap", action="store_true", help="with COLMAP's poses too, measured at the capture views")
    p.add_argument("--out", default=str(ROOT / "demo" / "quality"), help="folder for everything this makes")
    p.add_argument("--options", default="--preset preview --long-edge 300", help="options of every run")
    return p.parse_args()


class Failed(Exception):
    pass


def call(args, log):
    """Runs the program, all it says into a file; its warnings are returned."""
    with open(log, "ab") as f:
        begin = f.tell()
        rc = subprocess.run([str(a) for a in args], stdout=f, stderr=f).returncode
    text = pathlib.Path(log).read_bytes()[begin:].decode(errors="replace")
    if rc:
        raise Failed(f"{' '.join(str(a) for a in args[:3])}: {text.strip().splitlines()[-1] if text.strip() else rc}")
    return [line.strip() for line in text.splitlines() if "warning" in line.lower()]


def scenes_of(args):
    """name -> folder with capture/raw and truth; made ones are made here, once."""
    only = [s for s in args.only.split(",") if s]
    found = {d.name: d for d in sorted(pathlib.Path(args.scenes).glob("*")) if (d / "truth" / "cameras.json").is_file()}
    unknown = set(only) - set(found) - set(SYNTH)
    if unknown:
        sys.exit(f"--only: no scene {', '.join(sorted(unknown))}; there are {', '.join([*found, *SYNTH])}")
    if not found:
        print(f"{args.scenes}: no captures there; only made ones are measured", file=sys.stderr)
    scenes = {n: d for n, d in found.items() if not only or n in only}
    for name, (seed, hard) in SYNTH.items():
        if only and name not in only:
            continue
        folder = pathlib.Path(args.out) / "captures" / name
        if not (folder / "truth" / "cameras.json").is_file():
            folder.parent.mkdir(parents=True, exist_ok=True)
            call([args.flashsplat, "synth", "-o", folder, "--seed", seed, *(["--hard", hard] if hard else [])],
                 folder.parent / f"{name}.log")
        scenes[name] = folder
    return scenes


def splats(out):
    clouds = json.loads((out / "clouds" / "model.json").read_text())["clouds"]
    return "+".join(str(n) for n in clouds.values())


def train(args, scene, out, poses, options, renders, true_poses, log):
    """One whole run and its renders; (seconds, splat counts, warnings)."""
    begin = time.monotonic()
    warnings = call([args.flashsplat, "run", scene / "capture" / "raw", "-o", out, *poses, *args.options.split(), *options], log)
    seconds = time.monotonic() - begin
    cameras = ["--cameras", scene / "truth" / "sparse", "--metres-per-unit", "1"] if true_poses else []
    call([args.flashsplat, "render", out, "-o", renders, *cameras, "--force"], log)
    return seconds, splats(out), warnings


def decode(path):
    image = cv2.imread(str(path), cv2.IMREAD_COLOR)
    return None if image is None else (image.astype(numpy.float64) / 255) ** (1 / 0.22)


def picture(folder, view):
    return next((p for e in ("png", "jpg") if (p := folder / f"{view}.{e}").is_file()), None)


def difference(with_flash, without, to):
    """to/T_N: gamma(F - N) of the pictures of the same names in two folders."""
    (to / "T_N").mkdir(parents=True, exist_ok=True)
    for f in sorted(with_flash.glob("*.*")):
        n = picture(without, f.stem)
        if n:
            d = numpy.clip(decode(f) - decode(n), 0, 1) ** 0.22
            cv2.imwrite(str(to / "T_N" / f"{f.stem}.png"), numpy.rint(d * 255))


def run_variant(args, name, scene, out, variant, poses, true_poses, log):
    renders = out / "renders" / variant
    if variant == "true-pair":
        difference(scene / "truth" / "I_F", scene / "truth" / "I_N", renders)
        return 0, "-", []
    if variant != "pseudo-pair":
        return train(args, scene, out, poses, VARIANTS[variant], renders, true_poses, log)
    seconds = 0
    for lighting in ("flash", "noflash"):
        options = ["--separation", "none", "--lighting", lighting]
        s, count, warnings = train(args, scene, out, poses, options, out / "renders" / lighting, true_poses, log)
        seconds += s
    difference(out / "renders" / "flash" / "I_F", out / "renders" / "noflash" / "I_N", renders)
    return seconds, count, warnings


def measure(args, scene, out, variant, views, log):
    report = out / f"{variant}-{views}.json"
    call([args.flashsplat, "evaluate", out, scene / "truth", "--output", out / "renders" / variant, "--views", views,
          "--json", report], log)
    return next(iter(json.loads(report.read_text())["methods"].values()))


def cell(layer):
    if not layer or not layer.get("n"):
        return "-"
    return f"{layer['psnr_gain']:.2f} / {layer['ssim_gain']:.3f} ({layer['psnr']:.2f} / {layer['ssim']:.3f})"


def row(name, poses, variant, views, method, seconds, count):
    depth = method.get("depth_T", {}).get("median_relative_error")
    cells = [name, poses, variant, views, *(cell(method["layers"].get(l)) for l in LAYERS),
             f"{100 * depth:.1f}" if depth is not None else "-", f"{seconds:.0f}", count]
    return "| " + " | ".join(cells) + " |"


def sheet(scene, out, variant, path):
    """Truth, estimate, difference (twice as large, on grey) of T_N and R at a few views."""
    rows = []
    views = sorted(p.stem for p in (scene / "truth" / "T_N").glob("*.*"))
    held = [v for v in views if v.startswith("TEST")] or views
    for view in held[:3]:
        tiles = []
        for layer in ("T_N", "R"):
            truth = picture(scene / "truth" / layer, view)
            guess = picture(out / "renders" / variant / layer, view)
            if not truth or not guess:
                return False
            e = cv2.imread(str(guess)).astype(numpy.float64)
            t = 255 * cv2.resize(decode(truth), e.shape[1::-1], interpolation=cv2.INTER_AREA) ** 0.22
            tiles += [t, e, numpy.clip(128 + 2 * (e - t), 0, 255)]
        rows.append(numpy.hstack(tiles))
    cv2.imwrite(str(path), numpy.vstack(rows))
    return True


def main():
    args = arguments()
    variants = args.variants.split(",")
    for v in variants:
        if v not in VARIANTS:
            sys.exit(f"--variants: no variant '{v}'; known are {', '.join(VARIANTS)}")
    if cv2 is None:
        print("no python3-opencv: no contact sheets, no pseudo-pair, no true-pair", file=sys.stderr)
        variants = [v for v in variants if VARIANTS[v] is not None]
    commit = subprocess.run(["git", "-C", ROOT, "rev-parse", "--short", "HEAD"], capture_output=True, text=True).stdout.strip()
    base = pathlib.Path(args.out)
    base.mkdir(parents=True, exist_ok=True)
    lines = [f"Commit {commit}, {datetime.date.today()}, `{args.options}`. PSNR in dB / SSIM: gain-fitted (raw); depth: median "
             "relative error of T in %; seconds of the whole run on this machine, stages done before left out.", "",
             "| scene | poses | variant | views | " + " | ".join(LAYERS) + " | depth | s | splats |", "|---" * 12 + "|"]
    print("\n".join(lines), flush=True)
    failures = 0
    for name, scene in scenes_of(args).items():
        for true_poses in (True, False) if args.colmap else (True,):
            kind = "true" if true_poses else "COLMAP"
            out = base / f"{name}-{kind}"
            out.mkdir(parents=True, exist_ok=True)
            log = base / f"{name}-{kind}.log"
            poses = ["--poses", scene / "truth" / "sparse"] if true_poses else []
            for variant in variants:
                try:
                    seconds, count, warnings = run_variant(args, name, scene, out, variant, poses, true_poses, log)
                    for views in ("held_out", "capture") if true_poses else ("capture",):
                        lines.append(row(name, kind, variant, views, measure(args, scene, out, variant, views, log), seconds, count))
                        print(lines[-1], flush=True)
                    for warning in warnings:
                        print(f"{name}, {variant}: {warning}", file=sys.stderr)
                    if cv2 is not None and true_poses:
                        sheet(scene, out, variant, base / f"{name}-{variant}.png")
                except Failed as e:
                    failures += 1
                    print(f"{name}, {kind} poses, {variant}: {e} (all of it: {log})", file=sys.stderr)
                (base / "quality.md").write_text("\n".join(lines) + "\n")
    print(f"table: {base / 'quality.md'}; contact sheets beside it", file=sys.stderr)
    return 1 if failures else 0


if __name__ == "__main__":
    sys.exit(main())
