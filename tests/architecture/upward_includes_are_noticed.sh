#!/bin/bash
# no_upward_includes.sh notices each way of writing one, and accepts a sound file.
check=$(dirname "$0")/no_upward_includes.sh
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
failed=0
printf '#include "core/time/instant.hpp"\n// see ../time\n' > "$folder/sound.cpp"
"$check" "$folder" || { echo "a sound file was refused" >&2; failed=1; }
for line in '#include "../time/instant.hpp"' '  #  include <../x.hpp>' '#include "core/../drivers/x.hpp"'; do
  printf '%s\n' "$line" > "$folder/faulty.hpp"
  if "$check" "$folder" 2> /dev/null; then
    echo "not noticed: $line" >&2
    failed=1
  fi
done
exit $failed
