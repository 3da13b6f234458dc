#!/bin/bash
# tools_are_told.sh PERIMAP WORK: a simulated probe touches the heart. What a replay publishes of it is off by no more than
# is asked for, its touches are told, the samples are the same for any number of workers, and a tip of a tool that the
# recording does not have changes nothing.
set -u
perimap=$1
work=$2
fail() { echo "$1" >&2; exit 1; }
rm -rf "$work" && mkdir -p "$work" && cd "$work" || exit 1
session="--tool --duration 32 --size 320x240 --fps 15 --seed 61 --tracker-noise 0 --threads 1"

"$perimap" replay --lockstep --workers 1 --simulated "$session" --json one.json --samples one.mcap > one.txt ||
  fail "a replay with a probe"
"$perimap" replay --lockstep --workers 3 --simulated "$session" --samples three.mcap > three.txt || fail "three workers"
cmp one.mcap three.mcap || fail "the samples depend on the number of workers"
grep -q "^tool  *instrument/probe: distance RMS" one.txt || fail "the report does not tell of the probe: $(cat one.txt)"

python3 - one.json << 'END' || fail "the figures: $(cat one.json)"
import json, sys
tool = json.load(open(sys.argv[1]))["tool"]
sys.exit(0 if tool["distance_rms_mm"] <= 0.4 and tool["nees"] <= 1.5 and tool["touches"] > 0 and
         tool["touches_told"] == tool["touches"] and abs(tool["touch_told_worst_frames"]) <= 1.0 and
         tool["touch_false_share"] == 0 and tool["usable"] > 0.7 * tool["samples"] else 1)
END

# A recording brings the tip along.
"$perimap" simulate short.mcap --tool --untold bare.mcap --duration 3 --size 160x120 --threads 1 > simulate.txt ||
  fail "a recording with a probe"
"$perimap" replay --lockstep short.mcap --samples samples.mcap > short.txt || fail "a recorded probe"
grep -q "^tool  *instrument/probe: no distance" short.txt || fail "a probe without a surface: $(cat short.txt)"
