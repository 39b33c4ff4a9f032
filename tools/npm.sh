#!/bin/sh
# Fetches the programs of others that the tests read our files with (tests/npm/package.json, exact versions) into
# tests/npm/node_modules, once. Where they can't be had it says so, and the tests that need them are skipped.
set -eu

cd "$(dirname "$0")/../tests/npm"
made=node_modules/.package-lock.json
if [ -e $made ] && [ ! package-lock.json -nt $made ]; then exit 0; fi
command -v npm >/dev/null || {
    echo "npm is not here: tests that need tests/npm are skipped." >&2
    exit 0
}
if npm ci --ignore-scripts --no-audit --no-fund --fetch-retries=1 >npm.part.log 2>&1; then
    touch $made
    rm -f npm.part.log
else
    echo "npm ci failed (tests/npm/npm.part.log): tests that need tests/npm are skipped." >&2
fi
