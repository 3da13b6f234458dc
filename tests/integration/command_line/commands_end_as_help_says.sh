#!/bin/bash
# Every command ends with 1 when it failed and with 2 when options or configuration are wrong, as `perimap --help` says, and
# each line that it writes to standard error, progress too, begins with its name.
#   commands_end_as_help_says.sh PERIMAP PERIMAPD RECORDING WORK_FOLDER
set -uo pipefail
perimap=$1 perimapd=$2 recording=$3 work=$4
rm -rf "$work"
mkdir -p "$work"
cp "$recording" "$work/r.mcap" || exit 1
cd "$work" || exit 1

failed=0
fail() {
  echo "FAILED: $*"
  [ ! -f error ] || head -n 5 error
  failed=1
}

declare -A has_row
# ends CODE TEXT ARGUMENT...: with the text in one of the lines of standard error
ends() {
  local code=$1 text=$2 got
  shift 2
  has_row[$1]=1
  timeout 60 "$perimap" "$@" > out 2> error
  got=$?
  [ $got -eq "$code" ] || fail "'$*' ended with $got in place of $code"
  grep -qF -e "$text" error || fail "'$*' does not say: $text"
  if grep -vE "^perimap $1( [a-z0-9-]+)*: " error; then fail "'$*': a line without the command's name"; fi
}

printf 'version = 1\n[realtime]\nlock_memory = false\n' > good.toml
printf 'version = 1\n[phase]\nlaw = 3\n' > broken.toml
printf 'version = 1\n[tracker]\nprotocol = "igtl"\nport = "tcp:127.0.0.1:1"\n' > gone.toml
printf 'version = 1\n[camera]\ncalibration = "broken.toml"\n' > wrong_lens.toml
printf 'version = 1\n[tracker]\nprotocol = "ndi"\nport = "tcp:127.0.0.1:1"\nsensor = "0A"\nhand_eye_sensor = "0B"\n' > other_sensor.toml
printf 'name,x,y,z\na,0,0,0\nb,0,0,0.1\nc,0,0.1,0\n' > model.csv
size=(--square-mm 8)

# What runs, runs to its end, and tells how far it is.
ends 0 "100%" simulate s.mcap --duration 1 --size 160x120
ends 0 "100%" replay --lockstep r.mcap
ends 0 "100%" experiment 1 --trials 1
if script --version > /dev/null 2>&1; then
  script -qec "'$perimap' experiment 1 --trials 1" /dev/null < /dev/null > error 2>&1
  tr '\r' '\n' < error | grep -q '^perimap experiment: \[#*\] 100%' || fail "a terminal's bar has no name before it"
fi

