#!/bin/bash
# What a workstation needs for steady timing: shows it, and with --apply sets it.
set -uo pipefail
export LC_ALL=C

usage() {
  cat << 'END'
tune-realtime.sh [--cpus LIST] [--apply | --undo] [--root FOLDER]
  Shows kernel, real-time throttling, CPU governors, isolated CPUs, interrupt affinity, socket buffers and real-time
  limits, and what should be otherwise.
  --cpus LIST    the CPUs that perimapd's real-time threads are to have for themselves (realtime.cpus), as 2-3 or 2,5
  --apply        sets it, as root: governor and interrupts at once, isolated CPUs from the next boot on
  --undo         takes back what --apply has written; governor and interrupts come back with the next boot
  --root FOLDER  looks at and writes below FOLDER instead of / (for tests)
Exit code 0 when all is as it should be (or was set), 1 when something is not, 2 for a wrong command line.
END
}

cpus='' action=show root=''
while [ $# -gt 0 ]; do
  case $1 in
    --cpus | --root)
      if [ -z "${2:-}" ]; then
        echo "tune-realtime.sh: $1 needs a value" >&2
        exit 2
      fi
      declare "${1#--}=$2"
      shift
      ;;
    --apply | --undo) action=${1#--} ;;
    -h | --help)
      usage
      exit 0
      ;;
    *)
      echo "tune-realtime.sh: unknown option $1" >&2
      usage >&2
      exit 2
      ;;
  esac
  shift
done
if [ -n "$cpus" ] && ! [[ $cpus =~ ^[0-9]+(-[0-9]+)?(,[0-9]+(-[0-9]+)?)*$ ]]; then
  echo "tune-realtime.sh: --cpus needs a list of CPUs as 2-3 or 2,5, got '$cpus'" >&2
  exit 2
fi
if [ $action != show ] && [ -z "$root" ] && [ "$(id -u)" -ne 0 ]; then
  echo "tune-realtime.sh: --$action must be run by root" >&2
  exit 1
fi

sysctl_file=$root/etc/sysctl.d/60-perimap.conf
limits_file=$root/etc/security/limits.d/60-perimap.conf
grub_file=$root/etc/default/grub.d/60-perimap.cfg
receive_buffer=8388608 # of deploy/cyclonedds-loopback.xml

read_first() { [ -r "$1" ] && head -n 1 "$1"; }
wrong=0
say() { printf '  %-5s %-24s %s\n' "$1" "$2" "$3"; }
good() { say ok "$1" "$2"; }
bad() {
  say '--' "$1" "$2"
  wrong=1
}
told() { say '' "$1" "$2"; }

