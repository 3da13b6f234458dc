#!/bin/bash
# perimapd on Debian's own kernels, with devices that this machine's kernel may not have: CAN (vcan), V4L2 (vivid), and
# under systemd. Each test boots a virtual machine (machine.sh) and runs a script of guest/ in there.
set -uo pipefail
cd "$(dirname "$0")/../.."

usage() {
  cat << 'END'
tests/vm/run.sh [--kernel amd64|rt-amd64]... [--build FOLDER] [TEST...]
  TEST      devices: ECG over CAN, frames from a V4L2 node, the tracker over a pseudo-terminal, under systemd
            drivers: an R trigger on a modem line, own frames out of a video output and in by a camera
            unplugged: the CAN interface, the camera and the R trigger's port are taken away 20 times
            service: the Debian package, its service, the watchdog
            all of them when none is named
  --kernel  Debian's stock kernel or its PREEMPT_RT kernel; both when not given, `devices` alone with the latter
  --build   whose programs run (build/release, which is built when it is missing)
Needs QEMU and 250 MB of kernels, which are downloaded once; no KVM. A run takes a few minutes. It only shows that things
work: an emulated processor says nothing about time.
Exit code 0 when all passed, 1 when one failed, 2 for a wrong command line, 77 when QEMU or another command is missing.
END
}

kernels=()
tests=()
build=build/release
while [ $# -gt 0 ]; do
  case $1 in
    --kernel)
      case ${2:-} in amd64 | rt-amd64) kernels+=("$2") ;; *) echo "run.sh: --kernel amd64 or rt-amd64" >&2; exit 2 ;; esac
      shift
      ;;
    --build)
      build=${2:-}
      shift
      ;;
    devices | drivers | unplugged | service) tests+=("$1") ;;
    -h | --help)
      usage
      exit 0
      ;;
    *)
      echo "run.sh: unknown argument $1" >&2
      usage >&2
      exit 2
      ;;
  esac
  shift
done
[ ${#kernels[@]} -gt 0 ] || kernels=(amd64 rt-amd64)
[ ${#tests[@]} -gt 0 ] || tests=(devices drivers unplugged service)

vm_guest=$PWD/tests/vm/guest
. tests/vm/machine.sh
missing=$(vm_missing | sort -u | tr '\n' ' ')
if [ -n "$missing" ]; then
  echo "SKIPPED: a virtual machine needs the packages: $missing(deploy/install-packages.sh --full installs them)"
  exit 77
fi

say() { printf '[%2d:%02d] %s\n' $((SECONDS / 60)) $((SECONDS % 60)) "$*"; }
if ! [ -x "$build/daemon/perimapd" ]; then
  say "building $build ..."
  cmake --preset release > /dev/null && cmake --build --preset release || exit 1
fi
build=$(realpath "$build")
folder=$PWD/build/vm
package=$folder/package
rm -rf "$package"
mkdir -p "$folder"
say "the Debian package ..."
if ! cpack --config "$build/CPackConfig.cmake" -B "$package" > "$folder/package.log" 2>&1; then
  tail -n 20 "$folder/package.log"
  exit 1
fi
rm -rf "$package/_CPack_Packages"

failures=()
for kernel in "${kernels[@]}"; do
  say "kernel $kernel ..."
  if ! vm_kernel "$kernel" "$folder" > "$folder/kernel.log" 2>&1 || ! vm_first_root "$folder"; then
    tail -n 20 "$folder/kernel.log"
    failures+=("kernel $kernel")
    continue
  fi
  for test in "${tests[@]}"; do
    if [ "$test" != devices ] && [ "$kernel" != amd64 ]; then continue; fi
    exchange=$folder/$test-$kernel
    rm -rf "$exchange"
    mkdir -p "$exchange"
    cp "$vm_guest"/{common.sh,trigger.sh,until_true.sh,camera.yaml} "$exchange/"
    # The guest has a /tmp of its own, and the build may lie in there.
    mkdir "$exchange/bin"
    cp "$build"/tests/vm/{hold_thread,same_frames,pulled_device} "$build/daemon/perimap" "$exchange/bin/"
    cp -r "$package" "$exchange/package"
    if [ "$test" = drivers ] && ! "$build/daemon/perimap" simulate "$exchange/played.mcap" --size 640x480 --fps 10 \
      --duration 20 --tracker-noise 0 > "$exchange/simulated" 2>&1; then
      cat "$exchange/simulated"
      failures+=("$test on $kernel")
      continue
    fi
    say "$test, $vm_release ..."
    if vm_run "$vm_guest/$test.sh" "$exchange" 900; then
      say "$test, $vm_release: passed"
    else
      failures+=("$test on $kernel")
      say "$test, $vm_release: FAILED"
      [ -e "$exchange/status" ] || tail -n 20 "$exchange/console" "$exchange/qemu"
    fi
    sed 's/^/    /' "$exchange/output" 2> /dev/null
  done
done

[ ${#failures[@]} -eq 0 ] && exit 0
say "FAILED: $(printf '%s; ' "${failures[@]}")"
exit 1
