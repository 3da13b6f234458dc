#!/bin/bash
# Builds perimap and runs its tests.
set -uo pipefail
cd "$(dirname "$0")/.."

usage() {
  cat << 'END'
tests/run.sh [--full [PART...]] [--jobs N]
  Installs the packages, builds the presets quick and asan, runs their tests. About twenty-five minutes on two cores.
  Each test but those labelled `long` runs once: what reads the bytes of files, devices and messages under
  AddressSanitizer, all else without sanitizers.
  --full    everything, or the parts named. Some hours on two cores that do nothing else.
              dev    every test but the long ones, without sanitizers
              asan   the same under AddressSanitizer and all of UndefinedBehaviorSanitizer
              tsan   whole programs, and unit tests with threads, under ThreadSanitizer
              long   the tests labelled `long`, and statistics over many seeds, without sanitizers
              fuzz   a minute of each fuzz target
              lint   each file compiled alone, without precompiled headers; format; clang-tidy
  --jobs N  parallel compilations; all processors when not given
A test that fails is run once more, alone; the end names those that needed it.
Exit code 0 when everything passed, 1 when something failed, 2 for a wrong command line. Logs: build/logs/.
END
}

full=no
parts=()
jobs=$(nproc)
while [ $# -gt 0 ]; do
  case $1 in
    --full) full=yes ;;
    dev | asan | tsan | long | fuzz | lint) parts+=("$1") ;;
    --jobs)
      jobs=${2:-}
      shift
      ;;
    --jobs=*) jobs=${1#--jobs=} ;;
    -h | --help)
      usage
      exit 0
      ;;
    *)
      echo "run.sh: unknown option $1" >&2
      usage >&2
      exit 2
      ;;
  esac
  shift
done
if [ ${#parts[@]} -gt 0 ] && [ $full = no ]; then
  echo "run.sh: parts are parts of --full" >&2
  exit 2
fi
if ! [[ $jobs =~ ^[1-9][0-9]*$ ]]; then
  echo "run.sh: --jobs needs a positive number" >&2
  exit 2
fi

logs=build/logs
mkdir -p "$logs"
running=
ahead=
failures=()
second_try=()

elapsed() { printf '%2d:%02d' $((SECONDS / 60)) $((SECONDS % 60)); }
say() { printf '[%s] %s\n' "$(elapsed)" "$*"; }

# timeout(1) makes a process group of its own and passes the signal on to all of it.
stop() {
  trap - INT TERM
  stop_ahead
  if [ -n "$running" ]; then kill -TERM "$running" 2> /dev/null && wait "$running"; fi
  say "Stopped."
  exit 130
}
trap stop INT TERM

# What ninja and ctest print, "[12/340] ..." and "12/340 Test ...", or how many files clang-tidy has begun.
progress() {
  local counted files
  counted=$(grep -aoE '^ *\[?[0-9]+/[0-9]+\]?' "$1" | tail -n 1 | tr -d '[] ')
  files=$(grep -ac '^clang-tidy' "$1")
  if [ -z "$counted" ] && [ "$files" -gt 0 ]; then counted="$files files"; fi
  printf '%s' "${counted:-under way}"
}

# step NAME LIMIT COMMAND...: runs the command with its output in a log; tells every 20 s how far it is.
step() {
  local name=$1 limit=$2
  shift 2
  local log=$logs/${name//[^a-zA-Z0-9]/-}.log
  local began=$SECONDS told=$SECONDS
  say "$name ..."
  timeout --kill-after=10 "$limit" "$@" > "$log" 2>&1 < /dev/null &
  running=$!
  while kill -0 "$running" 2> /dev/null; do
    sleep 0.2
    if [ $((SECONDS - told)) -ge 20 ]; then
      told=$SECONDS
      say "$name: $(progress "$log")"
    fi
  done
  wait "$running"
  local status=$?
  running=
  if [ $status -eq 0 ]; then
    say "$name: passed in $((SECONDS - began)) s"
    return 0
  fi
  if [ $status -eq 124 ] || [ $status -eq 137 ]; then echo "(stopped after its limit of $limit)" >> "$log"; fi
  failures+=("$name")
  say "$name: FAILED after $((SECONDS - began)) s; the end of $log:"
  tail -n 60 "$log"
  return 1
}

launcher=()
if command -v ccache > /dev/null; then
  launcher=(-DCMAKE_C_COMPILER_LAUNCHER=ccache -DCMAKE_CXX_COMPILER_LAUNCHER=ccache)
fi

configure() { # PRESET
  # Which tests: see perimap_test in cmake/PerimapLibrary.cmake. A unit test once is enough for a quick run. What compiles
  # together is compiled together; that each file compiles alone is asked by lint.
  local preset=$1 tests=all undefined=all long=OFF
  if [ "$preset" = dev ]; then long=ON; fi
  case $preset in
    quick) tests=plain ;;
    tsan) tests=threads ;;
    asan)
      if [ $full = no ]; then
        tests=outside
        undefined=some
      fi
      ;;
  esac
  step "$preset configure" 5m cmake --preset "$preset" -DPERIMAP_TESTS=$tests -DPERIMAP_UNDEFINED=$undefined \
    -DPERIMAP_TOGETHER=ON -DPERIMAP_LONG=$long -DPERIMAP_WARNINGS_AS_ERRORS=ON "${launcher[@]}"
}

