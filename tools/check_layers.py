#!/usr/bin/env python3
"""Checks that includes only point down (docs/design.md): cli -> public header; pipeline -> stages;
stage -> engine, kernels, model, image, base; engine -> kernels, model, image, base; kernels -> base; and that
kernels neither allocate nor do input or output."""
import pathlib
import re
import sys

MACHINERY = {
    "base": set(),
    "image": {"base"},
    "model": {"image", "base"},
    "kernels": {"base"},
    "engine": {"kernels", "model", "image", "base"},
}
BELOW_STAGES = set(MACHINERY)
INCLUDE = re.compile(r'^\s*#\s*include\s+"([^"]+)"', re.M)
NOT_IN_KERNELS = re.compile(r"\b(malloc|calloc|realloc|free|aligned_alloc|fopen|fread|fwrite|f?printf|puts)\s*\(")


def target_folder(source, name, root):
    """Folder under src/ that an include names; '' for a file of src/ itself or the public header."""
    if name == "flashsplat.h":
        return None
    if (source.parent / name).is_file() and "/" not in name:
        return source.parent.name if source.parent != root / "src" else ""
    return name.split("/")[0] if "/" in name else ""


def allowed(folder, name, target):
    if target is None or target == folder:
        return True
    if folder in MACHINERY:
        return target in MACHINERY[folder]
    if folder == "":  # pipeline.c and what is beside it: a stage only by its one header
        return target in BELOW_STAGES or name == f"{target}/{target}.h"
    return target in BELOW_STAGES  # a stage


def check_file(path, root):
    text = path.read_text(encoding="utf-8")
    where = path.relative_to(root)
    problems = []
    if where.parts[0] in ("cli", "include"):
        fine = {"cli": {"flashsplat.h", "cli.h"}, "include": set()}[where.parts[0]]
        return [f"{where}: includes {n}" for n in INCLUDE.findall(text) if n not in fine]
    folder = where.parts[1] if len(where.parts) > 2 else ""
    for name in INCLUDE.findall(text):
        target = target_folder(path, name, root)
        if not allowed(folder, name, target):
            problems.append(f"{where}: {folder or 'src'} must not include {name}")
    if folder == "kernels":
        for match in NOT_IN_KERNELS.finditer(re.sub(r"//.*|/\*.*?\*/", "", text)):
            problems.append(f"{where}: kernels must not call {match.group(1)}")
    return problems


def main():
    root = pathlib.Path(sys.argv[1] if len(sys.argv) > 1 else ".").resolve()
    files = [p for d in ("src", "cli", "include") for p in sorted((root / d).rglob("*.[ch]"))]
    if not files:
        sys.exit(f"{root}: no sources found")
    problems = [problem for path in files for problem in check_file(path, root)]
    print("\n".join(problems) or f"{len(files)} files: every include points down")
    sys.exit(1 if problems else 0)


main()
