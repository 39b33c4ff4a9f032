#!/usr/bin/env python3
"""Makes one C file of text files: embed.py OUT.c HEADER --text NAME FILE... [--text NAME FILE...]. Each NAME is a
`const char NAME[]`, as HEADER declares it, with the files one after the other."""
import pathlib
import sys


def literal(line):
    safe = line.replace("\\", "\\\\").replace('"', '\\"').replace("?", "\\?").replace("\t", "\\t")
    if not safe.isascii() or not safe.isprintable():
        raise SystemExit(f"embed.py: not plain ASCII: {line!r}")
    return f'    "{safe}\\n"\n'


def main():
    out, header, *rest = sys.argv[1:]
    texts = []
    for word in rest:
        if word == "--text":
            texts.append([])
        else:
            texts[-1].append(word)
    result = f'#include "{header}"\n'
    for name, *files in texts:
        lines = [l for f in files for l in pathlib.Path(f).read_text(encoding="utf-8").splitlines()]
        result += f"\nconst char {name}[] =\n" + "".join(map(literal, lines)) + ";\n"
    pathlib.Path(out).write_text(result, encoding="utf-8")


main()
