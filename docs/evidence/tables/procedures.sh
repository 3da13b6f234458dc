# Read by ../make.sh: procedures, and what they are scored by.

# of_procedure NAME WHAT: from the words of $work/NAME.txt.
of_procedure() {
  local pattern
  case $2 in
    available) pattern='s/^procedure  *availability \([0-9.]*\) % of .*/\1/p' ;;
    seen) pattern='s/^procedure  *availability .* of \([0-9]*\) s in which.*/\1/p' ;;
    alarms) pattern='s/^ *\([0-9]*\) false alarms in .*/\1/p' ;;
    scored) pattern='s/^ *[0-9]* false alarms in \([0-9]*\) s .*/\1/p' ;;
    wrong) pattern='s/.* wrong while good \([0-9.]*\) s (.*/\1/p' ;;
    unknowable) pattern='s/.* wrong while good [0-9.]* s (\([0-9.]*\) s of them.*/\1/p' ;;
    causes) pattern='s/^ *causes \(.*\) right;.*/\1/p' ;;
    again) pattern='s/^ *causes .*; \(.*\) events good again.*/\1/p' ;;
    worst) pattern='s/^ *worst ten seconds from \([0-9]*\) s on: \([0-9.]*\) s wrong while good, largest error \([0-9.]*\) mm/\2 s, \3 mm (from \1 s)/p' ;;
  esac
  sed -n "$pattern" "$work/$1.txt" | head -n 1
}

# Seeds were drawn.
make_procedures() {
  command='perimap simulate --duration 300 --size 320x240 --fps 15 --tracker-dropouts 0 --procedure config/procedures/NAME.toml --seed SEED, and --procedure draw:SEED --electromagnetic --seed SEED; perimap replay --lockstep --json'
  echo '| procedure, seed | availability | false alarms | wrong while good | causes right | good again in time | worst ten seconds: wrong, largest error |'
  echo '|---|---|---|---|---|---|---|'
  local name seed stem script
  while read -r name seed; do
    stem=procedure-$name-$seed
    script=config/procedures/$name.toml
    if [ "$name" = drawn ]; then script="draw:$seed --electromagnetic"; fi
    if [ ! -e "$work/$stem.txt" ]; then
      # shellcheck disable=SC2086
      simulate "$stem" --duration 300 --size 320x240 --fps 15 --tracker-dropouts 0 --procedure $script --seed "$seed" || return 1
      replay_told "$stem" "$stem" <<< '' || return 1
      rm "$work/$stem.mcap"  # 350 MB
    fi
    echo "| $name, $seed | $(of_procedure "$stem" available) % of $(of_procedure "$stem" seen) s | $(of_procedure "$stem" alarms) | $(of_procedure "$stem" wrong) s | $(of_procedure "$stem" causes) | $(of_procedure "$stem" again) | $(of_procedure "$stem" worst) |"
    echo "$(of_procedure "$stem" available) $(of_procedure "$stem" seen) $(of_procedure "$stem" alarms) $(of_procedure "$stem" scored) $(of_procedure "$stem" wrong) $(of_procedure "$stem" causes) $(of_procedure "$stem" again)" |
      sed 's/none to judge/0 of 0/' >> "$work/procedures.sum"
  done << 'END'
valve 11982460
retracted 13194855
in_and_out 14100358
rhythm 13767589
tracker 1884746
drawn 13182629
drawn 13154176
drawn 8656301
drawn 8266783
drawn 2795289
END
  awk '{ share += $1 * $2; seen += $2; alarms += $3; scored += $4; wrong += $5; right += $6; judged += $8; again += $9; had += $11 }
    END { printf "| all | %.1f %% of %d s | %.1f an hour | %.0f s an hour | %d of %d | %d of %d | |\n", share / seen, seen,
      3600 * alarms / scored, 3600 * wrong / scored, right, judged, again, had }' "$work/procedures.sum"
  rm "$work/procedures.sum"
}
