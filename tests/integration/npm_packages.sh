# To be sourced. npm_packages SOURCE_FOLDER WORK_FOLDER SCRIPT: the packages of SOURCE_FOLDER's package-lock.json, and the
# script, in WORK_FOLDER. Ends with exit code 77, and the reason on standard output, where that cannot be.
npm_packages() {
  for needed in node npm; do
    if ! command -v $needed > /dev/null; then
      echo "SKIPPED: $needed is not installed"
      exit 77
    fi
  done
  mkdir -p "$2"
  cp "$1/package.json" "$1/package-lock.json" "$1/$3" "$2"
  (
    cd "$2"
    if cmp -s package-lock.json installed-lock.json; then exit 0; fi
    if ! npm ci --ignore-scripts --no-audit --no-fund --fetch-retries=1 --fetch-timeout=30000; then
      if ! npm ping --fetch-retries=0 --fetch-timeout=30000 > /dev/null 2>&1; then
        echo "SKIPPED: the npm registry cannot be reached"
        exit 77
      fi
      exit 1
    fi
    cp package-lock.json installed-lock.json
  ) || exit $?
}
