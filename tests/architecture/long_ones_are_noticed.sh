#!/bin/bash
# long_functions_and_files.sh notices functions and files that are too long, and accepts those that say why.
check=$(dirname "$0")/long_functions_and_files.sh
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
failed=0

lines() { for ((i = 0; i < $1; ++i)); do printf '%s  work(%d);\n' "$2" "$i"; done; }
accept() {
  "$check" "$folder" 2> /dev/null || { echo "refused: $1" >&2; failed=1; }
}
refuse() {
  if "$check" "$folder" 2> /dev/null; then
    echo "not noticed: $1" >&2
    failed=1
  fi
}

{ echo 'void f() {'; lines 98; echo '}'; } > "$folder/x.cpp"
accept "a function of 100 lines"
{ echo 'void f() {'; lines 99; echo '}'; } > "$folder/x.cpp"
refuse "a function of 101 lines"
{ echo '// Long: a table.'; echo 'void f() {'; lines 99; echo '}'; } > "$folder/x.cpp"
accept "a long function that says why"
{ echo 'int a();'; echo '// Long: of another.'; echo 'void g() {'; echo '}'; echo 'void f() {'; lines 99; echo '}'; } > "$folder/x.cpp"
refuse "a long function after one that says why"
{ echo 'struct S {'; echo '  template <class T>'; echo '  void f(int a,'; echo '         int b) noexcept {'; lines 99 '  '; echo '  }'; echo '};'; } > "$folder/x.cpp"
refuse "a long member function"
{ echo 'TEST(A, B) {'; echo '  const auto g = [&] {'; lines 99 '  '; echo '  };'; echo '}'; } > "$folder/x.cpp"
refuse "a long test"
{ echo 'namespace {'; echo; lines 300 | sed 's/^ *work\(.*\);/int x\1;/'; echo '}'; } > "$folder/x.cpp"
accept "a long namespace"
{
  printf '%s\n' 'S::S()' '    : a_(1),' '      // Twice that.' '      b_(2) {' '  work();' '}' 'void f() {'
  lines 60
  printf '%s\n' '  const S s = {' '      1};' '}' 'void g() {'
  lines 60
  printf '%s\n' '  for (int i : {' '           1}) {' '      }' '}'
} > "$folder/x.cpp"
accept "a comment among the initializers of a short constructor"
{ echo 'int a;'; lines 500; } > "$folder/x.cpp"
refuse "a file of 501 lines"
{ echo '// A file.'; echo '// Long: for a reason.'; echo 'int a;'; lines 500; } > "$folder/x.cpp"
accept "a long file that says why"
rm "$folder/x.cpp"
for script in x.sh x.py; do
  { echo '#!/bin/sh'; echo '# A script.'; seq -f 'work %g' 499; } > "$folder/$script"
  refuse "a script of 501 lines"
  { echo '#!/bin/sh'; echo; echo '# Long: for a reason.'; seq -f 'work %g' 499; } > "$folder/$script"
  accept "a long script that says why"
  { echo 'work'; echo '# Long: too late.'; seq -f 'work %g' 499; } > "$folder/$script"
  refuse "a long script that says why after its first line"
  rm "$folder/$script"
done
seq -f 'work(%g);' 501 > "$folder/x.mjs"
refuse "a module of 501 lines"
{ echo '// Long: for a reason.'; seq -f 'work(%g);' 501; } > "$folder/x.mjs"
accept "a long module that says why"
rm "$folder/x.mjs"
{ echo 'int a;'; lines 500; } > "$folder/x.cpp"
"$check" "$folder" x.cpp 2> /dev/null && { echo "a folder without sources was accepted" >&2; failed=1; }
echo 'int b;' > "$folder/y.cpp"
"$check" "$folder" x.cpp 2> /dev/null || { echo "a file that is passed over was refused" >&2; failed=1; }
exit $failed
