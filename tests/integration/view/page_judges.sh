#!/bin/bash
# The page's own rules of what may be trusted, in Node. Exit code 77: skipped, with the reason on standard output.
if ! command -v node > /dev/null; then
  echo "SKIPPED: node is not installed"
  exit 77
fi
exec node --test "$(dirname "$0")"/*_test.mjs
