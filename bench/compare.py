#!/usr/bin/env python3
"""Methods over scenes, in one report: compare.html (figures, and pictures side by side under a magnifier), compare.csv
and compare.tex. Runs them as bench/quality.py does and keeps what it measured: with the same program, captures and
options nothing runs twice. Held-out views are from places where no photo was taken.
"""
import concurrent.futures, json, pathlib, re, subprocess, sys, threading

import quality
from compare_pictures import find_picture, to_show
from compare_tables import KINDS, METRICS, VIEWS, csv_text, partial, tex_text

METHODS = {  # name: (title, variant of quality.py, poses by COLMAP)
    "full": ("full", "full", False),
    "paper": ("the paper's", "paper", False),
    "flashless": ("ours, flashless", "flashless", False),
    "linear": ("ours, T_F = c T_N", "linear", False),
    "intensity-cue": ("the paper's, its own 3D cue", "intensity-cue", False),
    "contrast-cue": ("the paper's, our 3D cue", "contrast-cue", False),
    "paper-flashless": ("the paper's, flashless", "paper-flashless", False),
    "paper-linear": ("the paper's, T_F = c T_N", "paper-linear", False),
    "no-linearity": ("the paper's, no linearity", "no-linearity", False),
    "no-smoothness": ("the paper's, no smoothness", "no-smoothness", False),
    "no-cue": ("the paper's, no 3D cue", "no-cue", False),
    "joint-poses": ("the paper's, COLMAP's poses, joint", "contrast-cue", True),
    "separate-poses": ("the paper's, COLMAP's poses, separate", "separate-poses", True),
    "plain": ("plain splats", "none", False),
    "nerf": ("NeRF", "nerf", False),
    "nerfren": ("NeRFReN", "nerfren", False),
    "flash-nerf": ("Flash-NeRF", "flash-nerf", False),
}
# The paper's table: transmission against the normalised paired difference, mean over its own scenes.
PUBLISHED = {"Flash-Splat": (20.42, 0.2868), "DSRNet": (13.02, 0.5754), "Liu et al.": (11.16, 0.6765),
             "NSF": (9.40, 0.7452), "NeRFReN": (10.09, 0.7153)}


def name_error(name, before):
    """What is wrong with the name of another program: rows and folders of pictures go by it."""
    if name in METHODS or name == "truth" or name.startswith("published"):
        return "the report has rows of its own of this name"
    if name in before:
        return "named twice"
    if "/" in name or ".." in name or not name.isprintable() or not name.strip():
        return "a name has letters, and neither '/' nor '..'"
    return None


def arguments():
    p = quality.common_arguments(__doc__, "compare")
    p.add_argument("--methods", default="all", help="of " + ", ".join(METHODS))
    p.add_argument("--folders", default="", help="published scene folders (docs/scene-folders.md), comma-separated: no "
                   "truth, so time, size and pictures only")
    p.add_argument("--method", default="", help="NAME=DIR,...: other programs' pictures, "
                   "DIR/<scene>/<layer>/<photo>.png; docs/compare.md")
    p.add_argument("--method-encoding", default="gamma", help="what these hold: gamma (default), srgb or linear")
    p.add_argument("--lpips-weights", default="", help="weights that add LPIPS; docs/lpips.md")
    p.add_argument("--pictures", type=int, default=2, help="views shown of each scene (default: 2)")
    args = p.parse_args()
    args.methods = list(METHODS) if args.methods == "all" else args.methods.split(",")
    for m in args.methods:
        if m not in METHODS:
            p.error(f"--methods: no method '{m}'; known are {', '.join(METHODS)}")
    args.others = [pair.split("=", 1) for pair in args.method.split(",") if pair]
    for i, pair in enumerate(args.others):
        if len(pair) != 2 or not all(pair):
            p.error(f"--method: '{args.method}' is not NAME=DIR,...")
        name, folder = pair
        if wrong := name_error(name, [other for other, _ in args.others[:i]]):
            p.error(f"--method: {name!r}: {wrong}")
        if not pathlib.Path(folder).is_dir():
            p.error(f"--method: {name}: no folder {folder}")
    args.colmap = any(METHODS[m][2] for m in args.methods)
    return args


class FolderCase(quality.Case):
    """A scene as others published it: photos and poses, no truth."""

    def __init__(self, args, folder):
        super().__init__(args, folder.name, folder, "", False)
        self.photos, self.poses = folder, "own"
        self.out, self.log = self.base / f"{self.name}-own", self.base / f"{self.name}-own.log"
        self.of_the_paper = (folder / "images_npy").is_dir()  # docs/scene-folders.md

    def views(self, variant):
        return []


