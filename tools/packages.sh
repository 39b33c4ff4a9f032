#!/bin/sh
# Installs the Debian packages of the given purposes (build, run, test; see packages.txt) that are missing.
# Needs no network and no rights when none is.
set -eu

list=$(dirname "$0")/packages.txt
if ! command -v dpkg-query >/dev/null; then
    echo "Not a Debian system: the packages of $list are taken to be there under their names here." >&2
    exit 0
fi

missing=
for purpose in "$@"; do
    for package in $(sed -n "s/^$purpose  *//p" "$list"); do
        case $(dpkg-query -W -f '${db:Status-Status} ' "$package" 2>/dev/null || true) in
        *installed*) ;;
        *) command -v "$package" >/dev/null || missing="$missing $package" ;; # npm may come with another nodejs
        esac
    done
done
[ -n "$missing" ] || exit 0

as_root=
if [ "$(id -u)" != 0 ]; then
    command -v sudo >/dev/null || {
        echo "Missing packages and no sudo. As root: apt-get install$missing" >&2
        exit 1
    }
    as_root=sudo
fi
echo "Installing:$missing"
$as_root apt-get update -q
# shellcheck disable=SC2086
$as_root env DEBIAN_FRONTEND=noninteractive apt-get install -q -y --no-install-recommends $missing