# CODE TEXT ARGUMENT...
ends 2 "OUT is required" simulate
ends 2 "--tool: expected --scene heart" simulate x.mcap --scene board --tool
ends 2 "--zoom: expected --field-stop" simulate x.mcap --zoom 2
ends 2 "--shape-error: expected --preoperative" simulate x.mcap --shape-error 1
ends 2 "--model-phases: expected --preoperative" simulate x.mcap --model-phases 5
ends 2 "--model-phases: expected 1, or at least 3" simulate x.mcap --preoperative m --model-phases 2
ends 2 "--model-phases: expected at least 3" simulate x.mcap --preoperative m --model-shift 0.2
ends 2 "not in range" simulate x.mcap --preoperative m --model-phases 65
ends 1 "none/x.mcap" simulate none/x.mcap --duration 1 --size 160x120
ends 2 "key 'phase.law'" replay r.mcap -c broken.toml
ends 1 "nothing.mcap" replay nothing.mcap
ends 2 "--domain" watch --domain 999
ends 1 "none/x.mcap" watch --record none/x.mcap
ends 2 "--picture: expected" report r.mcap --samples r.mcap --picture p.jpg
ends 1 "nothing.mcap" session nothing.mcap
ends 1 "holds no published surface" session r.mcap
ends 1 "nothing.mcap" report nothing.mcap --samples nothing.mcap
ends 2 "a recording knows its rate" ecg r.mcap --rate 250
ends 1 "nothing.csv" ecg nothing.csv
ends 2 "key 'phase.law'" bench r.mcap -c broken.toml --only cost
ends 2 "--only" bench r.mcap --only nothing
ends 1 "nothing.mcap" bench nothing.mcap --only cost
ends 2 "needs a motion trace" experiment 3
ends 2 "before --from" experiment 3 --trace nothing.csv --from 20 --to 10
ends 1 "nothing.csv" experiment 3 --trace nothing.csv
ends 2 "--csv: is INPUT itself" track r.mcap --csv r.mcap
ends 1 "nothing.mp4" track nothing.mp4 --csv t.csv
ends 2 "VIDEO is required" judge
ends 1 "nothing.mp4" judge nothing.mp4
ends 2 "did you mean 'cyton'?" emulate cytn
ends 1 "nothing.mcap" emulate ndi --recording nothing.mcap
ends 2 "--tracker: expected PROTOCOL=PORT" setup --camera none --ecg none --tracker x --output new.toml
ends 1 "none/new.toml" setup --camera none --ecg none --tracker none --output none/new.toml
ends 2 "key 'phase.law'" probe broken.toml
ends 1 "" probe gone.toml --seconds 0.2
ends 2 "key 'phase.law'" record -c broken.toml o.mcap
ends 2 "names no device" record -c good.toml o.mcap
ends 1 "no device gave anything" record -c gone.toml o.mcap --seconds 0.3
ends 2 "key 'phase.law'" check broken.toml
ends 2 "key 'tracker.hand_eye_sensor'" check other_sensor.toml
ends 2 "--board: expected" calibrate target --pdf x.pdf --board circles
ends 1 "none/x.pdf" calibrate target --pdf none/x.pdf
ends 2 "expected pictures of a board" calibrate camera
ends 2 "--size: expected" calibrate camera nothing.png --size 9
ends 2 "key 'phase.law'" calibrate camera --live broken.toml
ends 2 "names neither a camera nor a tracker" calibrate camera --live good.toml
ends 2 "key 'phase.law'" calibrate camera nothing.png --output o.yaml --configuration broken.toml
ends 1 "nothing.png" calibrate camera nothing.png
ends 2 "expected --camera-poses" calibrate hand-eye
ends 2 "--square-mm: expected" calibrate hand-eye --from r.mcap
ends 2 "--size: expected" calibrate hand-eye --from r.mcap "${size[@]}" --size 9
ends 2 "the lens is not known" calibrate hand-eye --from r.mcap "${size[@]}"
ends 2 "broken.toml" calibrate hand-eye --from r.mcap "${size[@]}" --configuration wrong_lens.toml
ends 2 "key 'phase.law'" calibrate hand-eye --live broken.toml "${size[@]}"
ends 1 "nothing.yaml" calibrate hand-eye --from r.mcap "${size[@]}" --calibration nothing.yaml
ends 1 "nothing.csv" calibrate hand-eye --camera-poses nothing.csv --tracker-poses nothing.csv
ends 2 "takes two signals" calibrate time --signal nothing.csv
ends 2 "--square-mm: expected" calibrate time --from r.mcap
ends 1 "nothing.csv" calibrate time --signal nothing.csv --signal nothing.csv
ends 2 "expected pictures of the field stop" calibrate scope
ends 2 "--zoom: expected --at" calibrate scope --zoom nothing.png nothing.yaml
ends 2 "--configuration: expected --at" calibrate scope nothing.png --configuration good.toml
ends 1 "nothing.png" calibrate scope nothing.png
ends 2 "expected a file of poses" calibrate tool
ends 2 "key 'phase.law'" calibrate tool --live broken.toml
ends 2 "key 'phase.law'" calibrate tool nothing.csv --output o.json --configuration broken.toml
ends 2 "names no tool 'pointer'" calibrate tool --live gone.toml
ends 1 "nothing.csv" calibrate tool nothing.csv
ends 2 "expected a file of poses" calibrate tracker
ends 1 "nothing.csv" calibrate tracker nothing.csv
ends 1 "no device gave anything" calibrate tracker --live gone.toml --seconds 5
ends 2 "expected either touched landmarks" register --model model.csv
ends 2 "--tip: expected" register --model model.csv --from r.mcap
ends 2 "--tip: expected" register --model model.csv --live gone.toml
ends 2 "--live and --touched" register --model model.csv --touched model.csv --live gone.toml
ends 1 "nothing.csv" register --model nothing.csv --touched nothing.csv
ends 2 "model is required" refine
ends 2 "not in range" refine --model nothing.stl --from nothing.mcap --phase 2
ends 2 "key 'phase.law'" refine --model nothing.stl --from nothing.mcap --phase 0.5 --configuration broken.toml
ends 1 "nothing.stl" refine --model nothing.stl --from nothing.mcap --phase 0.5
ends 2 "expected a recording with --from" verify good.toml
ends 2 "--square-mm: expected" verify good.toml --from r.mcap
ends 2 "the lens is not known" verify good.toml --from r.mcap "${size[@]}"
ends 2 "key 'phase.law'" verify broken.toml --from r.mcap "${size[@]}" --calibration nothing.yaml
ends 2 "key 'phase.law'" verify broken.toml --from r.mcap "${size[@]}"
ends 1 "nothing.yaml" verify good.toml --from r.mcap "${size[@]}" --calibration nothing.yaml
ends 2 "--port" view --port 99999
ends 1 "192.0.2.1" view --port 0 --bind 192.0.2.1
ends 2 "A subcommand is required" bridge
ends 2 "--port" bridge igtl --port 99999
ends 1 "192.0.2.1" bridge igtl --port 0 --bind 192.0.2.1
ends 2 "expected one address of this host" bridge igtl --port 0 --bind 0.0.0.0
ends 2 "--port" bridge foxglove --port 99999
ends 1 "192.0.2.1" bridge foxglove --port 0 --bind 192.0.2.1
ends 2 "expected an origin" bridge foxglove --port 0 --allow-origin https://app.foxglove.dev/
ends 2 "expected an origin" bridge foxglove --port 0 --allow-origin null
ends 2 "--ros-domain" bridge ros2 --ros-domain 231
export ROS_DOMAIN_ID=7x
ends 2 "ROS_DOMAIN_ID: expected a number from 0 to 230" bridge ros2
unset ROS_DOMAIN_ID
ends 2 "OUT: is the recording itself" export-view r.mcap r.mcap
ends 1 "nothing.mcap" export-view nothing.mcap o.mcap
ends 2 "A subcommand is required" keys
ends 1 "nowhere" keys show --directory nowhere
ends 2 "--older-than" forget --older-than x .
ends 1 "nowhere" forget --older-than 30d nowhere
ends 1 "nowhere" verify-log nowhere
ends 1 "expected segments of a black box, found none" verify-log .
ends 2 "--digest: expected 64 hexadecimal digits" verify-log --digest abc .
ends 2 "LOG is required" verify-log
ends 2 "A subcommand is required" ctl
ends 1 "nowhere" ctl --socket nowhere status

for command in $("$perimap" --help | awk '/^Subcommands:/ { listed = 1; next } listed && /^  [a-z]/ { print $1 }'); do
  [ -n "${has_row[$command]:-}" ] || fail "perimap $command has no row here"
done
[ ${#has_row[@]} -ge 18 ] || fail "the commands are not read from the help"

# The daemon, and its log.
"$perimapd" -c broken.toml > out 2> error
[ $? -eq 2 ] || fail "perimapd: a broken configuration"
grep -q "^perimapd: .*key 'phase.law'" error || fail "perimapd does not say what is wrong"
printf 'version = 1\n[replay]\nrecording = "r.mcap"\n[dds]\ndomain = %d\n[realtime]\nlock_memory = false\n' $((20 + $$ % 100)) > replay.toml
timeout -s TERM 3 "$perimapd" -c replay.toml > out 2> error
grep -qE '^perimapd: [-0-9]+ [0-9:.]+ info: ' error || fail "the log's lines have no name"
if grep -v '^perimapd: ' error; then fail "perimapd: a line without its name"; fi
[ $failed -eq 0 ] && echo "as promised"
exit $failed