def cases_of(args):
    cases = [] if args.folders and not args.only else quality.cases_of(args)
    return cases + [FolderCase(args, pathlib.Path(f).resolve()) for f in args.folders.split(",") if f]


def methods_of(args, case):
    by_colmap = not case.true_poses and not isinstance(case, FolderCase)
    return [m for m in args.methods if METHODS[m][2] == by_colmap]


def drop_unknown(args):
    """Methods whose options this program does not have."""
    known = subprocess.run([args.flashsplat, "run", "--help"], capture_output=True, text=True, check=True).stdout
    for m in list(args.methods):
        options = [o for o in quality.VARIANTS[METHODS[m][1]][0] if o.startswith("--")]
        lacks = [o for o in options if o.replace("--no-", "--") not in known]
        if lacks:
            print(f"{m}: left out, this program has no {lacks[0]}", file=sys.stderr)
            args.methods.remove(m)


# ---- what there is to show ----

def all_views(case):
    """Names of what is rendered or true of a case."""
    pictures = (case.out / "renders").glob("*/T_N/*.png") if isinstance(case, FolderCase) else (case.scene / "truth" / "T_N").glob("*.*")
    return sorted({p.stem for p in pictures})


def shown_views(args, case):
    """Held-out views, and the photos' own where there is something that has no others: other programs, COLMAP's poses."""
    names = all_views(case)
    if isinstance(case, FolderCase):
        return spread(args, of_others(args, case, names) or names)
    held_out = [n for n in names if n.startswith("TEST")]
    photos = [n for n in names if n not in held_out]
    photos = spread(args, of_others(args, case, photos) or photos)
    if not case.true_poses or not held_out:
        return photos or spread(args, names)
    return spread(args, held_out) + (photos if args.others or args.colmap else [])


def of_others(args, case, names):
    """Those that other programs have pictures of."""
    folders = [pathlib.Path(folder).resolve() / case.name / layer for _, folder in args.others for layer in quality.LAYERS]
    return [n for n in names if any(find_picture(folder, n, names) for folder in folders)]


