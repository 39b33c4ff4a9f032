#!/usr/bin/env python3
"""Adds up what the steps of .ci/run did. Each argument is NAME:EXIT_CODE:LOG, where LOG is meson's testlog.json of that
step or "none". A step that failed without a failed test (a build that broke) counts as one failure. Prints
"N passed, N failed" and fails when any did."""
import json
import sys


def read_results(path):
    try:
        with open(path, encoding="utf-8") as lines:
            return [json.loads(line) for line in lines if line.strip()]
    except OSError:
        return []


def main():
    passed, failed, skipped = 0, 0, 0
    for argument in sys.argv[1:]:
        name, code, log = argument.split(":", 2)
        failed_here = 0
        for test in read_results(log):
            if test["result"] in ("OK", "EXPECTEDFAIL"):
                passed += 1
            elif test["result"] == "SKIP":
                skipped += 1
                print(f"{name}: skipped {test['name']}")
            else:
                failed_here += 1
                print(f"{name}: {test['result']} {test['name']}")
        if int(code) != 0 and failed_here == 0:
            failed_here = 1
            print(f"{name}: failed with exit code {code}")
        failed += failed_here
    if skipped:
        print(f"{skipped} skipped")
    print(f"{passed} passed, {failed} failed")
    sys.exit(1 if failed else 0)


main()
