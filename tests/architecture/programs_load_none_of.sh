#!/bin/bash
# programs_load_none_of.sh LIBRARY MODULE PROGRAM...: what LIBRARY (the beginning of its file's name) brings is loaded with
# the module, when that is asked for, and not with the programs.
library=$1
module=$2
shift 2
needs() { [[ $(ldd "$1") == *$library* ]]; }

if ! needs "$module"; then echo "$module was to need $library" >&2; exit 1; fi
for program in "$@"; do
  if needs "$program"; then echo "$program needs $library at every start" >&2; exit 1; fi
done
