#!/bin/bash
# no_upward_includes.sh ROOT: no file includes by a path that climbs ("../").
found=$(cd "$1" && find . \( -name build -o -name .git -o -name node_modules \) -prune -o -type f \
  \( -name '*.[ch]' -o -name '*.[ch]pp' -o -name '*.in' -o -name '*.idl' \) -print0 |
  xargs -0 -r grep -nE '^[[:space:]]*#[[:space:]]*include[[:space:]]*["<]([^">]*/)?\.\./')
if [ -n "$found" ]; then
  printf 'These includes climb upward:\n%s\n' "$found" >&2
  exit 1
fi
