#!/usr/bin/env bash
# src/c/check.sh: the example in C comes to what the program comes to, and what is wrong is said; after cargo build --release -p signorini-c.
set -euo pipefail
cd "$(dirname "$0")/../.."
built=${CARGO_TARGET_DIR:-target}/release
place=$(mktemp -d)
trap 'rm -rf "$place"' EXIT
"${CC:-cc}" -std=c99 -Wall -Wextra -Werror -pedantic src/c/examples/motion.c -I src/c -L "$built" -lsignorini_c -lm "-Wl,-rpath,$(cd "$built" && pwd)" -o "$place/motion"
"$place/motion" scenarios/plate.toml "$place/c.h5" >"$place/c"
"$built/signorini" run scenarios/plate.toml -q --json -o "$place/own.h5" >"$place/own"
python3 - "$place" <<'PYTHON'
import json, sys
said = open(f"{sys.argv[1]}/c").read()
own = json.load(open(f"{sys.argv[1]}/own"))
first = own["switches"][0]["t"]
assert f"{len(own['switches'])} switches, the first at {first!r}," in said or f"the first at {first:.17g}," in said, (said, first)
assert f"until {own['t_end']:.17g}" in said, said
print(said, end="")
PYTHON
# what is wrong is said, with the code of the terminal
code=0
"$place/motion" nowhere.toml "$place/x.h5" 2>"$place/error" || code=$?
[ "$code" = 2 ] && grep -q nowhere.toml "$place/error"
sed 's|trajectory/pressure|trajectory/nothing|' src/c/examples/motion.c >"$place/wrong.c"
"${CC:-cc}" "$place/wrong.c" -I src/c -L "$built" -lsignorini_c -lm "-Wl,-rpath,$(cd "$built" && pwd)" -o "$place/wrong"
code=0
"$place/wrong" scenarios/bar.toml "$place/b.h5" 2>"$place/error" >/dev/null || code=$?
[ "$code" = 1 ] && grep -q nothing "$place/error"
