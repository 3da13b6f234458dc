# To be sourced. need_programs PROGRAM...: ends with exit code 77, and the reason on standard output, where one of them
# is not installed.
need_programs() {
  local program
  for program in "$@"; do
    if ! command -v "$program" > /dev/null; then
      echo "SKIPPED: $program is not installed"
      exit 77
    fi
  done
}
