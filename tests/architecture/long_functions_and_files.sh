#!/bin/bash
# long_functions_and_files.sh ROOT [FILE...]: no function is longer than 100 lines and no file longer than 500, but those
# that say why: a function in a comment right above it, a file in one before its first line of code, that begins
# "// Long: ". Of scripts (.sh, .py, .mjs) the files are counted alone, and the first two begin it with "# Long: ". FILEs
# (below ROOT) are passed over. Reads the text as clang-format leaves it: a function's closing brace stands alone,
# indented as its head.
root=$1
shift
cd "$root" || exit 1
mapfile -t files < <(find . \( -name build -o -name .git \) -prune -o -type f \( -name '*.cpp' -o -name '*.hpp' -o -name '*.sh' \
  -o -name '*.py' -o -name '*.mjs' \) -print | sed 's|^\./||' | sort)
[ ${#files[@]} -gt 0 ] || { echo "no sources below $root" >&2; exit 1; }
kept=()
for file in "${files[@]}"; do
  for passed in "$@"; do [ "$file" = "$passed" ] && continue 2; done
  kept+=("$file")
done
[ ${#kept[@]} -gt 0 ] || { echo "no sources below $root but those that are passed over" >&2; exit 1; }
found=$(awk '
  function end_of_file() {
    if (lines > 500 && !file_reason) printf "%s: %d lines\n", file, lines
  }
  FNR == 1 {
    if (file != "") end_of_file()
    file = FILENAME; file_reason = 0; in_head = 1; reason = 0; ended = 1; raw = 0
    script = file ~ /\.(sh|py|mjs)$/
    delete opened
  }
  { lines = FNR }
  script {
    if (in_head && /^(#|\/\/) Long: /) file_reason = 1
    if (!/^(#|\/\/| *$)/) in_head = 0
    next
  }
  # Text that is no code.
  raw { if (index($0, ")" mark "\"")) raw = 0; next }
  match($0, /R"[A-Za-z_]*\(/) {
    mark = substr($0, RSTART + 2, RLENGTH - 3)
    if (!index(substr($0, RSTART + RLENGTH), ")" mark "\"")) { raw = 1; ended = 1; next }
  }
  /^ *\/\/ Long: / { reason = 1; if (in_head) file_reason = 1; ended = 1; next }
  /^ *\/\// { next }  # also in the middle of a statement
  /^ *$/ { ended = 1; reason = 0; next }
  /^#/ { ended = 1; next }
  {
    in_head = 0
    match($0, /^ */)
    indent = RLENGTH
    line = $0
    sub(/ *\/\/.*$/, "", line)
    if (line ~ /^ *\}[;),]*$/ || line ~ /^ *\} /) {
      if (line ~ /^ *\}$/ && (indent in opened)) {
        length_ = FNR - opened[indent] + 1
        if (length_ > 100 && !excused[indent]) printf "%s:%d: a function of %d lines\n", file, opened[indent], length_
      }
      delete opened[indent]
      ended = 1
      reason = 0
      next
    }
    if (ended) { head_indent = indent; head_line = FNR; head = line } else head = head " " line
    ended = line ~ /[;{}]$/ || line ~ /^ *(public|private|protected|case .*|default):$/
    if (line ~ /\{$/) {
      bare = head
      sub(/^ */, "", bare)
      if (bare ~ /\(/ && bare !~ /^(if|for|while|switch|do|else|catch|try|namespace|class|struct|enum|union|return)[^A-Za-z_0-9]/ &&
          bare !~ /= *\[|\[[^]]*\] *\([^()]*\)[^()]*\{$/) {
        opened[head_indent] = head_line
        excused[head_indent] = reason
      }
      reason = 0
    } else if (ended) {
      reason = 0
    }
  }
  END { end_of_file() }' "${kept[@]}")
if [ -n "$found" ]; then
  printf 'Longer than a function (100 lines) or a file (500) is without a reason at its head:\n%s\n' "$found" >&2
  exit 1
fi
