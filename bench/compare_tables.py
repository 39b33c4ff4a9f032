"""compare.csv and compare.tex, out of compare.py's rows."""
import csv, io, re

from quality import LAYERS

KINDS = {"gain": "gain-fitted", "": "as it is", "paper": "paper's convention"}
METRICS = ("psnr", "ssim", "ms_ssim", "lpips_alex", "lpips_vgg", "lpips")  # lpips: published, of a network not named
VIEWS = {"held_out": "held-out views", "capture": "the photos' views"}


def partial(row, views):
    """What stands beside a title where not all views were measured; "" where they were."""
    counts = row["counts"].get(views, {})
    if all(n == of for n, of in counts.values()):
        return ""
    if len(set(counts.values())) == 1:
        return "({} of {} views)".format(*next(iter(counts.values())))
    return "(" + ", ".join(f"{layer} {n} of {of} views" for layer, (n, of) in counts.items() if n < of) + ")"


def csv_text(args, scenes):
    with io.StringIO(newline="") as f:
        w = csv.writer(f)
        w.writerow(["scene", "method", "title", "views", "layer", "kind", "views_measured", "views_of", *METRICS, "seconds", "cpu_seconds", "megabytes",
                    "splats", "commit"])
        for scene, rows in scenes.items():
            for r in rows:
                end = [*(f"{r[k]:.1f}" if r[k] is not None else "" for k in ("seconds", "cpu_seconds")),
                       f"{r['bytes'] / 1e6:.0f}" if r["bytes"] else "", r["splats"], args.commit]
                for views, layers in r["figures"].items():
                    for layer, kinds in layers.items():
                        for kind, m in kinds.items():
                            measured = r["counts"].get(views, {}).get(layer, ("", ""))
                            w.writerow([scene, r["method"], r["title"], views, layer, KINDS[kind], *measured,
                                        *(f"{m[k]:.5g}" if k in m else "" for k in METRICS), *end])
                if not r["figures"] and r["method"] != "truth":
                    w.writerow([scene, r["method"], r["title"], *[""] * (5 + len(METRICS)), *end])
        return f.getvalue()


TEX_HEAD = r"""%% PSNR in dB/SSIM/MS-SSIM(/LPIPS), those of methods with all views in bold where they are best; s: CPU seconds of the
%% whole run, but for stages that an earlier method did, which are not done again; MB: most memory; k: thousands of
%% Gaussians or numbers of a field, all layers together. With \usepackage{booktabs} its rules are drawn.
%% Commit %s, options: %s
\providecommand{\toprule}{\hline}\providecommand{\midrule}{\hline}\providecommand{\bottomrule}{\hline}
"""

TEX_NAMES = {"\\": "textbackslash", "^": "textasciicircum", "~": "textasciitilde", "<": "textless", ">": "textgreater",
             "|": "textbar"}


def tex(text):
    text = re.sub(r"[\\^~<>|&%#_{}$]", lambda m: rf"\{TEX_NAMES[m[0]]}{{}}" if m[0] in TEX_NAMES else "\\" + m[0], text)
    return re.sub(r"([TRI])\\_([NF])", r"$\1_\2$", text)


def tex_count(splats):
    counts = [float(n) for n in re.findall(r"\d+(?:\.\d+)?", splats or "")]
    return f"{sum(counts) / 1000:.0f}" if counts else "--"


def tex_rows(rows, views, kind):
    found = [(r, r["figures"].get(views, {}), partial(r, views)) for r in rows]
    best = {l: max((of[l][kind]["psnr"] for _, of, some in found if kind in of.get(l, {}) and not some), default=0)
            for l in LAYERS}
    for r, of, some in found:
        cells = []
        for layer in LAYERS:
            m = of.get(layer, {}).get(kind, {})
            psnr = f"{m['psnr']:.2f}" if m else "--"
            psnr = rf"\textbf{{{psnr}}}" if m and m["psnr"] == best[layer] and not some else psnr
            rest = [f"{m[k]:.3f}".removeprefix("0") for k in METRICS[1:] if k in m]
            cells.append("/".join([psnr, *rest]))
        seconds = f"{r['cpu_seconds']:.0f}" if r["cpu_seconds"] is not None else "--"
        memory = f"{r['bytes'] / 1e6:.0f}" if r["bytes"] else "--"
        yield " & ".join([r"\raggedright " + tex(f"{r['title']} {some}".strip()), *cells, seconds, memory, tex_count(r["splats"])]) + r" \\"


def tex_table(caption, rows, views, kind):
    return [r"\begin{table}[!htbp]\centering\scriptsize\setlength{\tabcolsep}{2pt}",
            rf"\caption{{{tex(caption)}, {VIEWS[views]}, {KINDS[kind]}}}",
            r"\makebox[\linewidth]{\begin{tabular}{p{.22\linewidth}" + "c" * len(LAYERS) + "rrr}", r"\toprule",
            " & ".join(["", *(tex(l) if "_" in l else f"${l}$" for l in LAYERS), "s", "MB", "k"]) + r" \\",
            r"\midrule", *tex_rows(rows, views, kind), r"\bottomrule", r"\end{tabular}}", r"\end{table}", ""]


def has_kind(rows, views, kind):
    return [r for r in rows if any(kind in kinds for kinds in r["figures"].get(views, {}).values())]


def tex_text(args, scenes, mean_rows):
    lines, tables = [TEX_HEAD % (args.commit, " ".join(args.options.split()))], 0
    for title, rows in [("Mean", mean_rows), *scenes.items()]:
        for views in VIEWS:
            for kind in ("gain", "paper"):
                have = has_kind(rows, views, kind)
                if not have:
                    continue
                tables += 1
                if tables % 16 == 0:
                    lines.append(r"\clearpage  % LaTeX holds some fifty tables that wait for a page")
                caption = f"{title} over scenes: {', '.join(have[0]['scenes'][views])}" if title == "Mean" else title
                if kind == "paper" and not has_kind(rows, views, "gain"):  # the authors' data: of ours only time is known
                    have = [r for r in rows if r["method"] != "truth"]
                lines += tex_table(caption, have, views, kind)
    return "\n".join(lines) + "\n"
