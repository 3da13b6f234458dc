#!/bin/bash
# The pages that calibrate, register and verify wrote are opened in headless Chromium: no complaint on its console, every
# picture is drawn, and the figures of the JSON beside stand in the page.
# pages_open_in_a_browser.sh FOLDER WORK_FOLDER: FOLDER has pages NAME.html and what the same command printed, NAME.json.
# Exit code 77: skipped, with the reason on standard output.
set -uo pipefail
pages=$1 work=$2
. "$(dirname "$0")/../needed_programs.sh"
need_programs chromium node
rm -rf "$work"
mkdir -p "$work"

fail() {
  echo "FAILED: $1"
  exit 1
}
# The page says itself what it shows, in an element that only the copy has.
probe='<script>
addEventListener("load", () => {
  const drawn = [...document.querySelectorAll("svg")].map((svg) => {
    const marks = [...svg.querySelectorAll("path, line, circle, polyline, polygon, rect:not([width=\"100%\"])")];
    return {width: svg.getBoundingClientRect().width, height: svg.getBoundingClientRect().height,
            marks: marks.filter((mark) => { const box = mark.getBBox(); return box.width + box.height > 0; }).length};
  });
  const loaded = [...document.images].map((image) => image.complete && image.naturalWidth > 0);
  const told = document.createElement("script");
  told.type = "application/json";
  told.id = "shown";
  told.textContent = JSON.stringify({title: document.title, text: document.body.innerText, drawn, loaded});
  document.body.append(told);
});
</script>'
# A browser whose console says nothing of an error would let any page pass.
open() { # PAGE NAME
  timeout 120 chromium --headless --no-sandbox --disable-gpu --disable-dev-shm-usage --no-first-run \
    --user-data-dir="$work/profile" --enable-logging=stderr --virtual-time-budget=5000 --dump-dom "file://$1" \
    > "$work/$2.dom" 2> "$work/$2.log" || fail "$2: the browser ended with $?: $(tail -5 "$work/$2.log")"
}
printf '<!DOCTYPE html><title>x</title><script>console.error("told"); missing.call();</script>' > "$work/broken.html"
open "$work/broken.html" broken
[ "$(grep -c ':CONSOLE' "$work/broken.log")" -ge 2 ] || fail "the browser does not tell what is wrong with a page: $(cat "$work/broken.log")"

count=0
for page in "$pages"/*.html; do
  name=$(basename "$page" .html)
  [ -s "$pages/$name.json" ] || fail "$name: no JSON beside it"
  { cat "$page"; echo "$probe"; } > "$work/$name.html"
  open "$work/$name.html" "$name"
  if grep ':CONSOLE' "$work/$name.log"; then fail "$name: the browser complained"; fi
  node "$(dirname "$0")/page_shows.mjs" "$work/$name.dom" "$pages/$name.json" || fail "$name: $page"
  count=$((count + 1))
done
[ $count -ge 7 ] || fail "only $count pages in $pages"
echo "$count pages"
