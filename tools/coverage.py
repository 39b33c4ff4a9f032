#!/usr/bin/env python3
"""Line coverage of src/ in a build made with -Db_coverage=true whose tests have run: coverage.py BUILD [--missing].

Prints a line per folder and one for all; --missing names the lines of each file that no test reached. A line of a
header counts once, however many files include it. Fails below LEAST in all."""
import argparse
import collections
import concurrent.futures
import json
import pathlib
import subprocess
import sys

LEAST = 0.85


def read_counts(build, notes):
    """{(file, line): times run} of one object."""
    text = subprocess.run(["gcov", "--json-format", "--stdout", str(notes)], cwd=build, capture_output=True, text=True,
                          check=True).stdout
    counts = collections.Counter()
    for document in filter(None, text.splitlines()):
        for file in json.loads(document)["files"]:
            for line in file["lines"]:
                counts[file["file"], line["line_number"]] += line["count"]
    return counts


def ranges(lines):
    """[1, 2, 3, 7] as 1-3, 7"""
    parts = []
    for line in lines:
        if parts and line == parts[-1][1] + 1:
            parts[-1][1] = line
        else:
            parts.append([line, line])
    return ", ".join(str(a) if a == b else f"{a}-{b}" for a, b in parts)


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("build", type=pathlib.Path)
    parser.add_argument("--missing", action="store_true")
    args = parser.parse_args()
    build, root = args.build.resolve(), pathlib.Path(__file__).resolve().parent.parent / "src"
    notes = [p for p in build.rglob("*.gcno") if "/tests/" not in str(p.relative_to(build.parent))]
    counts = collections.Counter()
    with concurrent.futures.ThreadPoolExecutor() as pool:
        for result in pool.map(lambda p: read_counts(build, p), notes):
            for key, count in result.items():
                counts[key] += count  # also 0: the line is code
    files = collections.defaultdict(dict)
    for (name, line), count in counts.items():
        path = (build / name).resolve()
        if path.is_relative_to(root) and path.exists():  # notes of files that are no more stay in the build
            files[path.relative_to(root)][line] = files[path.relative_to(root)].get(line, 0) + count
    folders = collections.defaultdict(lambda: [0, 0])
    for path, lines in sorted(files.items()):
        missing = sorted(line for line, count in lines.items() if not count)
        for key in (path.parts[0] if len(path.parts) > 1 else "(top)", "in all"):
            folders[key][0] += len(lines) - len(missing)
            folders[key][1] += len(lines)
        if args.missing and missing:
            print(f"{path}: {100 - 100 * len(missing) / len(lines):.0f} %, not reached: {ranges(missing)}")
    in_all = folders.pop("in all", [0, 0])
    for name, (reached, lines) in [*sorted(folders.items()), ("in all", in_all)]:
        print(f"{name:12} {reached:6} of {lines:6} lines  {100 * reached / max(lines, 1):5.1f} %")
    sys.exit(0 if in_all[0] >= LEAST * in_all[1] else 1)


main()
