#!/bin/bash
# The Debian package is sound, installs, runs as the service's user, and leaves nothing behind but the configuration.
# package.sh BUILD_FOLDER RECORDING WORK_FOLDER
# The installation happens in an overlay over this system's files, which stay as they are; that needs root.
set -uo pipefail
build=$1 recording=$2 work=$3
[ "$(id -u)" -eq 0 ] || exit 77
command -v lintian > /dev/null || { echo "lintian is not there: deploy/install-packages.sh --full"; exit 77; }
if [ "${IN_NAMESPACE:-}" != yes ]; then IN_NAMESPACE=yes exec unshare --mount --pid --fork --propagation private "$0" "$@"; fi

fail() {
  echo "FAILED: $1"
  exit 1
}

rm -rf "$work"
mkdir -p "$work"
cpack --config "$build/CPackConfig.cmake" -B "$work/package" > "$work/cpack" 2>&1 || fail "$(tail "$work/cpack")"
package=$(echo "$work"/package/*.deb)
lintian --allow-root --fail-on error,warning "$package" || fail "lintian has found what is wrong (above)"

unit=$build/deploy/perimapd.service
score=$(systemd-analyze security --offline=yes --threshold=18 --no-pager "$unit" | tail -n 1) || fail "the sandbox leaks: $score"
echo "${score#* }"

root=$work/root
mkdir -p "$root"
mount -t tmpfs tmpfs "$root"
mkdir "$root"/{upper,overlay,system}
mount -t overlay overlay -o "lowerdir=/,upperdir=$root/upper,workdir=$root/overlay" "$root/system" || fail "no overlay"
mount -t proc proc "$root/system/proc"
mount --rbind /dev "$root/system/dev"
mount -t tmpfs tmpfs "$root/system/tmp"
chmod 1777 "$root/system/tmp"
cp "$package" "$recording" "$root/system/tmp"
# Made by root, a recording is for root alone.
chmod 644 "$root/system/tmp/$(basename "$recording")"
inside() { chroot "$root/system" "$@"; }
# What there is of perimap, dpkg's own notes left out.
left() { (cd "$root/upper" && find . -path ./tmp -prune -o \( -path '*perimap*' ! -type c \) -print | grep -v -e var/lib/dpkg/ -e var/log/); }

inside dpkg -i "/tmp/$(basename "$package")" > "$work/dpkg" 2>&1 || fail "installation: $(cat "$work/dpkg")"
[ -e "$root/system/lib/systemd/system/multi-user.target.wants/perimapd.service" ] ||
  [ -L "$root/system/etc/systemd/system/multi-user.target.wants/perimapd.service" ] || fail "the service is not enabled"
inside systemd-analyze verify --man=no /lib/systemd/system/perimapd.service > "$work/verify" 2>&1
[ ! -s "$work/verify" ] || fail "the unit: $(cat "$work/verify")"
[ -e "$root/system/etc/apparmor.d/local/perimapd" ] || fail "there is no place for additions to the AppArmor profile"

sbom=$root/system/usr/share/doc/perimap/perimap.spdx.json
if command -v node > /dev/null; then
  found=$(node "$(dirname "$0")/sbom_check.js" "$sbom" "$root"/system/usr/{bin/perimap,sbin/perimapd,lib/perimap/*.so}) ||
    fail "the software bill of materials: $found"
else
  [ -s "$sbom" ] || fail "there is no software bill of materials"
fi

printf 'version = 1\n[replay]\nrecording = "/tmp/%s"\n[dds]\ndomain = %d\n' "$(basename "$recording")" $((40 + RANDOM % 150)) \
  > "$root/system/etc/perimap/perimapd.toml"
# The module for videos is found where it was installed, and its absence is said.
no_video() { inside perimap track /etc/hostname --csv /tmp/tracks.csv 2>&1; }
[[ $(no_video) == *"/etc/hostname: not a video"* ]] || fail "videos: $(no_video)"
mv "$root/system/usr/lib/perimap" "$root/system/tmp/modules"
[[ $(no_video) == *"libperimap_video.so: cannot open"* ]] || fail "without the module for videos: $(no_video)"
mv "$root/system/tmp/modules" "$root/system/usr/lib/perimap"

inside setpriv --reuid perimap --regid perimap --init-groups perimap check /etc/perimap/perimapd.toml > /dev/null || fail "check"
inside env CYCLONEDDS_URI=file:///etc/perimap/cyclonedds-loopback.xml setpriv --reuid perimap --regid perimap --init-groups \
  perimapd -c /etc/perimap/perimapd.toml 2> "$work/log" || fail "perimapd: $(cat "$work/log")"
grep -Eq '[1-9][0-9]* surfaces' "$work/log" || fail "it did not publish: $(cat "$work/log")"

# As the service makes them, and one that an interrupted write has left.
mkdir -p "$root/system/var/lib/perimap"
touch "$root"/system/var/lib/perimap/checkpoint{,.part}
inside dpkg -r perimap > "$work/dpkg" 2>&1 || fail "removal: $(cat "$work/dpkg")"
# Whether the service is enabled is configuration too.
remaining=$(left | grep -v -e '^./etc/perimap' -e '^./etc/apparmor.d/' -e '^./etc/systemd/system/' -e '^./var/lib/systemd/deb-systemd-helper')
[ -z "$remaining" ] || fail "removal leaves: $remaining"
inside dpkg -P perimap > "$work/dpkg" 2>&1 || fail "purge: $(cat "$work/dpkg")"
remaining=$(left)
[ -z "$remaining" ] || fail "purge leaves: $remaining"
echo "as promised"
