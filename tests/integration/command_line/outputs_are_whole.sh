#!/bin/bash
# What perimap writes is there whole or not at all, and that it cannot be written is said before the work begins. What is
# no file is not waited for.
#   outputs_are_whole.sh PERIMAP PERIMAPD RECORDING
set -uo pipefail
perimap=$1 perimapd=$2
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
cp "$3" "$work/r.mcap" || exit 1
cd "$work" || exit 1

fail() {
  echo "FAILED: $*"
  [ ! -f error ] || cat error
  exit 1
}

# ends CODE TEXT COMMAND...: soon, with the text in one line of standard error that begins with the program's name
ends() {
  local code=$1 text=$2
  shift 2
  timeout 20 "$@" > out 2> error
  local got=$?
  [ $got -eq "$code" ] || fail "'$*' ended with $got in place of $code"
  grep -qF -e "$text" error || fail "'$*' does not say: $text"
  if grep -qvE '^perimapd?[ :]' error; then fail "'$*': a line without the program's name"; fi
}

mkfifo pipe
ends 2 "pipe: expected a readable configuration file, got: a pipe" "$perimap" check pipe
ends 2 "pipe: expected a readable configuration file, got: a pipe" "$perimapd" -c pipe
ends 2 "pipe: expected a readable configuration file, got: a pipe" "$perimap" replay --lockstep r.mcap -c pipe
ends 1 "pipe: cannot open: a pipe" "$perimap" replay --lockstep pipe
ends 1 "pipe: expected a readable ECG table, got: a pipe" "$perimap" ecg pipe
ends 1 "a folder or a device, not a video file" "$perimap" track pipe --csv tracks.csv
printf 'version = 1\n[camera]\ncalibration = "pipe"\n' > calibration.toml
ends 2 "pipe is not a file" "$perimap" check calibration.toml

# Before the work begins: none of these could end so soon with what it was asked for.
ends 1 "--json: none/x.json: cannot be written: No such file or directory" "$perimap" replay r.mcap --json none/x.json
ends 1 "--html: none/x.html: cannot be written" "$perimap" bench r.mcap --html none/x.html --seconds 1000
ends 1 "--beats: none/x.csv: cannot be written" "$perimap" ecg r.mcap --beats none/x.csv
ends 1 "--picture: none/x.png: cannot be written" "$perimap" report r.mcap --samples r.mcap --picture none/x.png
ends 1 "--video: none/x.mkv: cannot be written" "$perimap" track r.mcap --csv tracks.csv --video none/x.mkv
ends 1 "none/x.mcap: cannot be written" "$perimap" replay --lockstep r.mcap --samples none/x.mcap
ends 1 "none/x.mcap: cannot be written" "$perimap" watch --record none/x.mcap
# An output that nobody reads is waited for by no command that only SIGKILL could end then.
ends 1 "pipe: cannot create: a pipe that nobody reads from" "$perimap" replay --lockstep r.mcap --samples pipe
ends 1 "pipe: cannot be written: a pipe that nobody reads from" "$perimap" replay --lockstep r.mcap --json pipe
ends 1 "pipe: cannot create: a pipe that nobody reads from" "$perimap" watch --record pipe
ends 1 "pipe: cannot be written: a pipe that nobody reads from" "$perimap" track r.mcap --csv pipe
touch file
ends 1 "file/sub" "$perimap" experiment 1 --trials 100000 --out file/sub
[ ! -e tracks.csv ] || fail "a table of nothing"

# A file that may not grow is like a full disk, but for one process alone. ThreadSanitizer begins by writing
# a quarter of a megabyte into TMPDIR, and does without where there is none.
nothing_new() {
  rm -f out error
  [ "$(ls)" = "$before" ] || fail "left behind: $(ls)"
}
before=$(rm -f out error; ls)
for output in --samples --json; do
  echo old > old
  before=$(rm -f out error; ls)
  (
    ulimit -f 1
    TMPDIR=/nowhere exec "$perimap" replay --lockstep r.mcap $output old
  ) > out 2> error
  [ $? -eq 1 ] || fail "replay $output ended with $? on a full disk"
  grep -q "^perimap replay: .*old: .*File too large" error || fail "replay $output does not name the file"
  nothing_new
  [ "$(cat old)" = old ] || fail "replay $output: the old file is gone"
  rm old
done
before=$(rm -f out error; ls)
(
  ulimit -f 64
  TMPDIR=/nowhere exec "$perimap" track r.mcap --csv tracks.csv
) > out 2> error
[ $? -eq 1 ] && grep -q "^perimap track: tracks.csv: cannot be written: File too large" error || fail "track on a full disk"
nothing_new
(
  ulimit -f 64
  TMPDIR=/nowhere exec "$perimap" simulate s.mcap --duration 2 --size 320x240
) > out 2> error
[ $? -eq 1 ] && grep -q "^perimap simulate: s.mcap: .*File too large" error || fail "simulate on a full disk"
nothing_new

# All of it, and nothing beside it.
"$perimap" replay --lockstep r.mcap --samples samples.mcap --json replay.json > out 2> error || fail "replay"
"$perimap" report r.mcap --samples samples.mcap --picture p.png --json report.json > out 2> error || fail "report"
[ "$(head -c 4 p.png | tail -c 3)" = PNG ] || fail "--picture p.png is no PNG"
"$perimap" report r.mcap --samples samples.mcap --picture p.svg > out 2> error || fail "report"
grep -q '<svg' p.svg || fail "--picture p.svg is no SVG"
ends 2 "--picture: expected a file that ends in .svg or .png, got p.jpg" \
  "$perimap" report r.mcap --samples samples.mcap --picture p.jpg
"$perimap" session r.mcap --samples samples.mcap > out 2> error || fail "session"
grep -q '^Surfaces were good for' out && grep -q 'degraded\|invalid' samples.session.html || fail "session tells nothing"
ends 1 "--html: none/x.html: cannot be written" "$perimap" session samples.mcap --html none/x.html
ls | grep -q '\.part' && fail "left behind: $(ls)"

"$perimap" emulate --help > help 2> error || fail "emulate --help"
if LC_ALL=C grep -nE '[^[:print:][:space:]]' help; then fail "control bytes in a help"; fi
grep -q 'ndi-newest.*bx,bx2,tx' help || fail "the help of --ndi-newest does not name its words"
ends 2 "did you mean 'simulate'?" "$perimap" simualte x.mcap
ends 2 "device 'cytn': expected ndi, igtl, medlab, bitalino, cyton, can-ecg or camera, then =WHERE; did you mean 'cyton'?" \
  "$perimap" emulate cytn
echo "as promised"
