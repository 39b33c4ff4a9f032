#!/bin/sh
# run.sh FUZZ SECONDS [KIND...]: fuzzes the kinds of input one after the other, all where none is named, each for
# SECONDS from its committed corpus. What is found lies in the folder of FUZZ: new inputs in found/KIND, those that
# break something in broken/KIND-*. Prints a line per kind; fails when one broke.
fuzz=$(realpath "$1") seconds=$2
shift 2
corpora=$(realpath "$(dirname "$0")/corpus")
cd "$(dirname "$fuzz")" || exit 1
[ $# -gt 0 ] || set -- $(ls "$corpora")
export UBSAN_OPTIONS=print_stacktrace=1 ASAN_OPTIONS=allocator_may_return_null=1
mkdir -p broken
failed=0
for kind in "$@"; do
    mkdir -p "found/$kind"
    "$fuzz" "--kind=$kind" -max_total_time="$seconds" -timeout=10 -rss_limit_mb=2048 -malloc_limit_mb=8192 \
        -max_len=65536 -print_final_stats=1 -artifact_prefix="broken/$kind-" "found/$kind" "$corpora/$kind" \
        >"$kind.log" 2>&1
    code=$?
    [ $code -eq 0 ] || failed=1
    awk -v kind="$kind" -v code=$code '
        / cov: / { for (i = 1; i < NF; i++) { if ($i == "cov:") cov = $(i + 1); if ($i == "ft:") ft = $(i + 1) } }
        /number_of_executed_units/ { runs = $2 }
        /average_exec_per_sec/ { rate = $2 }
        /^SUMMARY|^broken promise|ERROR: libFuzzer/ { if (!why) why = $0 }
        END { printf "%-14s %9d runs, %5d a second, %5d edges, %6d features%s\n", kind, runs, rate, cov, ft,
              code ? "  BROKEN: " why : "" }' "$kind.log"
done
exit $failed
