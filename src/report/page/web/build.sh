#!/usr/bin/env bash
# Build ../page.js and the licences of what is in it, from pinned packages. `build.sh --check`: whether what is committed is what is built.
set -euo pipefail
cd "$(dirname "$0")"
npm ci --silent --no-fund --no-audit --ignore-scripts
out="$(mktemp -d)"
trap 'rm -rf "$out"' EXIT
node_modules/.bin/esbuild src/main.js --bundle --minify --target=es2020 --format=iife --legal-comments=none --charset=utf8 --log-level=warning --metafile="$out/meta.json" --outfile="$out/page.js"
{
  echo "Built into this page:"
  # the packages that are in the bundle, by what esbuild says
  grep -o 'node_modules/[a-z0-9-]*/' "$out/meta.json" | sort -u | while read -r folder; do
    name="$(basename "$folder")"
    echo
    echo "$name $(grep -m1 '"version"' "$folder/package.json" | cut -d'"' -f4)"
    cat "$folder/LICENSE"
  done
} > "$out/LICENCES.txt"
if [ "${1:-}" = --check ]; then
  cmp "$out/page.js" ../page.js && cmp "$out/LICENCES.txt" LICENCES.txt || { echo "page.js is not what its sources give: run $0" >&2; exit 1; }
else
  cp "$out/page.js" ../page.js
  cp "$out/LICENCES.txt" LICENCES.txt
fi
