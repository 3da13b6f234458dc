# Read by ../make.sh: tables that a program prints.

of_statistics() {
  command="statistics --long $1"
  run "$statistics" --long "$1" | as_printed
}
make_lost() { of_statistics lost; }
make_optimal() { of_statistics optimal; }
make_breath() { of_statistics breath; }
make_harmonics() { of_statistics harmonics; }
make_drift() { of_statistics drift; }
make_pose() { of_statistics pose; }
make_ecg() { of_statistics ecg; }
of_statistics_ecg() {
  command="statistics_ecg $*"
  run "$build/tests/statistics/statistics_ecg" "$@" | as_printed
}
of_records() {
  [ -n "$records" ] || { echo "make.sh: --records names the folder of the records" >&2; return 1; }
  command="statistics_ecg $* --records FOLDER"
  run "$build/tests/statistics/statistics_ecg" "$@" --records "$records" | as_printed
}
# The seed was drawn after the detector was chosen.
make_ecg_made() { of_statistics_ecg made --draws 3000 --seed 2050050581; }
make_ecg_paced() { of_statistics_ecg paced --draws 200 --seed 2050050581; }
make_ecg_records() { of_records records peak-times ventricular prediction starts; }
make_ecg_disturbed() { of_records disturbed --seed 2050050581; }
make_ecg_two_leads() { of_records two-leads --seed 2050050581; }
make_horizons() { of_statistics horizons; }
make_late() { of_statistics late; }
make_ventilated() { of_statistics ventilated; }

make_setups() {
  command='statistics_setups --seed 3392693524 --trials 50 hand-eye slow scope camera whole few'
  # shellcheck disable=SC2086
  run "$build/tests/statistics/"$command | as_printed
}
make_setups_noise() {
  command='statistics_setups --seed 3734371284 --trials 200 tool tracker'
  # shellcheck disable=SC2086
  run "$build/tests/statistics/"$command | as_printed
}

make_watched_setups() {
  command='statistics_watched_setups 60'
  run "$build/tests/statistics/statistics_watched_setups" 60 | as_printed
}

make_update() {
  command='update_bench'
  run "$benches/update_bench" | as_printed
}
make_seeing() {
  command='vision_bench'
  run "$benches/vision_bench" | as_printed
}
make_latency() {
  command='perimap simulate --size 640x480 --fps 60 --duration 25 --tracker-noise 0; perimap bench'
  simulate latency --size 640x480 --fps 60 --duration 25 --tracker-noise 0 || return 1
  run "$perimap" bench "$work/latency.mcap" | as_printed
}
