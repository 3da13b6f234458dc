#!/bin/bash
# `perimap experiment`: what it writes is there and whole, the same seed gives the same figures, and errors are said in one
# line with their exit code.
#   experiment_writes_its_files.sh PERIMAP FOLDER
set -uo pipefail
perimap=$1
out=$2
rm -rf "$out"

fail() {
  echo "FAILED: $*" >&2
  exit 1
}

for number in 1 2; do
  for run in a b; do
    "$perimap" experiment $number --trials 2 --seed 7 --out "$out/$run" > "$out.table" 2> "$out.progress" ||
      fail "experiment $number: exit code $?"
  done
  [ "$(grep -cE '^(static EKF|EKF, Fourier|iterated|delayed|batch|Cramer-Rao)' "$out.table")" -eq 6 ] ||
    fail "experiment $number: not six methods in the table"
  grep -q '^perimap experiment: 100%' "$out.progress" || fail "experiment $number: no progress on standard error"
  for page in "$out/a/experiment-$number.html" "$out/a/experiment-$number.json" "$out/a/experiment-$number.csv"; do
    [ -s "$page" ] || fail "$page is missing"
  done
  grep -q '</svg>' "$out/a/experiment-$number.html" || fail "the page has no figure"
  if grep -oE '(src|href)=' "$out/a/experiment-$number.html"; then fail "the page refers to something outside"; fi
  pictures=0
  for picture in "$out/a/experiment-$number"-*.png; do
    [ "$(head -c 4 "$picture" | tail -c 3)" = PNG ] || fail "$picture is no PNG"
    pictures=$((pictures + 1))
  done
  [ $pictures -ge 2 ] || fail "experiment $number: $pictures pictures"
  for figures in "$out/a/experiment-$number"-*.csv; do
    cmp "$figures" "$out/b/$(basename "$figures")" || fail "the same seed gave other figures"
  done
  # All but the times, which stand last.
  cmp <(sed 's/,[^,]*$//' "$out/a/experiment-$number.csv") <(sed 's/,[^,]*$//' "$out/b/experiment-$number.csv") ||
    fail "the same seed gave another table"
done

expect() { # EXIT_CODE ARGUMENT...
  local code=$1
  shift
  "$perimap" experiment "$@" > /dev/null 2> "$out.error"
  local got=$?
  [ $got -eq "$code" ] || fail "'experiment $*' ended with $got in place of $code"
}
expect 2 4
expect 2 1 --trials 0
expect 2 1 --no-such-option
expect 2
touch "$out/file"
expect 1 1 --trials 1 --out "$out/file"
grep -q "^perimap experiment: .*$out/file" "$out.error" || fail "the error does not name the folder"
# Each file that it writes is tried before the trials, which would take hours.
for file in "$out"/a/experiment-[12]*; do
  number=${file#"$out"/a/experiment-} number=${number:0:1}
  rm "$file"
  mkdir "$file"
  timeout 20 "$perimap" experiment "$number" --trials 100000 --out "$out/a" > /dev/null 2> "$out.error"
  got=$?
  [ $got -eq 1 ] || fail "$file can not be written, and 'experiment $number' ended with $got"
  grep -qF "$file: cannot be written" "$out.error" || fail "the error does not name $file: $(cat "$out.error")"
  rmdir "$file"
  touch "$file"
done

# ---- recorded motion
awk 'BEGIN {
  print "t_s,P_x,P_y,P_z"
  for (i = 0; i < 340; ++i) {
    t = 0.04 * i
    printf "%.2f,%.4f,%.4f,%.4f\n", t, 2 * cos(7 * t) + 0.1 * cos(31 * i * i), sin(7 * t + 1) + cos(1.3 * t), 50 + cos(7 * t)
  }
}' > "$out/motion.csv"
awk 'BEGIN { for (t = 0.1; t < 13; t += 0.8976) printf "%.4f\n", t }' > "$out/r-peaks.txt"
"$perimap" experiment 3 --trace "$out/motion.csv" --r-peaks "$out/r-peaks.txt" --from 300 --to 320 --out "$out/motion" \
  > "$out.table" 2> "$out.progress" || fail "experiment 3: exit code $?: $(cat "$out.progress")"
for name in hold ar_point ar_all periodic ours; do
  grep -qE "^$name +P " "$out.table" || fail "experiment 3: no row $name of the point P: $(cat "$out.table")"
done
for ending in csv json html svg png; do
  [ -s "$out/motion/experiment-3.$ending" ] || fail "experiment-3.$ending is missing"
done
[ "$("$perimap" experiment 3 --trace "$out/motion.csv" --from 300 --to 301 --json 2> /dev/null | grep -c '"name": "ours"')" -eq 10 ] ||
  fail "experiment 3 --json: not five horizons of the point and of all"
expect 2 3 --out "$out/nowhere"
[ ! -e "$out/nowhere" ] || fail "a folder is made for an experiment that lacks its trace"
expect 2 3 --trace "$out/motion.csv" --from 320 --to 300
expect 1 3 --trace "$out/no-such-file"
expect 1 3 --trace "$out/r-peaks.txt"
expect 1 3 --trace "$out/motion.csv" --to 339
grep -q -- '--to' "$out.error" || fail "the error does not name --to: $(cat "$out.error")"