# "2-4,7" as one number a line
each_cpu() {
  local part
  for part in ${1//,/ }; do seq "${part%-*}" "${part#*-}"; done
}
# Whether a list has one of --cpus in it.
meets_cpus() { [ -n "$cpus" ] && [ -n "$1" ] && [ -n "$(comm -12 <(each_cpu "$1" | sort) <(each_cpu "$cpus" | sort))" ]; }
# All CPUs but --cpus, with commas.
other_cpus() {
  comm -23 <(each_cpu "$(read_first "$root/sys/devices/system/cpu/online")" | sort) <(each_cpu "$cpus" | sort) |
    sort -n | paste -sd,
}
interrupts() { for folder in "$root"/proc/irq/[0-9]*; do [ -d "$folder" ] && echo "$folder"; done; }

write() { # FILE TEXT
  mkdir -p "${1%/*}" && printf '%s\n' "$2" > "$1" || { echo "tune-realtime.sh: cannot write $1" >&2; return 1; }
}

if [ $action = undo ]; then
  rm -f "$sysctl_file" "$limits_file"
  if [ -e "$grub_file" ]; then
    rm -f "$grub_file"
    [ -n "$root" ] || update-grub || exit 1
  fi
  echo "Taken back. Governors and interrupts are as they were, isolated CPUs too, after the next boot."
  exit 0
fi

if [ $action = apply ]; then
  for governor in "$root"/sys/devices/system/cpu/cpu[0-9]*/cpufreq/scaling_governor; do
    [ ! -e "$governor" ] || write "$governor" performance || exit 1
  done
  write "$sysctl_file" "# a surface fits into the receive buffer (perimap)
net.core.rmem_max = $receive_buffer" || exit 1
  write "$root/proc/sys/net/core/rmem_max" $receive_buffer || exit 1
  # The service has limits of its own; these are for perimapd run by hand.
  write "$limits_file" "# members of the group perimap may run perimapd by hand
@perimap - rtprio 95
@perimap - memlock unlimited" || exit 1
  if [ -n "$cpus" ]; then
    others=$(other_cpus)
    if [ -z "$others" ]; then
      echo "tune-realtime.sh: --cpus $cpus leaves no CPU for anything else" >&2
      exit 2
    fi
    while read -r folder; do
      # Some interrupts belong to one CPU and can not be moved; the list below then says so.
      printf '%s\n' "$others" 2> /dev/null > "$folder/smp_affinity_list" || true
    done 2> /dev/null < <(interrupts)
    write "$grub_file" "# CPUs for perimapd's real-time threads alone
GRUB_CMDLINE_LINUX_DEFAULT=\"\$GRUB_CMDLINE_LINUX_DEFAULT isolcpus=managed_irq,domain,$cpus nohz_full=$cpus rcu_nocbs=$cpus irqaffinity=$others\"" || exit 1
    if [ -z "$root" ]; then
      if command -v update-grub > /dev/null; then
        update-grub || exit 1
      else
        echo "tune-realtime.sh: no update-grub here: give the kernel the parameters in $grub_file yourself" >&2
      fi
    fi
    echo "Set. CPUs $cpus are isolated from the next boot on; let perimapd use them: [realtime] cpus = [$(each_cpu "$cpus" | paste -sd,)]"
  fi
  wrong=0
fi

told kernel "$(uname -r)$([ "$(read_first "$root/sys/kernel/realtime")" = 1 ] && echo ', PREEMPT_RT' || echo ', not PREEMPT_RT')"
throttle=$(read_first "$root/proc/sys/kernel/sched_rt_runtime_us")
told 'real-time throttling' "${throttle:-unknown} us of each $(read_first "$root/proc/sys/kernel/sched_rt_period_us") us"
governors=$(cat "$root"/sys/devices/system/cpu/cpu[0-9]*/cpufreq/scaling_governor 2> /dev/null | sort -u | paste -sd' ')
case $governors in
  '') told governor 'none: this machine does not let it be chosen' ;;
  performance) good governor performance ;;
  *) bad governor "$governors; should be performance" ;;
esac
isolated=$(read_first "$root/sys/devices/system/cpu/isolated")
if [ -z "$cpus" ]; then
  told 'isolated CPUs' "${isolated:-none}; --cpus says which should be"
elif [ -n "$(comm -13 <(each_cpu "$isolated" | sort) <(each_cpu "$cpus" | sort))" ]; then
  bad 'isolated CPUs' "${isolated:-none}; should be $cpus$([ -e "$grub_file" ] && echo ', set from the next boot on')"
else
  good 'isolated CPUs' "$isolated"
fi
if [ -n "$cpus" ]; then
  disturbing=$(interrupts | while read -r folder; do
    if meets_cpus "$(read_first "$folder/effective_affinity_list" || read_first "$folder/smp_affinity_list")"; then echo "${folder##*/}"; fi
  done | paste -sd,)
  if [ -n "$disturbing" ]; then bad 'interrupt affinity' "interrupts $disturbing go to CPUs $cpus"; else good 'interrupt affinity' "none goes to CPUs $cpus"; fi
fi
buffer=$(read_first "$root/proc/sys/net/core/rmem_max")
if [ "${buffer:-0}" -ge $receive_buffer ]; then good 'net.core.rmem_max' "$buffer"; else bad 'net.core.rmem_max' "${buffer:-unknown}; should be $receive_buffer"; fi
if [ -e "$limits_file" ]; then good 'limits of group perimap' "$limits_file"; else bad 'limits of group perimap' "none for perimapd run by hand (the service has its own)"; fi

if [ $action = apply ] || [ $wrong -eq 0 ]; then exit 0; fi
echo "--apply sets what is marked --."
exit 1
