#!/bin/bash
# The AppArmor profile allows each path, device and kind of socket that perimapd needs, and no rule of its own is there
# that nothing needs. What is needed is read from the unit, the example configurations, and the sources' own paths; what
# shared libraries open beside it is named here.
# apparmor_covers.sh PROFILE UNIT SOURCE_FOLDER
set -uo pipefail
profile=$1 unit=$2 source=$3

fail() {
  echo "FAILED: $1"
  exit 1
}

# ---- what is needed: "MODES<tab>PATH"
setting() { sed -n "s/^$1=//p" "$unit"; }
state=/var/lib/$(setting StateDirectory) run=/run/$(setting RuntimeDirectory)
# Whoever opens a serial line locks it, too.
serial=rw
! grep -rq 'flock(' "$source"/drivers/transport || serial=rwk
node_of() { # KIND OF DEVICE: its modes and place
  case $1 in
    ttyS | ttyUSB | ttyACM | rfcomm) printf '%s\t/dev/%s0\n' $serial "$1" ;;
    video4linux) printf 'rw\t/dev/video0\n' ;;
    *) echo "where the unit's devices of the kind $1 are, is not known here" ;;
  esac
}
needs_of_the_unit() {
  local program
  for program in $(setting 'Exec[A-Za-z]*' | cut -d ' ' -f 1); do printf 'mr\t%s\n' "$program"; done
  setting 'Exec[A-Za-z]*' | grep -oE ' /[^ ]+' | sed 's/^ /r\t/'
  setting Environment | sed -n 's|^CYCLONEDDS_URI=file://|r\t|p'
  local kind
  while read -r kind; do node_of "$kind"; done \
    < <(setting DeviceAllow | sed -n 's/^char-\([^ ]*\) rw$/\1/p')
  [ "$(setting Type)" != notify ] || printf 'w\t/run/systemd/notify\n'
  # As the program makes them there: daemon/process/service_folder.hpp, daemon/checkpoint/checkpoint_file.hpp,
  # daemon/black_box, which locks its folder.
  printf 'rw\t%s\n' "$state"/{checkpoint,checkpoint.part,perimap-20261127-100000.mcap}
  printf 'rw\t%s\n' "$state"/black-box/segment-00000001{,.part}
  printf 'rwk\t%s/\n' "$state/black-box"
  printf 'rw\t%s\n' "$run/control"
  printf 'r\t%s/\n' "$state"
  # A module that is loaded when it is needed: where it is installed, by drivers/video and deploy/CMakeLists.txt.
  grep -q '^set(module_dir lib/perimap)$' "$source/deploy/CMakeLists.txt" || echo "where modules are, is not known here"
  printf 'mr\t/usr/lib/perimap/libperimap_video.so\n'
}
# Names that udev makes stand for the nodes that they lead to, which is what AppArmor looks at.
resolved() { sed -e 's|/dev/v4l/by-id/.*|/dev/video0|' -e 's|/dev/serial/by-id/.*|/dev/ttyUSB0|'; }
needs_of_the_configurations() {
  local file value
  for file in "$source"/config/*.toml; do
    while read -r value; do
      case $value in
        # A pseudo-terminal of `perimap emulate`: the service has a /tmp of its own.
        /tmp/*) ;;
        /dev/tty* | /dev/serial/*) printf '%s\t%s\n' $serial "$(resolved <<< "$value")" ;;
        /dev/*) printf 'rw\t%s\n' "$(resolved <<< "$value")" ;;
        /*) printf 'rw\t%s\n' "$value" ;;
        # "from this file's folder"
        *) printf 'r\t/etc/perimap/%s\n' "$value" ;;
      esac
    done < <(sed -nE 's/^(# )?[a-zA-Z_]+ = "(v4l2:)?([^":]*[/.][a-z0-9A-Z-]+)"$/\3/p' "$file")
  done
}
# Whole paths in what perimapd is made of; a folder that is only compared with, as "/proc/", ends with a slash.
needs_of_the_sources() {
  grep -rhoE '"/(dev|etc|proc|run|sys|usr|var)/[^" ]*[^"/ ]"' --include='*.cpp' --include='*.hpp' "$source"/core \
    "$source"/drivers "$source"/daemon/{black_box,checkpoint,config,control,dds,keys,logging,process,publishing,runtime} |
    tr -d '"' | sort -u | sed 's/^/r\t/'
}
# As strace shows of a run with keys, and a kernel with the profile: the C library's look-up of users, groups and hosts;
# Cyclone DDS; oneTBB's allocator; thread names.
needs_of_libraries() {
  printf 'r\t/etc/%s\n' nsswitch.conf passwd group hosts host.conf gai.conf resolv.conf services
  printf 'r\t/run/%s\n' systemd/resolve/stub-resolv.conf systemd/resolve/resolv.conf NetworkManager/resolv.conf \
    resolvconf/resolv.conf connman/resolv.conf
  printf 'r\t%s\n' /proc/12/net/wireless /proc/12/cmdline /proc/sys/vm/nr_hugepages \
    /sys/kernel/mm/transparent_hugepage/enabled
  printf 'rw\t/proc/12/task/13/comm\n'
}
needs=$(needs_of_the_unit; needs_of_the_configurations; needs_of_the_sources; needs_of_libraries)
for each in unit configurations sources; do
  [ "$("needs_of_the_$each" | wc -l)" -gt 0 ] || fail "no needs were found in the $each"
done

# AF_UNIX is in the abstractions.
families=$(setting RestrictAddressFamilies | sed -e 's/AF_UNIX//' -e 's/AF_//g' | tr '[:upper:]' '[:lower:]')

# Prints what the profile lacks, and which of its own rules nothing needs; what it includes is not looked at.
faults_of() { # PROFILE
  awk -v families="$families" '
    function expression(path) {
      gsub(/[.+]/, "\\\\&", path)
      gsub(/@{run}/, "/run", path)
      gsub(/@{PROC}/, "/proc", path)
      gsub(/@{sys}/, "/sys", path)
      gsub(/@{[pt]id}/, "[0-9]+", path)
      gsub(/{/, "(", path)
      gsub(/}/, ")", path)
      gsub(/,/, "|", path)
      gsub(/\*\*/, "\001", path)
      gsub(/\*/, "[^/]*", path)
      gsub(/\001/, ".+", path)
      return "^" path "$"
    }
    FNR == NR { needed[++needs] = $2; modes[needs] = $1; next }
    $1 == "owner" { sub(/owner /, "") }
    /^  network [a-z0-9]+ [a-z]+,$/ { given[$2] = 1 }
    /^  [\/@][^ ]* [a-z]+,$/ {
      if ($1 ~ /{,/) print "an alternative that is empty means to one awk what it does not to another: " $1
      used = ""
      for (n = 1; n <= needs; n++) {
        if (needed[n] !~ expression($1)) continue
        allowed[n] = allowed[n] $2
        used = used modes[n]
      }
      for (i = 1; i < length($2); i++) {
        if (!index(used, substr($2, i, 1))) print "nothing needs: " $1 " " substr($2, i, 1)
      }
    }
    END {
      for (n = 1; n <= needs; n++) {
        for (i = 1; i <= length(modes[n]); i++) {
          if (!index(allowed[n], substr(modes[n], i, 1))) print "it lacks: " needed[n] " " substr(modes[n], i, 1)
        }
      }
      for (i = split(families, wanted, " "); i > 0; i--) {
        if (!(wanted[i] in given)) print "it lacks: network " wanted[i]
        delete given[wanted[i]]
      }
      for (family in given) print "nothing needs: network " family
    }' <(echo "$needs") "$1"
}

