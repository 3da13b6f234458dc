#!/bin/bash
# deploy/tune-realtime.sh on a made-up machine: shows what is wrong, sets it, then finds nothing wrong, and takes it back.
# tune_realtime.sh SCRIPT
set -uo pipefail
script=$1
root=$(mktemp -d)
trap 'rm -rf "$root"' EXIT

fail() {
  echo "FAILED: $1"
  exit 1
}
put() { mkdir -p "$root/${1%/*}" && echo "$2" > "$root/$1"; }
put sys/devices/system/cpu/online 0-3
put sys/devices/system/cpu/isolated ''
for cpu in 0 1 2 3; do put sys/devices/system/cpu/cpu$cpu/cpufreq/scaling_governor powersave; done
put proc/irq/7/smp_affinity_list 0-3
put proc/irq/12/smp_affinity_list 1
put proc/sys/net/core/rmem_max 212992
put proc/sys/kernel/sched_rt_runtime_us 950000
put proc/sys/kernel/sched_rt_period_us 1000000

before=$(find "$root" -type f -exec md5sum {} + | sort)
"$script" --root "$root" --cpus 2-3 > "$root.shown"
[ $? -eq 1 ] || fail "it finds nothing wrong"
mv "$root.shown" "$root/shown"
for word in governor 'isolated CPUs' 'interrupt affinity' rmem_max 'limits of group'; do
  grep -qE "^  -- +.*$word" "$root/shown" || fail "it does not mark $word: $(cat "$root/shown")"
done
grep -q 'interrupts 7 go' "$root/shown" || fail "the wrong interrupts: $(cat "$root/shown")"
rm "$root/shown"
[ "$before" = "$(find "$root" -type f -exec md5sum {} + | sort)" ] || fail "showing has changed something"

"$script" --root "$root" --cpus 2-3 --apply > /dev/null || fail "--apply ended with $?"
[ "$(cat "$root/proc/irq/7/smp_affinity_list")" = 0,1 ] || fail "interrupt 7: $(cat "$root/proc/irq/7/smp_affinity_list")"
[ "$(cat "$root/sys/devices/system/cpu/cpu3/cpufreq/scaling_governor")" = performance ] || fail "the governor"
grep -q 'isolcpus=managed_irq,domain,2-3 .*irqaffinity=0,1' "$root/etc/default/grub.d/60-perimap.cfg" || fail "the boot parameters"
grep -q '^@perimap - rtprio' "$root/etc/security/limits.d/60-perimap.conf" || fail "the limits"
put sys/devices/system/cpu/isolated 2-3 # as after the next boot
"$script" --root "$root" --cpus 2-3 > /dev/null || fail "after --apply something is wrong: $("$script" --root "$root" --cpus 2-3)"
"$script" --root "$root" --undo > /dev/null || fail "--undo ended with $?"
[ -z "$(find "$root/etc" -type f)" ] || fail "--undo leaves: $(find "$root/etc" -type f)"

for wrong in '--cpus two' '--cpus 2-' '--aply' '--root' '--root '"$root"' --cpus 0-3 --apply'; do
  # shellcheck disable=SC2086
  "$script" $wrong > /dev/null 2>&1
  status=$?
  [ $status -eq 2 ] || fail "'$wrong' ended with $status"
done
echo "as promised"
