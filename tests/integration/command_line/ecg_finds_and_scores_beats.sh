#!/bin/sh
# perimap ecg: beats of a table found and scored, and all that is printed of it; what is wrong is named, with the right
# exit code.
set -eu
perimap=$1
data=$2
recording=$3
fail() { echo "$1"; shift; cat "$@"; exit 1; }
# json_has FILE PIECE...: pieces of the JSON without its spaces; members are in the order of their names.
json_has() {
  file=$1
  shift
  for piece; do
    tr -d ' \n' < "$file" | grep -qF -e "$piece" || fail "$file: no $piece" "$file"
  done
}
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT

"$perimap" ecg "$data/100_60s.csv" --beats "$work/beats.csv" --reference "$data/100_60s_beats.csv" --json > "$work/score.json"
[ "$(head -n 1 "$work/beats.csv")" = time_s,class,confidence,detected_at_s ]
[ "$(tail -n +2 "$work/beats.csv" | wc -l)" -eq "$(tail -n +2 "$data/100_60s_beats.csv" | wc -l)" ]
grep -q '"f1_percent": 100.0' "$work/score.json"

# Classes, confidence and when it was known, in every row.
awk -F, 'NR > 1 && !(NF == 4 && $1 > last && $2 ~ /^(normal|premature|pause|noise)$/ && $3 > 0 && $3 <= 1 && $4 > $1 && $4 < $1 + 2) {
    print; wrong = 1 } NR > 1 { last = $1; if ($2 == "normal") ++normal } END { exit wrong || normal < 70 }' "$work/beats.csv" ||
  fail "rows that cannot be" "$work/beats.csv"
json_has "$work/score.json" '"beats":74,' '"input_damage":[]' '"sensitivity":{"hits":74,"of":74,"percent":100.0}' \
  '"positive_predictivity":{"hits":74,"of":74,"percent":100.0}' '"annotations_left_out":0,' '"missed_s":[]' '"extra_s":[]' \
  '"precision":{"hits":0,"of":0,"percent":null},"sensitivity":{"hits":0,"of":0,"percent":null}' \
  '"symbols":{"N":{"missed":0,"noise":0,"normal":74,"pause":0,"premature":0}}'
# number_in FILE MEMBER LEAST MOST, of the first of that name
number_in() {
  sed -n "s/^ *\"$2\": \(-\{0,1\}[0-9.][0-9.e-]*\),\{0,1\}$/\1/p" "$1" |
    awk -v least="$3" -v most="$4" 'NR == 1 { good = $1 >= least && $1 <= most } END { exit !good }' ||
    fail "$2 is not from $3 to $4" "$1"
}
number_in "$work/score.json" duration_s 59.9 60
number_in "$work/score.json" p95 60 200
number_in "$work/score.json" cycles 60 73
number_in "$work/score.json" previous_rms_ms 10 60
number_in "$work/score.json" mean_of_8_rms_ms 10 60
number_in "$work/score.json" autoregressive_rms_ms 5 40
number_in "$work/score.json" to_local_peak_rms 0 6
number_in "$work/score.json" rms 0 6

# The same as text; of record 119, which has premature beats, with their counts.
"$perimap" ecg "$data/119_60s.csv" --reference "$data/119_60s_beats.csv" > "$work/text"
for line in 'beats       [0-9]* in 60.0 s: [0-9]* normal, [0-9]* premature, [0-9]* after a pause, [0-9]* thought noise' \
  'delay       R peak to detection, median / 95 %: [0-9]* / [0-9]* ms' \
  'signal      unusable for 0.0 s, interrupted 0 times, without beats for [0-9.]* s, noisy for [0-9.]* s; rhythm unpredictable for [0-9.]* s' \
  'prediction  next cycle, RMS over [1-9][0-9]* normal cycles: previous [0-9.]*, mean of 8 [0-9.]*, autoregressive [0-9.]* ms' \
  'reference   sensitivity 100.00 % (\([0-9]*\) of \1), positive predictivity [0-9.]* % ([0-9]* of [0-9]*), F1 [0-9.]* %' \
  'timing      normal beats to the reference: median [-+][0-9.]* ms, RMS about it [0-9.]* ms; to the local peak: RMS [0-9.]* ms' \
  'premature   sensitivity [0-9.]* % ([1-9][0-9]* of [0-9]*), precision [0-9.]* % ([1-9][0-9]* of [0-9]*)' \
  '  V         normal [0-9]*, premature [1-9][0-9]*, pause 0, noise 0, missed 0'; do
  grep -q "^$line\$" "$work/text" || fail "no line as $line" "$work/text"
