#!/bin/bash
# Shows perimap at work without any hardware: a simulated session with a real heart's motion and a real ECG's rhythm,
# recorded, replayed in real time by perimapd, received over DDS by another process, and compared with the truth.
set -uo pipefail
cd "$(dirname "$0")/.."

usage() {
  cat << 'END'
deploy/demo.sh [--duration SECONDS] [--jobs N]
  Installs the packages, builds perimap, simulates SECONDS (60) of a beating heart with an exact and with a noisy
  tracker, follows each in real time, and ends with a report. Everything it makes is in demo-output/.
Exit code 0 when every part worked, 1 when one failed, 2 for a wrong command line.
END
}

duration=60
jobs=$(nproc)
while [ $# -gt 0 ]; do
  case $1 in
    --duration)
      duration=${2:-}
      shift
      ;;
    --jobs)
      jobs=${2:-}
      shift
      ;;
    -h | --help)
      usage
      exit 0
      ;;
    *)
      echo "demo.sh: unknown option $1" >&2
      usage >&2
      exit 2
      ;;
  esac
  shift
done
if ! [[ $duration =~ ^[1-9][0-9]*$ && $jobs =~ ^[1-9][0-9]*$ ]]; then
  echo "demo.sh: --duration and --jobs need a positive number" >&2
  exit 2
fi

output=demo-output
perimap=build/release/daemon/perimap
perimapd=build/release/daemon/perimapd
processes=()

say() { printf '\n[%2d:%02d] %s\n' $((SECONDS / 60)) $((SECONDS % 60)) "$*"; }

stop_processes() {
  local process
  for process in "${processes[@]}"; do kill -TERM "$process" 2> /dev/null; done
  for process in "${processes[@]}"; do wait "$process" 2> /dev/null; done
  processes=()
}
trap 'stop_processes' EXIT
trap 'trap - INT TERM; stop_processes; say "Stopped."; exit 130' INT TERM

fail() {
  say "FAILED: $*"
  exit 1
}

# In the background and waited for, so that Ctrl-C is heard at once. timeout(1) makes a process group of its own and
# passes the signal on to all of it, compilers included; of time there is no limit (0), since nobody knows the machine.
run() {
  timeout --kill-after=10 0 "$@" &
  processes=($!)
  wait "${processes[0]}"
  local status=$?
  processes=()
  return $status
}

run_quietly() { # LOG COMMAND...
  local log=$1
  shift
  if ! run "$@" > "$log" 2>&1; then
    tail -n 40 "$log"
    return 1
  fi
}

# How far the log of a build has come: the last "[123/456]" in it. A line that is written anew on a terminal, elsewhere a
# line for each tenth.
tell_progress() { # LOG
  local done=0 all=0 tenth=0 last=''
  while sleep 1 && kill -0 $$ 2> /dev/null; do  # not longer than the script
    last=$(grep -aoE '^\[[0-9]+/[0-9]+\]' "$1" 2> /dev/null | tail -n 1 | tr -d '[]')
    [ -n "$last" ] || continue
    done=${last%/*} all=${last#*/}
    if [ -t 1 ]; then
      printf '\r        %d of %d steps (%d %%), %d:%02d' "$done" "$all" $((100 * done / all)) \
        $((SECONDS / 60)) $((SECONDS % 60))
    elif [ $((10 * done / all)) -gt $tenth ]; then
      tenth=$((10 * done / all))
      printf '[%2d:%02d] %d of %d steps\n' $((SECONDS / 60)) $((SECONDS % 60)) "$done" "$all"
    fi
  done
}

run_with_progress() { # LOG COMMAND...
  : > "$1"
  tell_progress "$1" &
  local teller=$! status=0
  run_quietly "$@" || status=$?
  kill "$teller" 2> /dev/null
  wait "$teller" 2> /dev/null
  if [ -t 1 ]; then echo; fi
  return $status
}

mkdir -p "$output"

say "Packages"
deploy/install-packages.sh --build || fail "packages"

say "Building (log: $output/build.log)"
launcher=()
if command -v ccache > /dev/null; then
  launcher=(-DCMAKE_C_COMPILER_LAUNCHER=ccache -DCMAKE_CXX_COMPILER_LAUNCHER=ccache)
fi
# Files together where a target allows that: half of the time, and the same program.
run_quietly "$output/configure.log" cmake --preset release -DPERIMAP_TOGETHER=ON "${launcher[@]}" || fail "configuring"
run_with_progress "$output/build.log" cmake --build --preset release -j "$jobs" --target perimap perimapd || fail "building"

say "Simulating $duration s of a beating heart, with an exact tracker and with 1.4 mm of noise"
rm -f "$output"/heart-*
run "$perimap" simulate "$output/heart.mcap" --duration "$duration" --tracker-noises 0,1.4 || fail "simulation"

# perimapd and its subscriber find each other on the loopback interface alone, in a domain of their own.
domain=$((20 + $$ % 100))
CYCLONEDDS_URI="deploy/cyclonedds-loopback.xml"
export CYCLONEDDS_URI

follow() { # NAME: replays heart-NAME.mcap in real time; received samples go to heart-NAME.received.mcap
  local stem=$output/heart-$1
  cat > "$stem.toml" << END
version = 1

[replay]
recording = "heart-$1.mcap"

[dds]
domain = $domain
END
  "$perimap" watch --lines --domain "$domain" --wait 60 --record "$stem.received.mcap" &
  local watch=$!
  "$perimapd" -c "$stem.toml" > "$stem.log" 2>&1 &
  local daemon=$!
  processes=("$watch" "$daemon")
  local status=0
  if ! wait "$daemon"; then
    tail -n 20 "$stem.log"
    status=1
  fi
  sleep 0.5  # the last sample is under way
  kill -INT "$watch" 2> /dev/null
  wait "$watch" || status=1
  processes=()
  return $status
}

for name in 0mm 1.4mm; do
  say "perimapd follows heart-$name.mcap in real time; perimap watch, another process, receives over DDS:"
  follow $name || fail "following heart-$name.mcap (log: $output/heart-$name.log)"
done

for name in 0mm 1.4mm; do
  say "What was received, against the truth: tracker noise ${name%mm} mm"
  run "$perimap" report "$output/heart-$name.mcap" --samples "$output/heart-$name.received.mcap" \
    --picture "$output/heart-$name.svg" || fail "report on heart-$name.mcap"
done

for name in 0mm 1.4mm; do
  say "The same session without its truth, as after a real one: tracker noise ${name%mm} mm"
  run "$perimap" session "$output/heart-$name.mcap" --samples "$output/heart-$name.received.mcap" \
    --html "$output/session-$name.html" || fail "page of heart-$name.mcap"
done

say "Pictures: $output/heart-0mm.svg, $output/heart-1.4mm.svg"
say "Done. Session reports: $output/session-0mm.html, $output/session-1.4mm.html"
