#!/usr/bin/env bash
# Builds the fuzz targets with clang and runs each for SEMVSLAM_FUZZ_SECONDS (default 60).
# usage: fuzz/run.sh [BUILD_FOLDER]       needs clang with its sanitizer run time (apt: clang-14 libclang-rt-14-dev)
set -euo pipefail
cd "$(dirname "$0")/.."
build=${1:-build/fuzz}
launcher=(); command -v ccache > /dev/null && launcher=(-DCMAKE_CXX_COMPILER_LAUNCHER=ccache)
cmake --preset fuzz -B "$build" -DSEMVSLAM_FUZZ_SECONDS="${SEMVSLAM_FUZZ_SECONDS:-60}" "${launcher[@]}"
cmake --build "$build" -j "$(nproc)"
ctest --test-dir "$build" -L fuzz --output-on-failure
