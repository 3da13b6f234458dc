#!/bin/bash
# installed_core_is_found.sh BUILD_FOLDER SOURCE_FOLDER RECORD WORK_FOLDER: find_package(perimap) finds what is installed, and
# programs of others build with it and run.
set -uo pipefail
build=$1 source=$2 record=$3 work=$4
. "$(dirname "$0")/phase_of_record.sh"
fail() {
  echo "FAILED: $1"
  exit 1
}
here=$(cd "$(dirname "$0")" && pwd)
rm -rf "$work"
mkdir -p "$work"
DESTDIR=$work/root cmake --install "$build" > "$work/install" 2>&1 || fail "installation: $(tail -n 5 "$work/install")"
prefix=$(sed -n 's/^CMAKE_INSTALL_PREFIX:PATH=//p' "$build/CMakeCache.txt")

make() { # NAME SOURCE_FOLDER
  cmake -S "$2" -B "$work/$1" -DCMAKE_PREFIX_PATH="$work/root$prefix" -DCMAKE_CXX_FLAGS="-Wall -Wextra -Werror" \
    > "$work/$1.log" 2>&1 && cmake --build "$work/$1" >> "$work/$1.log" 2>&1 || fail "$1: $(tail -n 30 "$work/$1.log")"
}
make heart_phase "$source/deploy/examples/heart_phase"
cd "$work" && phase_of_record heart_phase/heart_phase "$record" || fail "the phases are wrong"
./heart_phase/heart_phase 2> error && fail "no rate is taken"
grep -q 'a rate from 100 to 1000 Hz is needed' error || fail "$(cat error)"

# All of core, with the libraries behind it; the install folder is all that it sees.
make everything "$here/everything"
"$work/everything/everything" || fail "everything ended with $?"
if grep -q "$source/" "$work/root$prefix/share/perimap/cmake"/*.cmake; then fail "what is installed names the source folder"; fi
