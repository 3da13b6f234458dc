#!/bin/bash
# json_takes_any_bytes.sh FOLDER...: paths, names and what devices say may be any bytes, and a JSON of them must not
# throw: every dump() says what stands in place of what is no UTF-8.
throwing() { grep -rnE '(\.|->)dump\(' --include=*.cpp --include=*.hpp "$@" | grep -v 'error_handler_t::replace'; }

planted=$(mktemp -d)
trap 'rm -rf "$planted"' EXIT
echo "return json.dump(2, ' ', false, nlohmann::json::error_handler_t::replace);" > "$planted/a.cpp"
if throwing "$planted"; then echo "a sound file was refused" >&2; exit 1; fi
echo 'return json.dump(2);' > "$planted/a.cpp"
if ! throwing "$planted" > /dev/null; then echo "a planted dump() was not noticed" >&2; exit 1; fi

if throwing "$@"; then
  echo "these throw at a path or a name that is no UTF-8" >&2
  exit 1
fi
