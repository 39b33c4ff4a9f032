#!/usr/bin/env python3
"""Checks the borders that docs/design.md draws: includes only point down (cli -> public header; pipeline -> stages;
stage -> engine, kernels, model, image, base; engine -> kernels, model, image, base; kernels -> base); train/ sees of
the engine its public headers only, and no kernels; kernels neither allocate nor do input or output; file names are
unique; external names give their file (fs_<file>_..., the file that declares or defines them); no function has more
than seven parameters; only base/ removes, renames and overwrites files."""
import collections
import pathlib
import re
import sys

MOST_PARAMETERS = 7
ENGINE_FOR_TRAIN = {"engine/engine.h", "engine/dirt.h", "engine/made_scene.h"}

MACHINERY = {
    "base": set(),
    "image": {"base"},
    "model": {"image", "base"},
    "kernels": {"base"},
    "engine": {"kernels", "model", "image", "base"},
}
BELOW_STAGES = set(MACHINERY)
INCLUDE = re.compile(r'^\s*#\s*include\s+"([^"]+)"', re.M)
ONLY_BASE = re.compile(r'\b(unlink|remove|rename|rmdir|truncate|creat|fs_file_remove\w*)\s*\(|\bfopen\([^;]*"[wa]')
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
        if folder == "train" and (
            target == "kernels" or (target == "engine" and name not in ENGINE_FOR_TRAIN)
        ):
            problems.append(f"{where}: train must not include {name}")
        if not allowed(folder, name, target):
            problems.append(f"{where}: {folder or 'src'} must not include {name}")
    if folder != "base":
        for match in ONLY_BASE.finditer(re.sub(r"//.*|/\*.*?\*/", "", text)):
            problems.append(f"{where}: {match.group(1)} belongs to src/base: see owned.h")
    if folder == "kernels":
        for match in NOT_IN_KERNELS.finditer(re.sub(r"//.*|/\*.*?\*/", "", text)):
            problems.append(f"{where}: kernels must not call {match.group(1)}")
    return problems


def check_file_names(files, root):
    of_name = collections.defaultdict(list)
    for path in files:
        if path.is_relative_to(root / "src"):
            of_name[path.name].append(str(path.relative_to(root)))
    return [f"{' and '.join(paths)}: two files of one name" for name, paths in of_name.items()
            if len(paths) > 1]


def functions(text):
    """(head, name, parameters, is a definition) of every function declared or defined at the top level."""
    text = re.sub(r"//[^\n]*|/\*.*?\*/", " ", text, flags=re.S)
    text = re.sub(r'"(\\.|[^"\\])*"|\'(\\.|[^\'\\])*\'', '""', text)
    text = re.sub(r"^[ \t]*#(.*\\\n)*.*$", "", text, flags=re.M)
    text = re.sub(r'extern\s+""\s*\{', "", text)
    chunk, depth = "", 0
    for c in text:
        if depth == 0 and c in "{;":
            match = re.match(r"([\w\s*]*?\b)(\w+)\s*\((.*)\)\s*$", chunk.strip(), re.S)
            if match and "typedef" not in match[1] and match[1].strip():
                yield match[1], match[2], split_parameters(match[3]), c == "{"
            chunk = ""
        elif depth == 0 and c != "}":
            chunk += c
        depth += (c == "{") - (c == "}" and depth > 0)


def split_parameters(text):
    parameters, depth = [""], 0
    for c in text:
        depth += (c in "([{") - (c in ")]}")
        if c == "," and depth == 0:
            parameters.append("")
        else:
            parameters[-1] += c
    return parameters


def check_functions(files, root):
    problems, homes, external = [], collections.defaultdict(set), {}
    public = set(re.findall(r"\bfs_\w+(?=\()", (root / "include" / "flashsplat.h").read_text(encoding="utf-8")))
    for path in files:
        where = path.relative_to(root)
        for head, name, parameters, _ in functions(path.read_text(encoding="utf-8")):
            if len(parameters) > MOST_PARAMETERS:
                problems.append(f"{where}: {name} has {len(parameters)} parameters, at most {MOST_PARAMETERS}")
            if where.parts[0] == "src" and not re.search(r"\bstatic\b|\b(FN|INLINE)\b", head) and name not in public:
                homes[name].add(path.stem)
                external[name] = where
    for name, where in external.items():
        if not any(name == f"fs_{s}" or name.startswith(f"fs_{s}_") for s in homes[name]):
            problems.append(f"{where}: {name} should be called fs_<file>_...")
    return problems


def main():
    root = pathlib.Path(sys.argv[1] if len(sys.argv) > 1 else ".").resolve()
    files = [p for d in ("src", "cli", "include") for p in sorted((root / d).rglob("*.[ch]"))]
    if not files:
        sys.exit(f"{root}: no sources found")
    problems = [problem for path in files for problem in check_file(path, root)]
    problems += check_file_names(files, root)
    problems += check_functions(files + sorted((root / "tests").rglob("*.[ch]")), root)
    print("\n".join(problems) or f"{len(files)} files: includes point down, names give their file, "
          f"at most {MOST_PARAMETERS} parameters")
    sys.exit(1 if problems else 0)


main()