def spread(args, names):
    step = max(1, len(names) // max(1, args.pictures))
    return names[::step][:args.pictures]


def keep_pictures(args, case, who, folder, encoding="gamma"):
    """Copies of the pictures that are shown: layer -> view -> path from the report; what is to be said of them."""
    kept, names, told = {}, all_views(case), set()
    for layer in quality.LAYERS:
        for view in shown_views(args, case):
            source = find_picture(folder / layer, view, names)
            if source is None:
                continue
            suffix, content, said = to_show(source, encoding)
            told |= {said} - {""}
            if suffix:
                name = f"pictures/{case.name}-{case.poses}/{who}/{layer}/{view}{suffix}"
                args.made.write(case.base / name, content)
                kept.setdefault(layer, {})[view] = name
    return kept, "; ".join(sorted(told))


def of_kind(m, kind, metrics=METRICS):
    return {k: m[name] for k in metrics if (name := k + (f"_{kind}" if kind else "")) in m}


def figures(result, layers):
    """Of what evaluate said: "figures", views -> layer -> kind -> metric -> number; "counts", views -> layer -> how many
    views were measured, of how many; "of_view", layer -> view -> kind -> PSNR."""
    found = {"figures": {}, "counts": {}, "of_view": {}}
    for views, method in result["views"].items():
        for layer, m in method["layers"].items():
            if not m.get("n") or layer not in layers:
                continue
            found["counts"].setdefault(views, {})[layer] = (m["n"], m["n"] + m.get("missing", 0))
            for kind in KINDS:
                if numbers := of_kind(m, kind):
                    found["figures"].setdefault(views, {}).setdefault(layer, {})[kind] = numbers
            for view, of in m.get("views", {}).items():
                psnr = {kind: n["psnr"] for kind in KINDS if (n := of_kind(of, kind, ("psnr",)))}
                found["of_view"].setdefault(layer, {})[view] = psnr
    return found


def published(args):
    """scene -> rows (title, views -> layer -> kind -> metric): the table that the folder of scenes comes with."""
    path, rows = pathlib.Path(args.scenes) / "README.md", {}
    lines = path.read_text().splitlines() if path.is_file() else []
    titles = None
    for line in lines:
        cells = [c.strip() for c in line.strip().strip("|").split("|")]
        if line.startswith("| scene |"):
            titles = cells
        elif titles and line.startswith("|") and not line.startswith("|-") and len(cells) == len(titles):
            layers = {}
            for layer, cell in zip(titles[2:], cells[2:]):
                numbers = re.findall(r"\d+\.\d+", cell)
                if numbers and layer in quality.LAYERS:
                    layers[layer] = {"gain": dict(zip(("psnr", "ssim"), map(float, numbers)))}
            rows.setdefault(cells[0], []).append((f"published: {cells[1]}", {"held_out": layers}))
        elif not line.startswith("|"):
            titles = None
    return rows


def paper_rows():
    """The paper's own table, to stand beside the authors' data."""
    for name, (psnr, lpips) in PUBLISHED.items():
        yield (f"published, mean of the paper's scenes: {name}",
               {"capture": {"T_N": {"paper": {"psnr": psnr, "lpips": lpips}}}})


def row_of(name, title, result, found, pictures=({}, "")):
    """found: "figures" and what else `figures` finds; pictures: what `keep_pictures` returns."""
    kept, note = pictures
    of_view = {layer: {view: psnr for view, psnr in found.get("of_view", {}).get(layer, {}).items() if view in views}
               for layer, views in kept.items()}  # of those shown
    return {"method": name, "title": title, "figures": found.get("figures", {}), "counts": found.get("counts", {}),
            "pictures": kept, "of_view": of_view, "note": note, "seconds": result.get("seconds"),
            "cpu_seconds": result.get("cpu_seconds"), "bytes": result.get("bytes"), "splats": result.get("splats", ""), "warnings": result.get("warnings", [])}


def run_method(args, case, name):
    variant = METHODS[name][1]
    result = quality.measure(args, case, variant)
    pictures = keep_pictures(args, case, name, case.out / "renders" / variant)
    return row_of(name, METHODS[name][0], result, figures(result, quality.VARIANTS[variant][1]), pictures)


def run_other(args, case, name, folder):
    """Pictures of another program, measured at the photos' views beside those of the case's last method; of a folder
    without truth only shown."""
    where = pathlib.Path(folder).resolve() / case.name
    renders = sorted(p.parent for p in (case.out / "renders").glob("*/T_N"))
    if not where.is_dir():
        print(f"{case.name}: {name} has no folder {where}", file=sys.stderr)
        return None
    found, warnings = {}, []
    if not isinstance(case, FolderCase):
        if not renders:
            raise quality.Failed("no method of ours to be measured beside")
        more = ["--method", f"other={where}", "--method-encoding", args.method_encoding]
        result, told = quality.evaluate(args, case, renders[0].name, "capture", more)
        found = figures({"views": {"capture": result}}, quality.LAYERS)
        warnings = [w for w in told if str(where) in w]  # others are of ours
    pictures = keep_pictures(args, case, f"other-{name}", where, args.method_encoding)
    if not found.get("figures") and not any(pictures):
        raise quality.Failed(f"{where}: no picture of {', '.join(quality.LAYERS)} for any of the scene's photos")
    return row_of(name, name, {"warnings": warnings}, found, pictures)


def truth_row(args, case):
    return row_of("truth", "truth", {}, {}, keep_pictures(args, case, "truth", case.scene / "truth"))


def run_case(args, case, report, failures, lock, references):
    rows = [] if isinstance(case, FolderCase) else [truth_row(args, case)]

    def add(row):
        if row is None:
            return
        with lock:
            rows.append(row)
            report[case.name, case.poses] = rows[:]
            write(args, report, failures)
        best = row["figures"].get("held_out") or row["figures"].get("capture") or {}
        told = "  ".join(f"{layer} {kinds['gain']['psnr']:.2f}" for layer, kinds in best.items() if "gain" in kinds)
        print(f"{case.name}, {case.poses} poses: {row['title']}: {told} {row['seconds'] or 0:.0f} s", flush=True)

    def attempt(what, work):
        try:
            add(work())
        except (quality.Failed, OSError, ValueError, KeyError) as e:  # the others go on
            with lock:
                failures.append(f"{case.name}, {case.poses} poses, {what}: {e} (all of it: {case.log})")
                print(failures[-1], file=sys.stderr, flush=True)

    for name in methods_of(args, case):
        attempt(name, lambda: run_method(args, case, name))
    for name, folder in args.others if case.true_poses or isinstance(case, FolderCase) else []:
        attempt(name, lambda: run_other(args, case, name, folder))
    beside = references.get(case.name, []) if case.true_poses else []
    for title, found in paper_rows() if getattr(case, "of_the_paper", False) else beside:
        add(row_of("published", title, {}, {"figures": found}))


# ---- the report ----

def scenes_of(report):
    """scene -> its rows, those of COLMAP's poses among them; one row of the truth, with the pictures of all."""
    scenes = {}
    for (name, _), rows in sorted(report.items(), key=lambda item: (item[0][0], item[0][1] == "COLMAP")):
        scenes.setdefault(name, []).extend(r for r in rows if r["method"] != "truth" or not scenes.get(name))
        first = scenes[name][0]
        for r in rows:
            if r["method"] == "truth" and r is not first:
                first["pictures"] = {layer: {**first["pictures"].get(layer, {}), **views} for layer, views in r["pictures"].items()}
    return scenes


def means(scenes):
    """Rows of the mean over the scenes that all methods with figures at these views have, and of other programs that
    have these scenes too; what lacks views of them is left out."""
    rows = {}
    for views in VIEWS:
        have = {}
        for scene, of in scenes.items():
            for r in of:
                if views in r["figures"] and r["method"] != "published":
                    have.setdefault(r["method"], {})[scene] = r
        ours = [set(of) for method, of in have.items() if method in METHODS]
        common = set.intersection(*ours) if ours else set()
        for method, of in have.items() if common else []:
            if not common <= set(of):
                continue
            chosen = [of[s] for s in sorted(common)]
            if any(partial(r, views) for r in chosen):
                continue
            row = rows.setdefault(method, row_of(method, chosen[0]["title"], {}, {}))
            for kind in ("seconds", "cpu_seconds"):
                times = [r[kind] for r in chosen if r[kind] is not None]
                row[kind] = sum(times) / len(times) if times else None
            row["bytes"] = max((r["bytes"] or 0 for r in chosen), default=0)
            row.setdefault("scenes", {})[views] = sorted(common)
            for layer in quality.LAYERS:
                for kind in KINDS:
                    values = [r["figures"][views].get(layer, {}).get(kind) for r in chosen]
                    if all(values):
                        row["figures"].setdefault(views, {}).setdefault(layer, {})[kind] = {
                            k: sum(v[k] for v in values) / len(values) for k in METRICS if all(k in v for v in values)}
    return list(rows.values())


def page_text(args, scenes, mean_rows, failures):
    rows = [r for of in (*scenes.values(), mean_rows) for r in of]
    for r in rows:
        r["partial"] = {views: partial(r, views) for views in r["figures"]}
    data = {"commit": args.commit, "options": args.options, "layers": quality.LAYERS, "kinds": KINDS, "views": VIEWS,
            "metrics": METRICS, "scenes": scenes, "means": mean_rows, "failures": failures,
            "paper": [[name, *numbers] for name, numbers in PUBLISHED.items()]}
    page = (pathlib.Path(__file__).parent / "compare_page.html").read_text()
    return page.replace("/*DATA*/null", json.dumps(data).replace("<", "\\u003c"))  # no tag or comment of HTML in it


def write(args, report, failures):
    base, scenes = pathlib.Path(args.out), scenes_of(report)
    mean_rows = means(scenes)
    args.made.write(base / "compare.csv", csv_text(args, scenes))
    args.made.write(base / "compare.tex", tex_text(args, scenes, mean_rows))
    args.made.write(base / "compare.html", page_text(args, scenes, mean_rows, failures))


def take_places(args, cases):
    """Before any work: nothing that is not ours is where files will be written."""
    quality.take_places(args, cases, [METHODS[m][1] for m in args.methods], ("compare.html", "compare.csv", "compare.tex"))
    try:
        for c in cases:
            pictures = c.base / "pictures" / f"{c.name}-{c.poses}"
            args.made.check_way(pictures)
            for p in pictures.rglob("*"):
                if not p.is_dir():
                    args.made.check(p)
    except OSError as e:
        sys.exit(str(e))


def main():
    args = arguments()
    quality.prepare(args)
    drop_unknown(args)
    cases = [c for c in cases_of(args) if methods_of(args, c)]
    take_places(args, cases)
    report, failures, lock, references = {}, [], threading.Lock(), published(args)
    with concurrent.futures.ThreadPoolExecutor(max(1, args.jobs)) as pool:
        for done in [pool.submit(run_case, args, c, report, failures, lock, references) for c in cases]:
            done.result()
    write(args, report, failures)
    print(f"report: {pathlib.Path(args.out) / 'compare.html'}; compare.csv and compare.tex beside it", file=sys.stderr)
    return 1 if failures else 0


if __name__ == "__main__":
    try:
        sys.exit(main())
    except OSError as e:  # a full disk; what came in the way since
        sys.exit(str(e))
