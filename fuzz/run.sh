#!/usr/bin/env bash
# Builds the fuzz targets with clang and runs each for SEMVSLAM_FUZZ_SECONDS (default 60).
# usage: fuzz/run.sh [BUILD_FOLDER]       needs clang++ with libFuzzer (apt: clang-14); CXX chooses another one
set -euo pipefail
source=$(cd "$(dirname "$0")/.." && pwd)
build=${1:-$source/build-fuzz}
launcher=(); command -v ccache > /dev/null && launcher=(-DCMAKE_CXX_COMPILER_LAUNCHER=ccache)
cmake -S "$source" -B "$build" -G Ninja -DCMAKE_BUILD_TYPE=RelWithDebInfo -DCMAKE_CXX_COMPILER="${CXX:-clang++-14}" \
  -DSEMVSLAM_FUZZ=ON -DSEMVSLAM_MODULES="base;geometry;data" -DSEMVSLAM_SANITIZE=fuzzer-no-link,address,undefined -DSEMVSLAM_BENCH=OFF \
  -DSEMVSLAM_FUZZ_SECONDS="${SEMVSLAM_FUZZ_SECONDS:-60}" "${launcher[@]}"
targets=(camera config file_lists png trajectory)
cmake --build "$build" --target "${targets[@]/#/fuzz_}"
ctest --test-dir "$build" -L fuzz --output-on-failure
