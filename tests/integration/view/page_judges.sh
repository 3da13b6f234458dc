#!/bin/bash
# The page's own rules of what may be trusted, in Node. Exit code 77: skipped, with the reason on standard output.
. "$(dirname "$0")/../needed_programs.sh"
need_programs node
exec node --test "$(dirname "$0")"/*_test.mjs
