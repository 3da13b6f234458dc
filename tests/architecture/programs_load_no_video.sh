#!/bin/bash
# programs_load_no_video.sh MODULE PROGRAM...: what OpenCV's videoio brings is loaded with the module, when a video is asked
# for, and not with the programs.
needs_video() { [[ $(ldd "$1") == *libopencv_videoio* ]]; }

if ! needs_video "$1"; then echo "$1 was to need it" >&2; exit 1; fi
shift
for program in "$@"; do
  if needs_video "$program"; then echo "$program needs it at every start" >&2; exit 1; fi
done
