#!/bin/bash
# json_takes_any_bytes.sh FOLDER...: paths, names and what devices say may be any bytes, and a JSON of them must not
# throw: drivers/json makes text of it, which says what stands in place of what is no UTF-8, and nothing else does.
throwing() { grep -rnE '(\.|->)dump\(' --include=*.cpp --include=*.hpp "$@" | grep -v 'drivers/json/json_text.hpp'; }

planted=$(mktemp -d)
trap 'rm -rf "$planted"' EXIT
mkdir -p "$planted/drivers/json"
echo 'return json.dump(2);' > "$planted/drivers/json/json_text.hpp"
if throwing "$planted"; then echo "the one place for it was refused" >&2; exit 1; fi
echo 'return json.dump(2);' > "$planted/a.cpp"
if ! throwing "$planted" > /dev/null; then echo "a planted dump() was not noticed" >&2; exit 1; fi

if throwing "$@"; then
  echo "use json_document() or json_line(): these throw at a path or a name that is no UTF-8" >&2
  exit 1
fi
