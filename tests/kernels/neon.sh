#!/bin/sh
# Builds the kernels and their tests for 64-bit ARM with Debian's cross compiler and runs them under qemu-user.
#   neon.sh SOURCE_ROOT WORK_DIR
# Exit status 77 (skipped) where gcc-aarch64-linux-gnu, its libc or qemu-user is missing.
set -eu
root=$1
work=$2
cc=aarch64-linux-gnu-gcc
qemu=$(command -v qemu-aarch64 || command -v qemu-aarch64-static || true)
if ! command -v $cc >/dev/null || [ -z "$qemu" ]; then
    echo "skipped: needs gcc-aarch64-linux-gnu, libc6-dev-arm64-cross and qemu-user"
    exit 77
fi
mkdir -p "$work"
printf 'int main(void) { return 0; }\n' >"$work/probe.c"
if ! $cc -static "$work/probe.c" -o "$work/probe" 2>/dev/null; then
    echo "skipped: $cc cannot link; needs libc6-dev-arm64-cross"
    exit 77
fi

flags="-std=c17 -O1 -Wall -Wextra -Werror -Wno-psabi -Wno-missing-field-initializers -D_GNU_SOURCE -ffp-contract=fast -I$root/include -I$root/src"
objects=
for source in "$root"/src/base/cpu.c "$root"/src/base/error.c "$root"/src/base/order.c "$root"/src/kernels/*.c "$root"/src/engine/gain_graph.c; do
    object=$work/$(basename "$source" .c).o
    $cc $flags -c "$source" -o "$object"
    objects="$objects $object"
done
failed=0
for test in "$root"/tests/kernels/test_*.c; do
    grep -q cmocka "$test" && continue # needs libraries of this machine
    name=$(basename "$test" .c)
    # -fno-tree-vectorize: GCC 12 for ARM stumbles over a loop of a test
    $cc $flags -fno-tree-vectorize "$test" "$root/tests/kernels/vmath_simd.c" $objects -static -lm -o "$work/$name"
    printf '%s: ' "$name"
    "$qemu" "$work/$name" || failed=1
done
exit $failed
