# Sourced by ./semvslam. Runs all tests and ends with one line "N passed, N failed, N skipped"; the exit code is 0 only when
# nothing failed.
#   run_tests [--filter REGEX] [--full]
# --filter: only the tests whose name matches. --full: also clang-tidy, the sanitizers and the fuzz targets.

passed=0 failed=0 skipped=0
failures=()

# Adds the numbers of a ctest JUnit report.
count_report() {
  local numbers
  numbers=$(python3 - "$1" << 'PYTHON'
import sys, xml.etree.ElementTree as tree
cases = tree.parse(sys.argv[1]).getroot().findall("testcase")
bad = [c.get("name") for c in cases if c.get("status") == "fail"]
skip = sum(c.get("status") in ("notrun", "disabled", "skipped") for c in cases)
print(len(cases) - len(bad) - skip, len(bad), skip, *bad)
PYTHON
  ) || { count_step "report $1" 1; return; }
  local words
  read -r -a words <<< "$numbers"
  passed=$((passed + words[0])) failed=$((failed + words[1])) skipped=$((skipped + words[2]))
  failures+=("${words[@]:3}")
}

# count_step NAME CODE: a step that is one test.
count_step() {
  case $2 in
    0) passed=$((passed + 1)) ;;
    77) skipped=$((skipped + 1)) ;;
    *) failed=$((failed + 1)); failures+=("$1") ;;
  esac
}

# run_ctest FOLDER [CTEST OPTION...]
run_ctest() {
  local folder=$1 code=0
  shift
  rm -f "$folder/report.xml"
  ctest --test-dir "$folder" -j "$(nproc)" --output-on-failure --output-junit "$folder/report.xml" "$@" > "$folder/ctest.log" \
    2>&1 < /dev/null || code=$?
  grep -vE '^ *[0-9]+/[0-9]+ Test .*Passed|^ +Start|^$' "$folder/ctest.log" | grep -vE '^Test project|^Internal ctest' || true
  if [ -e "$folder/report.xml" ]; then
    count_report "$folder/report.xml"
  else
    count_step "ctest in $folder" 1
  fi
}

# A virtual environment with evo; nothing where the package index cannot be reached: its test is then skipped.
ensure_evo() {
  local environment=$root/build/evo
  if [ ! -x "$environment/bin/python" ] || ! "$environment/bin/python" -c 'import evo' 2> /dev/null; then
    { python3 -m venv "$environment" && "$environment/bin/pip" install --quiet 'evo>=1.28,<2'; } > "$state/evo.log" 2>&1 < /dev/null ||
      say "evo cannot be installed here; the comparison with it is skipped (log: $state/evo.log)"
  fi
  if [ -x "$environment/bin/python" ]; then export SEMVSLAM_EVO_PYTHON=$environment/bin/python; fi
}

# sanitized PRESET CTEST_REGEX MODULE...: builds the tests of some modules with a sanitizer and runs those that match.
sanitized() {
  local preset=$1 regex=$2 folder=$root/build/$1 known module targets=()
  shift 2
  configure "$folder" "$preset"
  known=$(ninja -C "$folder" -t targets all)
  for module in "$@"; do
    if grep -q "^${module}_test: " <<< "$known"; then targets+=("${module}_test"); fi
  done
  if ! (compile "$folder" "${targets[@]}"); then
    count_step "build $preset" 1
    return
  fi
  run_ctest "$folder" -R "$regex"
}

run_full() {
  say "clang-tidy"
  local code=0
  python3 "$root/tools/run_tidy.py" "$build" || code=$?
  count_step clang-tidy $code
  say "address and undefined-behaviour sanitizers"
  sanitized asan '^(base|geometry|data|feature|map|eval)\.' base geometry data feature map eval
  say "thread sanitizer"
  sanitized tsan '^(base|pipeline)\.|Prefetch' base data pipeline
  if [ -e "$root/fuzz/CMakeLists.txt" ]; then
    say "fuzz targets, ${SEMVSLAM_FUZZ_SECONDS:-60} s each"
    configure "$root/build/fuzz" fuzz -DSEMVSLAM_FUZZ_SECONDS="${SEMVSLAM_FUZZ_SECONDS:-60}"
    if (compile "$root/build/fuzz" all); then
      run_ctest "$root/build/fuzz" -L fuzz
    else
      count_step "build fuzz" 1
    fi
  fi
}

run_tests() {
  local full=false filter=()
  while [ $# -gt 0 ]; do
    case $1 in
      --full) full=true ;;
      --filter)
        [ $# -ge 2 ] || fail "--filter needs a regular expression"
        filter=(-R "$2")
        shift
        ;;
      *) fail "unknown option of test: $1 (known: --filter REGEX, --full)" ;;
    esac
    shift
  done
  ensure_evo
  configure "$build" release
  compile "$build" all
  say "tests"
  run_ctest "$build" "${filter[@]}"
  if $full && [ "${#filter[@]}" -eq 0 ]; then run_full; fi

  if [ "${#failures[@]}" -gt 0 ]; then printf 'failed: %s\n' "${failures[@]}"; fi
  local line="$passed passed, $failed failed"
  if [ "$skipped" -gt 0 ]; then line+=", $skipped skipped"; fi
  echo "$line"
  [ "$failed" -eq 0 ] && [ "$passed" -gt 0 ]
}
