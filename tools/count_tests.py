#!/usr/bin/env python3
"""Adds up the results of meson's testlog.json files. The first argument is the number of steps that failed: when no
test failed, they are the failures (a build that broke). Prints "N passed, N failed" and fails when any did."""
import json
import sys


def main():
    failed_steps, passed, failed, skipped = int(sys.argv[1]), 0, 0, 0
    for path in sys.argv[2:]:
        try:
            with open(path, encoding="utf-8") as lines:
                results = [json.loads(line) for line in lines if line.strip()]
        except OSError:
            print(f"{path}: no results")
            continue
        for test in results:
            if test["result"] in ("OK", "EXPECTEDFAIL"):
                passed += 1
            elif test["result"] == "SKIP":
                skipped += 1
                print(f"skipped: {test['name']} ({path})")
            else:
                failed += 1
                print(f"{test['result']}: {test['name']} ({path})")
    if skipped:
        print(f"{skipped} skipped")
    failed = failed or failed_steps
    print(f"{passed} passed, {failed} failed")
    sys.exit(1 if failed else 0)


main()
