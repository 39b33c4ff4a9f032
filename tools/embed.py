#!/usr/bin/env python3
"""Makes one C file of text files: embed.py OUT.c HEADER NAME=FILE[,FILE...] ... Each NAME is a `const char NAME[]`, as
HEADER declares it, with the files one after the other."""
import pathlib
import sys


def literal(line):
    safe = line.replace("\\", "\\\\").replace('"', '\\"').replace("?", "\\?").replace("\t", "\\t")
    if not safe.isascii() or not safe.isprintable():
        raise SystemExit(f"embed.py: not plain ASCII: {line!r}")
    return f'    "{safe}\\n"\n'


def main():
    out, header, *texts = sys.argv[1:]
    result = f'#include "{header}"\n'
    for text in texts:
        name, files = text.split("=")
        lines = [l for f in files.split(",") for l in pathlib.Path(f).read_text(encoding="utf-8").splitlines()]
        result += f"\nconst char {name}[] =\n" + "".join(map(literal, lines)) + ";\n"
    pathlib.Path(out).write_text(result, encoding="utf-8")


main()