done

# The same by rate, from values alone in other units, and from tables in other shapes. Times then count from 0.
cut -d, -f2 "$data/100_60s.csv" > "$work/alone.csv"
tail -n +2 "$data/100_60s.csv" > "$work/no_heading.csv"
sed '1s/.*/Time,"Lead I",mV/; 2,$s/,/,7,/' "$data/100_60s.csv" > "$work/three.csv"
sed "1s/.*/'Elapsed time','MLII'\\
'seconds','mV'/; s/^\([0-9]\)/ \1/" "$data/100_60s.csv" > "$work/rdsamp.csv"
beats_by_rate() {
  "$perimap" ecg "$@" --rate 360 --beats "$work/by_rate.csv" > /dev/null
  awk -F, 'NR == FNR { t[FNR] = $1; class[FNR] = $2; next }
      FNR > 1 && ($1 - t[FNR] + 60) ^ 2 > 1e-6 || $2 != class[FNR] { wrong = 1 } END { exit wrong || FNR != 75 }' \
    "$work/beats.csv" "$work/by_rate.csv" || fail "other beats by rate: $*" "$work/by_rate.csv"
}
beats_by_rate "$work/alone.csv" --gain 0.001
beats_by_rate "$work/no_heading.csv" --column 2
beats_by_rate "$work/three.csv" --column 3
beats_by_rate "$data/100_60s.csv"
beats_by_rate "$work/rdsamp.csv"
for table in "$work/rdsamp.csv" "$work/no_heading.csv"; do
  "$perimap" ecg "$table" --beats "$work/by_time.csv" > /dev/null
  cmp "$work/beats.csv" "$work/by_time.csv" || fail "other beats of $table"
done
"$perimap" ecg "$work/three.csv" --column 3 --beats "$work/by_time.csv" > /dev/null
cmp "$work/beats.csv" "$work/by_time.csv" || fail "other beats by column"

# What there is nothing to tell from is no figure: no beats in a signal that has none; a reference without premature beats.
sed '2,$s/,.*/,0/' "$data/100_60s.csv" > "$work/flat.csv"
"$perimap" ecg "$work/flat.csv" --reference "$data/100_60s_beats.csv" --json > "$work/flat.json"
json_has "$work/flat.json" '"delay_ms":{"median":null,"p95":null}' '"f1_percent":0.0' \
  '"prediction":{"autoregressive_rms_ms":null,"cycles":0,"mean_of_8_rms_ms":null,"previous_rms_ms":null}' \
  '"sensitivity":{"hits":0,"of":74,"percent":0.0}' '"positive_predictivity":{"hits":0,"of":0,"percent":null}' \
  '"timing_ms":{"beats":0,"median":null,"rms":null,"to_local_peak_rms":null}'
"$perimap" ecg "$work/flat.csv" --reference "$data/100_60s_beats.csv" > "$work/text"
for line in 'delay .*: none' 'prediction  next cycle: none, .*' 'reference   sensitivity 0.00 % (0 of 74), positive predictivity none (0 of 0), F1 0.000 %' \
  'timing .*: none' 'premature   sensitivity none (0 of 0), precision none (0 of 0)'; do
  grep -q "^$line\$" "$work/text" || fail "no line as $line" "$work/text"
