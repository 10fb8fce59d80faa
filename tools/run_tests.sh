# Sourced by ./semvslam. Runs all tests and ends with one line "N passed, N failed, N skipped"; the exit code is 0 only when
# nothing failed.
#   run_tests [--filter REGEX] [--with STAGE,...] [--full]
# --filter: only the tests whose name matches. --with: more stages after them; --full: all of these:
#   tidy     clang-tidy: headers and the source files changed last
#   threads  thread sanitizer: the tests of everything that uses threads, and the program
#   fuzz     libFuzzer targets of every parser, SEMVSLAM_FUZZ_SECONDS each (60), with both sanitizers of `memory`
#   memory   address and undefined-behaviour sanitizers: the tests of all modules, and the program

all_stages=(tidy threads fuzz memory)
passed=0 failed=0 skipped=0
failures=()
environment=()

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

# run_ctest FOLDER [CTEST OPTION...]: the caller may have set `environment`, words to run it with.
run_ctest() {
  local folder=$1 code=0
  shift
  rm -f "$folder/report.xml"
  "${environment[@]}" ctest --test-dir "$folder" -j "$(nproc)" --output-on-failure --output-junit "$folder/report.xml" "$@" \
    > "$folder/ctest.log" 2>&1 < /dev/null || code=$?
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

# build_folder PRESET TARGET_REGEX: configures a build of its own and makes the targets that match.
build_folder() {
  local preset=$1 regex=$2 folder=$root/build/$1 targets
  configure "$folder" "$preset" -DSEMVSLAM_FUZZ_SECONDS="${SEMVSLAM_FUZZ_SECONDS:-60}"
  mapfile -t targets < <(ninja -C "$folder" -t targets all | sed -nE "s/^($regex): .*/\\1/p")
  if (compile "$folder" "${targets[@]}"); then return 0; fi
  count_step "build $preset" 1
  return 1
}

# Sets `environment` to what the libraries need under a sanitizer, and to a quick program for what is only a test's input.
sanitizer_environment() {
  # TBB loads its processor binding in a way (RTLD_DEEPBIND) that the sanitizers refuse, unless it is told of them. Debian's
  # TBB is too old to listen; OpenVINO brings a newer one.
  local tbb
  tbb=$(find -L "$root/build/openvino" -name 'libtbb.so.12' -print -quit 2> /dev/null || true)
  # With addresses as random as newer kernels make them, the thread sanitizer finds no room for its shadow.
  if setarch -R true 2> /dev/null; then environment=(setarch -R); fi
  environment+=(env UBSAN_OPTIONS=print_stacktrace=1 TSAN_OPTIONS="suppressions=$root/tools/tsan.supp second_deadlock_stack=1"
    TBB_ENABLE_SANITIZERS=1 SEMVSLAM_RENDERER="$program" LD_LIBRARY_PATH="${tbb%/*}")
}

run_stage() {
  local code=0 environment=()
  if [ "$1" != tidy ]; then sanitizer_environment; fi
  case $1 in
    tidy)
      say "clang-tidy"
      python3 "$root/tools/run_tidy.py" "$build" || code=$?
      count_step clang-tidy $code
      ;;
    threads)
      say "thread sanitizer"
      if build_folder tsan "(base|data|render|dynamic|tracking|pipeline|web|apps)_test|semvslam_program"; then
        # What has no thread beside its own, and takes half the time of pipeline's tests.
        environment+=(GTEST_FILTER='-*/deterministic:*Deterministic*')
        run_ctest "$root/build/tsan" -R '^(base|data|render|dynamic|tracking|pipeline|web|apps)\.|^house\.program$'
      fi
      ;;
    fuzz)
      say "fuzz targets, ${SEMVSLAM_FUZZ_SECONDS:-60} s each"
      if build_folder asan "fuzz_[a-z_]+"; then run_ctest "$root/build/asan" -L fuzz; fi
      ;;
    memory)
      say "address and undefined-behaviour sanitizers"
      if build_folder asan "[a-z]+_test|semvslam_program"; then
        run_ctest "$root/build/asan" -R '^[a-z]+\.' -E '^fuzz\.|^house\.(layers|format|consumer|evo)'
      fi
      ;;
  esac
}

run_tests() {
  local stages=() stage filter=()
  while [ $# -gt 0 ]; do
    case $1 in
      --full) stages=("${all_stages[@]}") ;;
      --with)
        [ $# -ge 2 ] || fail "--with needs stages, separated by commas: ${all_stages[*]}"
        IFS=, read -r -a stages <<< "$2"
        for stage in "${stages[@]}"; do
          [[ " ${all_stages[*]} " == *" $stage "* ]] || fail "unknown stage: $stage (known: ${all_stages[*]})"
        done
        shift
        ;;
      --filter)
        [ $# -ge 2 ] || fail "--filter needs a regular expression"
        filter=(-R "$2")
        shift
        ;;
      *) fail "unknown option of test: $1 (known: --filter REGEX, --with STAGE,..., --full)" ;;
    esac
    shift
  done
  ensure_evo
  configure "$build" release
  compile "$build" all
  say "tests"
  run_ctest "$build" "${filter[@]}"
  for stage in "${stages[@]}"; do run_stage "$stage"; done

  if [ "${#failures[@]}" -gt 0 ]; then printf 'failed: %s\n' "${failures[@]}"; fi
  local line="$passed passed, $failed failed"
  if [ "$skipped" -gt 0 ]; then line+=", $skipped skipped"; fi
  echo "$line"
  [ "$failed" -eq 0 ] && [ "$passed" -gt 0 ]
}
