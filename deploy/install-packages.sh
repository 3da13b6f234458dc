#!/bin/bash
# Installs the Debian 12 packages that perimap needs, without questions, as root or through sudo.
set -euo pipefail
export LC_ALL=C.UTF-8

usage() {
  cat << 'END'
deploy/install-packages.sh [--build|--test|--full] [--list]
  --build  what perimap needs to be built and run (deploy/demo.sh)
  --test   and what its tests need (tests/run.sh); this is the default
  --full   and what tests/run.sh --full needs
  --list   only names the packages
When all of them are there already, it only says so.
END
}

# package, or package=command where another source of that command will do
build=(
  cmake ninja-build g++ pkg-config
  libeigen3-dev                              # core: linear algebra
  libexpected-dev                            # core: Expected<T>
  libboost-dev                               # core/realtime: lock-free rings
  libhwy-dev                                 # core/bank: portable SIMD with a choice at run time
  libopencv-core-dev libopencv-imgproc-dev   # core/vision
  libopencv-videoio-dev libopencv-imgcodecs-dev  # drivers/video: video files, pictures
  libavformat-dev                            # drivers/video: when the frames of a video are shown
  libopencv-calib3d-dev                      # daemon/setup: lenses, boards, other hand-eye solutions
  libopencv-contrib-dev                      # daemon/setup: ArUco and AprilTag markers, which OpenCV 4.6 has there alone
  libceres-dev                               # daemon/setup: least squares with derivatives and covariance
  libopencv-video-dev                        # daemon/evaluation/track_judge: Lucas-Kanade, that the tracker is held against
  libjpeg62-turbo-dev                        # drivers/image: MJPG cameras
  cyclonedds-dev cyclonedds-tools            # idl, daemon: DDS and its IDL compiler
  libfmt-dev
  libzstd-dev libdeflate-dev                 # drivers/recording: compression, check sums
  zlib1g-dev                                 # drivers/standins/simulator: its data
  libyaml-cpp-dev                            # drivers: calibration files
  libtomlplusplus-dev libcli11-dev libspdlog-dev nlohmann-json3-dev  # daemon
  libsystemd-dev                             # daemon/process: readiness, watchdog
  libopenigtlink-dev                         # daemon/bridge: OpenIGTLink; in the tests the peer of our own reader
  libssl-dev                                 # daemon/keys: certificates, signed documents
  librsvg2-dev fonts-dejavu-core             # daemon/evaluation/report: figures as PNG
  dpkg-dev                                   # deploy/debian: what the package depends on
)
tests=(
  libgtest-dev libgmock-dev
  clang-16 libclang-rt-16-dev                # AddressSanitizer, fuzzing
  nodejs=node npm=npm ca-certificates        # recordings are read back by the official npm packages
  chromium                                   # the pages that perimap shows and writes, opened
)
full=(
  clang-tidy clang-format
  qemu-system-x86 busybox-static cpio zstd kmod udev iproute2 v4l-utils  # tests/vm: CAN, V4L2 and systemd on Debian's own kernels
  fastddsgen libfastrtps-dev libfastcdr-dev  # another vendor's DDS reads what is published
  stress-ng                                  # perimap bench: latencies under load
  lintian systemd man-db apparmor            # the Debian package and its service, checked
)

wanted=test
list=no
for argument in "$@"; do
  case $argument in
    --build | --test | --full) wanted=${argument#--} ;;
    --list) list=yes ;;
    -h | --help)
      usage
      exit 0
      ;;
    *)
      echo "install-packages.sh: unknown option $argument" >&2
      usage >&2
      exit 2
      ;;
  esac
done

packages=("${build[@]}")
if [ "$wanted" != build ]; then packages+=("${tests[@]}"); fi
if [ "$wanted" = full ]; then packages+=("${full[@]}"); fi

if [ "$list" = yes ]; then
  printf '%s\n' "${packages[@]%%=*}"
  exit 0
fi

if ! command -v apt-get > /dev/null || ! command -v dpkg-query > /dev/null; then
  echo "install-packages.sh: this system has no apt-get; needed are: ${packages[*]%%=*}" >&2
  exit 1
fi

missing=()
for entry in "${packages[@]}"; do
  package=${entry%%=*}
  case $entry in
    *=*) if command -v "${entry#*=}" > /dev/null; then continue; fi ;;
  esac
  if [ "$(dpkg-query -W -f='${db:Status-Status}' "$package" 2> /dev/null)" != installed ]; then missing+=("$package"); fi
done

if [ ${#missing[@]} -eq 0 ]; then
  echo "Packages: all ${#packages[@]} are there."
  exit 0
fi

as_root=(env DEBIAN_FRONTEND=noninteractive LC_ALL=C.UTF-8)
if [ "$(id -u)" -ne 0 ]; then
  if ! command -v sudo > /dev/null; then
    echo "install-packages.sh: neither root nor sudo; let root run: apt-get install ${missing[*]}" >&2
    exit 1
  fi
  as_root=(sudo "${as_root[@]}")
fi

# Recommended packages would double the download. Another apt may hold the lock for a while (unattended upgrades).
options=(-q -y -o Acquire::Retries=3 -o DPkg::Lock::Timeout=300 -o Dpkg::Use-Pty=0)
log=$(mktemp)
trap 'rm -f "$log"' EXIT
run() {
  if ! "${as_root[@]}" apt-get "${options[@]}" "$@" > "$log" 2>&1 < /dev/null; then
    tail -n 30 "$log" >&2
    echo "install-packages.sh: apt-get $1 failed" >&2
    exit 1
  fi
}

started=$SECONDS
echo "Packages: installing ${#missing[@]} of ${#packages[@]} and what they depend on: ${missing[*]}"
run update
run install --no-install-recommends "${missing[@]}"
echo "Packages: installed in $((SECONDS - started)) s."