done

# Annotations that are no beats are not looked for; a table without a heading, or with spaces in it, has symbols too.
sed '1a 60.1,+,21636' "$data/100_60s_beats.csv" > "$work/rhythm.csv"
sed 1d "$work/rhythm.csv" > "$work/no_names.csv"
sed 's/,/ , /g' "$work/rhythm.csv" > "$work/spaced.csv"
for reference in rhythm no_names spaced; do
  "$perimap" ecg "$data/100_60s.csv" --reference "$work/$reference.csv" --json > "$work/score.json"
  json_has "$work/score.json" '"annotations_left_out":1,' '"sensitivity":{"hits":74,"of":74,"percent":100.0}' '"symbols":{"N":{"missed":0,'
  "$perimap" ecg "$data/100_60s.csv" --reference "$work/$reference.csv" > "$work/text"
  grep -q 'annotations in it that are no beats, left out: 1$' "$work/text" || fail "what was left out is not told" "$work/text"
done

# The ECG of a recording: 6 s of a regular heart.
"$perimap" ecg "$recording" --beats "$work/recorded.csv" --json > "$work/recorded.json"
beats=$(tail -n +2 "$work/recorded.csv" | wc -l)
[ "$beats" -ge 5 ] && [ "$beats" -le 9 ] || { echo "$beats beats in 6 s"; exit 1; }
grep -q '"unusable_s": 0.0' "$work/recorded.json"

# What is missing is said: twenty seconds of samples, and the beats of the last fifteen, which are noise.
awk -F, 'BEGIN { srand(1) } NR == 1 { print; next } NR == 2 { t0 = $1 }
  { t = $1 - t0 } t > 15 && t < 35 { next } t > 45 { $2 = 0.1 * (rand() - 0.5) } { print $1 "," $2 }' \
  "$data/100_60s.csv" > "$work/broken.csv"
"$perimap" ecg "$work/broken.csv" --beats "$work/broken_beats.csv" --json > "$work/broken.json"
json_has "$work/broken.json" '"interruptions":1,' '"unusable_s":20.' '"without_beats_s":1'

expect() {  # EXIT_CODE PATTERN ARGUMENT...
  code=$1 pattern=$2
  shift 2
  got=0
  "$perimap" ecg "$@" > "$work/out" 2>&1 || got=$?
  [ "$got" -eq "$code" ] && grep -q -e "$pattern" "$work/out" || { echo "perimap ecg $*: $got"; cat "$work/out"; exit 1; }
}
printf 'time_s,mV\n0,1\n0.1,x\n' > "$work/garbled.csv"
expect 1 'garbled.csv:3:5: expected a number' "$work/garbled.csv"
expect 1 'nothing.csv' "$work/nothing.csv"
expect 1 'say --rate' "$work/alone.csv"
expect 1 'no_heading.csv:1:1: 2 columns, and no heading that begins with a time: say by --column' "$work/no_heading.csv" --rate 360
expect 1 'three.csv:1:1: there is no column 4' "$work/three.csv" --column 4
expect 1 'three.csv:1:1: column 1 holds the time' "$work/three.csv" --column 1
expect 1 'alone.csv: 2000 samples a second; from 100 to 1000 are taken' "$work/alone.csv" --rate 2000
expect 1 'no WFDB\|nothing.hea' "$work/nothing.hea"
expect 1 'nothing.mcap' "$work/nothing.mcap"
expect 2 'knows its rate' "$recording" --rate 360
expect 2 'knows its rate' "$work/record.hea" --rate 360
expect 1 'reference' "$data/100_60s.csv" --reference "$work/nothing.csv"
expect 2 'rate' "$data/100_60s.csv" --rate fast
expect 2 'gain' "$data/100_60s.csv" --gain 0
expect 2 'INPUT' 