# Compiles all that compiles (-k 0): one run tells every error.
compile() { # PRESET BUILD_OPTION...
  local preset=$1
  shift
  step "$preset build" 90m cmake --build --preset "$preset" -j "$jobs" "$@" -- -k 0
}

build() { configure "$1" && compile "$@"; }

# Tests of whole programs wait for clocks and devices more than they compute: what they leave of the processors is for the
# build that comes next, at the lowest priority. compile() goes on where it was stopped, and tells its errors.
compile_ahead() { # PRESET
  timeout 90m nice -n 19 cmake --build --preset "$1" -j "$jobs" -- -k 0 > "$logs/$1-build-ahead.log" 2>&1 < /dev/null &
  ahead=$!
}

stop_ahead() {
  if [ -n "$ahead" ]; then
    kill -TERM "$ahead" 2> /dev/null
    wait "$ahead"
    ahead=
  fi
}

# Many tests run programs against the machine's clock, several at a time, and the machine may have other work besides.
# So what fails is run once more with nothing of ours beside it, and told at the end even when it passes then.
run_tests() { # NAME PRESET CTEST_OPTION...
  local name=$1 preset=$2
  shift 2
  local log=$logs/${name//[^a-zA-Z0-9]/-}.log at_once=$jobs
  # Most wait for clocks and devices, but where a sanitizer makes them compute.
  case $preset in quick | dev) at_once=$((jobs + 1)) ;; esac
  if ! step "$name" 120m ctest --preset "$preset" -j "$at_once" --timeout 300 --no-tests=error "$@"; then
    local failed
    failed=$(sed -n '/^The following tests FAILED/,$p' "$log" | grep -aoE '[0-9]+ - [^ ]+' | cut -d ' ' -f 3)
    printf '%s\n' "$failed"
    stop_ahead
    if [ -n "$failed" ] && step "$name again" 60m ctest --preset "$preset" -j 1 --timeout 300 --rerun-failed; then
      unset 'failures[-1]'
      second_try+=("$failed")
    fi
  fi
  grep -a 'tests passed' "$log"
  # Where CTest runs whole programs it counts those; GoogleTest counts the cases.
  grep -aoE '^\[  PASSED  \] [0-9]+' "build/$preset/Testing/Temporary/LastTest.log" |
    awk '{ cases += $4 } END { if (cases) print cases " cases of unit tests passed in them" }'
}

fuzz_smoke() {
  local programs=build/fuzz/tests/fuzz corpus=build/fuzz/corpus maker
  for maker in "$programs"/make_*_corpus; do step "$(basename "$maker")" 5m "$maker" "$corpus"; done
  step "fuzz targets, $jobs at once" 60m tests/fuzz/run_targets.sh "$jobs" "$programs" "$corpus" "$logs"
}

# By the release preset: GCC's precompiled headers are none for clang, and would lend a file what it does not include.
lint() {
  step "format" 5m bash -c \
    "find core drivers daemon deploy/examples idl tests -name '*.cpp' -o -name '*.hpp' -o -name '*.c' | xargs clang-format --dry-run -Werror"
  # What is compiled together is a file that includes .cpp files, which nothing else may.
  step "no source is included" 1m bash -c "! grep -rnE '#include.*\.(cpp|c)[>\"]' core drivers daemon"
  step "files alone configure" 5m cmake --preset release -B build/alone || return
  step "files alone generated headers" 15m cmake --build build/alone -j "$jobs" --target generated_headers || return
  step "files alone" 60m tests/architecture/files_compile_alone.py build/alone "$jobs" core drivers daemon
  # clang-tidy spends nearly all of its time on the headers of others: what is compiled together is read together.
  step "clang-tidy configure" 5m cmake --preset release -B build/lint -DPERIMAP_TOGETHER=ON || return
  step "clang-tidy generated headers" 15m cmake --build build/lint -j "$jobs" --target generated_headers || return
  step "clang-tidy" 180m run-clang-tidy-14 -quiet -checks=-bugprone-suspicious-include \
    -extra-arg=-Wno-unknown-warning-option -p build/lint -j "$jobs" "^$PWD/(build/lint/)?(core|drivers|daemon)/"
}

packages=--test
if [ $full = yes ]; then packages=--full; fi
deploy/install-packages.sh $packages || exit 1

if [ $full = no ]; then
  if build quick; then
    if configure asan; then compile_ahead asan; fi
    run_tests "quick tests" quick -LE long
    stop_ahead
  fi
  if build asan; then run_tests "asan tests" asan -LE long; fi
elif [ ${#parts[@]} -eq 0 ]; then
  parts=(dev asan tsan long fuzz lint)
fi
for part in "${parts[@]}"; do
  case $part in
    dev | asan | tsan) if build "$part"; then run_tests "$part tests" "$part" -LE long; fi ;;
    long) if build dev; then run_tests "long tests" dev -L long; fi ;;
    fuzz) if build fuzz --target fuzzers; then fuzz_smoke; fi ;;
    lint) lint ;;
  esac
done

echo
if [ ${#second_try[@]} -gt 0 ]; then
  say "Failed beside other tests, passed alone: $(echo "${second_try[@]}" | tr '\n' ' ')"
fi
if [ ${#failures[@]} -eq 0 ]; then
  say "ALL PASSED"
  exit 0
fi
say "FAILED: $(printf '%s; ' "${failures[@]}")"
exit 1
