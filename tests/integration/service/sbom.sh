#!/bin/bash
# The software bill of materials that the package gets is whole SPDX 2.3, names each shared library that the programs
# need and what is compiled in, and comes out the same twice.
# sbom.sh BUILD_FOLDER SOURCE_FOLDER WORK_FOLDER COMPILER PROGRAM...
set -uo pipefail
build=$1 source=$2 work=$3 compiler=$4
shift 4
here=$(cd "$(dirname "$0")" && pwd)
for command in node dpkg-query ninja perl; do
  command -v $command > /dev/null || { echo "$command is not there: deploy/install-packages.sh"; exit 77; }
done

fail() {
  echo "FAILED: $1"
  exit 1
}
make_sbom() { # FILE [PROGRAM...]
  local file=$1
  shift
  SOURCE_DATE_EPOCH=1764201600 perl "$source/deploy/sbom/make_sbom.pl" --build "$build" --source "$source" \
    --version 1.2.3 --compiler "$compiler" --output "$file" "$@" 2>&1
}
rm -rf "$work"
mkdir -p "$work"
told=$(make_sbom "$work/sbom.json" "$@") || fail "$told"
found=$(node "$here/sbom_check.js" "$work/sbom.json" "$@") || fail "$found"
node "$here/sbom_check.js" --faults "$work/sbom.json" "$@" || fail "a fault in it is not told"

# What is compiled in: by headers, as a static library, as data; what built it.
related() { # KIND NAME
  node -e '
    const [file, kind, name] = process.argv.slice(1);
    const sbom = JSON.parse(require("fs").readFileSync(file, "utf8"));
    const named = sbom.packages.filter((p) => p.name.startsWith(name)).map((p) => p.SPDXID);
    const is = (r) => named.includes(r.relatedSpdxElement) || named.includes(r.spdxElementId);
    process.exit(sbom.relationships.some((r) => r.relationshipType === kind && is(r)) ? 0 : 1)' \
    "$work/sbom.json" "$1" "$2" || fail "$2 is not there as $1"
}
for name in libeigen3-dev libtomlplusplus-dev libcli11-dev; do related BUILD_DEPENDENCY_OF $name; done
related STATIC_LINK libceres-dev
related CONTAINS 'perimap data '
related BUILD_TOOL_OF cyclonedds-tools
# A library behind a library: those of videos are not the project's own choice, and have the most faults.
related DEPENDS_ON libswscale

make_sbom "$work/again.json" "$@" && cmp -s "$work/sbom.json" "$work/again.json" || fail "it is another the second time"
told=$(make_sbom "$work/none.json" "$work/none") && fail "one of nothing is made"
[[ $told == *"there is no $work/none"* ]] || fail "what is not there is not told: $told"
[ ! -e "$work/none.json" ] || fail "one of nothing is there"
echo "$(grep -c versionInfo "$work/sbom.json") packages, as promised"
