#!/bin/bash
# Compiles the ensemble in several ways, times each on the first card, and compares with the references: about a minute.
# Arguments: number of trajectories [1000000]. Compiler logs and final states go to $OUT if that is set.
set -u
cd "$(dirname "$0")" || exit 1
root=$PWD
build=$root/build
mkdir -p "$build"
nvidia-smi --query-gpu=name,driver_version,clocks.sm,clocks.max.sm --format=csv,noheader
if ! command -v nvcc >/dev/null; then
    echo "there is no nvcc: through CuPy"
    exec python3 run.py "$@"
fi
names=()
variant() { # name, options of the compiler
    local name=$1
    shift
    names+=("$name")
    nvcc -O3 -std=c++17 -arch="${ARCH:-sm_90}" -Xptxas -v "$@" -o "$build/$name" main.cu >"$build/$name.log" 2>&1 &
}
variant exact-plain -DFL_EXACT -fmad=false
variant exact -DFL_EXACT
variant quick-128x3 -DFL_BLOCKS=3
variant quick-128x4
variant quick-128x5 -DFL_BLOCKS=5
variant quick-128x6 -DFL_BLOCKS=6
variant quick-64x8 -DFL_THREADS=64 -DFL_BLOCKS=8
variant quick-32x16 -DFL_THREADS=32 -DFL_BLOCKS=16
variant quick-256x2 -DFL_THREADS=256 -DFL_BLOCKS=2
wait
cd "$build" || exit 1
cp "$root/short/reference.bin" .
for name in exact-plain exact quick-128x4; do
    [ -x "$name" ] && timeout 60 "./$name" 1000 0 "$name"
done
cp "$root/reference.bin" .
for name in "${names[@]}"; do
    if [ -x "$name" ]; then timeout 60 "./$name" "${1:-1000000}" 3 "$name"; else tail -5 "$name.log"; fi
done
if command -v ncu >/dev/null; then
    metrics=sm__inst_executed_pipe_fp64.avg.pct_of_peak_sustained_active,sm__inst_executed_pipe_fp64.sum
    metrics=$metrics,sm__inst_executed.sum,smsp__thread_inst_executed_per_inst_executed.ratio
    metrics=$metrics,sm__warps_active.avg.pct_of_peak_sustained_active,smsp__issue_active.avg.pct_of_peak_sustained_active
    metrics=$metrics,smsp__average_warps_issue_stalled_math_pipe_throttle_per_issue_active.ratio
    metrics=$metrics,smsp__average_warps_issue_stalled_wait_per_issue_active.ratio
    metrics=$metrics,smsp__average_warps_issue_stalled_branch_resolve_per_issue_active.ratio
    metrics=$metrics,smsp__average_warps_issue_stalled_no_instruction_per_issue_active.ratio
    metrics=$metrics,smsp__average_warps_issue_stalled_short_scoreboard_per_issue_active.ratio
    timeout 60 ncu --clock-control none --metrics "$metrics" ./quick-128x4 300000 0 ncu 2>&1 | grep -E "__|steps|rror"
fi
if [ -n "${OUT:-}" ]; then
    cat ./*.log >"$OUT/compilers.txt"
    cp states.bin "$OUT"
fi
