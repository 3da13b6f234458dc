#!/bin/bash
# perimap track writes rows of the promised form over a recording's frames and over the video that it wrote itself, keeps
# most features with --no-new-features, and says in one line what is wrong.
# track_follows_a_recording.sh PERIMAP RECORDING WORK_FOLDER
set -uo pipefail
perimap=$1 recording=$2 work=$3
rm -rf "$work"
mkdir -p "$work"

fail() {
  echo "FAILED: $1"
  exit 1
}

"$perimap" track "$recording" --csv "$work/a.csv" --video "$work/a.mkv" --features 60 > "$work/out" 2> "$work/error" ||
  fail "ended with $?: $(cat "$work/error")"
[ "$(head -n 1 "$work/a.csv")" = frame,id,x,y,state ] || fail "header: $(head -n 1 "$work/a.csv")"
wrong=$(tail -n +2 "$work/a.csv" | grep -Evc '^[0-9]+,[0-9]+,[0-9]+\.[0-9]{3},[0-9]+\.[0-9]{3},(candidate|tracked)$')
[ "$wrong" -eq 0 ] || fail "$wrong rows of another form"
[ "$(tail -n +2 "$work/a.csv" | cut -d, -f1,2 | sort | uniq -d | wc -l)" -eq 0 ] || fail "two rows of one feature in a frame"
[ "$(wc -l < "$work/a.csv")" -gt 3000 ] || fail "only $(wc -l < "$work/a.csv") rows"

"$perimap" track "$recording" --csv "$work/again.csv" --features 60 > /dev/null 2>&1
cmp "$work/a.csv" "$work/again.csv" || fail "another result the second time"

"$perimap" track "$work/a.mkv" --csv "$work/video.csv" --features 60 > "$work/out" 2> "$work/error" ||
  fail "on a video: ended with $?: $(cat "$work/error")"
[ "$(tail -n 1 "$work/a.csv" | cut -d, -f1)" -eq "$(tail -n 1 "$work/video.csv" | cut -d, -f1)" ] ||
  fail "the video has not the recording's frames"

"$perimap" track "$recording" --csv "$work/b.csv" --features 60 --no-new-features > /dev/null 2> "$work/error" ||
  fail "without new features: ended with $?: $(cat "$work/error")"
first=$(tail -n +2 "$work/b.csv" | cut -d, -f2 | sort -u | wc -l)
last=$(tail -n +2 "$work/b.csv" | tail -n 1 | cut -d, -f1)
kept=$(grep -c "^$last," "$work/b.csv")
[ "$last" -ge 170 ] || fail "the last row is of frame $last"
[ $((3 * kept)) -ge "$first" ] || fail "$kept of $first features kept to the end"
[ "$(awk -F, 'NR > 1 && !seen[$2]++ && $1 > 0' "$work/b.csv" | wc -l)" -le $((first / 10)) ] ||
  fail "new features in spite of --no-new-features"

# exits WHAT CODE PATTERN COMMAND...
exits() {
  local what=$1 code=$2 pattern=$3
  shift 3
  "$@" > /dev/null 2> "$work/error"
  local status=$?
  [ $status -eq $code ] || fail "$what: ended with $status, not $code: $(cat "$work/error")"
  grep -Eq -- "$pattern" "$work/error" || fail "$what: $(cat "$work/error")"
}
exits "no such file" 1 "none.mp4: there is no such file" "$perimap" track "$work/none.mp4" --csv "$work/c.csv"
exits "folder" 1 "a folder or a device" "$perimap" track "$work" --csv "$work/c.csv"
exits "not a video" 1 "a.csv: not a video" "$perimap" track "$work/a.csv" --csv "$work/c.csv"
exits "unwritable table" 1 "c.csv: cannot be written" "$perimap" track "$work/a.mkv" --csv "$work/none/c.csv"
exits "unwritable video" 1 "c.mkv: cannot be written" "$perimap" track "$work/a.mkv" --csv "$work/c.csv" --video "$work/none/c.mkv"
exits "table over the input" 2 "--csv: is INPUT itself" "$perimap" track "$work/a.mkv" --csv "$work/../${work##*/}/a.mkv"
ln -s a.mkv "$work/link.mkv"
exits "video over the input" 2 "--video: is INPUT itself" "$perimap" track "$work/a.mkv" --csv "$work/c.csv" --video "$work/link.mkv"
exits "video over the table" 2 "--video: is the file of --csv" "$perimap" track "$work/a.mkv" --csv "$work/c.mkv" --video "$work/c.mkv"
exits "no table" 2 "--csv" "$perimap" track "$work/a.mkv"
exits "no features" 2 "--features" "$perimap" track "$work/a.mkv" --csv "$work/c.csv" --features 0

# A pipe or a device is written to, not put away.
mkfifo "$work/pipe"
cat "$work/pipe" > "$work/piped.csv" &
"$perimap" track "$recording" --csv "$work/pipe" --features 60 > /dev/null 2>&1 || fail "to a pipe: ended with $?"
wait
cmp "$work/a.csv" "$work/piped.csv" || fail "another result by a pipe"

# A disk that takes no more: nothing is called done. ThreadSanitizer writes into TMPDIR first, and does without where
# there is none.
(
  trap '' XFSZ
  ulimit -f 400
  TMPDIR=/nowhere "$perimap" track "$work/a.mkv" --csv "$work/c.csv" --video "$work/full.mkv" --features 20 > /dev/null 2> "$work/error"
)
[ $? -eq 1 ] && grep -q "full.mkv: was not written whole" "$work/error" || fail "a full disk: $(cat "$work/error")"

# A video that ends in the middle of a frame: what is whole is followed, and it says that something is missing.
head -c $(($(stat -c %s "$work/a.mkv") * 6 / 10)) "$work/a.mkv" > "$work/cut.mkv"
"$perimap" track "$work/cut.mkv" --csv "$work/cut.csv" --features 60 > /dev/null 2> "$work/error" ||
  fail "cut video: ended with $?: $(cat "$work/error")"
grep -q "cut.mkv: announces .* frames and ends before: it may have been cut off" "$work/error" || fail "nothing is said of the cut: $(cat "$work/error")"
[ "$(wc -l < "$work/cut.csv")" -gt 1000 ] || fail "only $(wc -l < "$work/cut.csv") rows of a cut video"
# So does a recording that was cut off.
head -c $(($(stat -c %s "$recording") * 6 / 10)) "$recording" > "$work/cut.mcap"
"$perimap" track "$work/cut.mcap" --csv "$work/cut.csv" --features 60 > /dev/null 2> "$work/error" ||
  fail "cut recording: ended with $?: $(cat "$work/error")"
grep -q "cut.mcap: byte .* cut off" "$work/error" || fail "nothing is said of the recording's cut: $(cat "$work/error")"
[ "$(wc -l < "$work/cut.csv")" -gt 1000 ] || fail "only $(wc -l < "$work/cut.csv") rows of a cut recording"
rm -f "$work"/*.mkv "$work/cut.mcap"
echo "as promised: $kept of $first features kept over $last frames"
