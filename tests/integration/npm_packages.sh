# To be sourced.
. "$(dirname "${BASH_SOURCE[0]}")/needed_programs.sh"

# from_npm ARGUMENT...: npm, which is not waited for long. Where it fails since the registry cannot be reached, ends with
# exit code 77 and the reason on standard output.
from_npm() {
  npm "$@" --fetch-retries=1 && return
  if ! npm ping --fetch-retries=0 --fetch-timeout=30000 > /dev/null 2>&1; then
    echo "SKIPPED: the npm registry cannot be reached"
    exit 77
  fi
  exit 1
}

# npm_packages SOURCE_FOLDER WORK_FOLDER SCRIPT: the packages of SOURCE_FOLDER's package-lock.json, and the script, in
# WORK_FOLDER. Ends with exit code 77, and the reason on standard output, where that cannot be.
npm_packages() {
  need_programs node npm
  mkdir -p "$2"
  cp "$1/package.json" "$1/package-lock.json" "$1/$3" "$2"
  (
    cd "$2"
    if cmp -s package-lock.json installed-lock.json; then exit 0; fi
    from_npm ci --ignore-scripts --no-audit --no-fund --fetch-timeout=30000
    cp package-lock.json installed-lock.json
  ) || exit $?
}