found=$(faults_of "$profile")
[ -z "$found" ] || fail "$found"

# Each of its rules is missed when it is not there, and one too many is noticed.
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
mapfile -t lines < <(grep -nE '^  (owner )?[/@][^ ]* [a-z]*,$' "$profile" | cut -d : -f 1)
[ ${#lines[@]} -gt 10 ] || fail "it has ${#lines[@]} rules"
for line in "${lines[@]}"; do
  sed "${line}d" "$profile" > "$work/profile"
  [ -n "$(faults_of "$work/profile")" ] || fail "it is the same without line $line: $(sed -n "${line}p" "$profile")"
done
sed '/^  network can /d' "$profile" > "$work/profile"
[ "$(faults_of "$work/profile")" = "it lacks: network can" ] || fail "it is the same without CAN"
sed 's|^  network can raw,|&\n  /home/** r,|' "$profile" > "$work/profile"
[ "$(faults_of "$work/profile")" = "nothing needs: /home/** r" ] || fail "a rule for /home is not noticed"
sed 's|^  /dev/ttyUSB.* rwk,|  /dev/ttyUSB[0-9]* rw,|' "$profile" > "$work/profile"
faults_of "$work/profile" | grep -q "it lacks: /dev/ttyUSB0 k" || fail "that a line is locked is not noticed"
sed 's|^  /dev/video.* rw,|  /dev/video[0-9]* rwm,|' "$profile" > "$work/profile"
[ "$(faults_of "$work/profile")" = "nothing needs: /dev/video[0-9]* m" ] || fail "a mode too many is not noticed"
echo "$(wc -l <<< "$needs") paths are allowed by ${#lines[@]} rules of which each is needed"
