# shellcheck shell=bash
# Steps of continuous integration; to be sourced. `step NAME COMMAND…` runs a command and takes its time; `skipped WHAT` tells and counts what is left out, as
# tests do through the file SIGNORINI_SKIPPED. Whatever ends the script, a table of times comes last, with what was left out; its exit code is that of what failed.
set -euo pipefail
SIGNORINI_SKIPPED=$(mktemp)
export SIGNORINI_SKIPPED
step_name='' step_begun=$SECONDS steps=()

step() {
  step_name=$1 step_begun=$SECONDS
  shift
  printf '\n=== %s\n' "$step_name"
  # not in a condition: there a function would go on behind what fails in it
  "$@"
  steps+=("$(printf '%5d s  %s' $((SECONDS - step_begun)) "$step_name")")
  step_name=''
}

skipped() {
  printf 'SKIPPED: %s\n' "$*"
  printf '%s\n' "$*" >>"$SIGNORINI_SKIPPED"
}

at_end() {
  local code=$?
  [ -z "$step_name" ] || steps+=("$(printf '%5d s  %s: FAILED (%d)' $((SECONDS - step_begun)) "$step_name" "$code")")
  printf '\n=== times\n'
  [ ${#steps[@]} = 0 ] || printf '%s\n' "${steps[@]}"
  printf '%5d s  in all\n' "$SECONDS"
  local left
  left=$(sort -u "$SIGNORINI_SKIPPED" | paste -sd '|' | sed 's/|/; /g')
  rm -f "$SIGNORINI_SKIPPED"
  printf 'skipped: %s\n' "${left:-nothing}"
  exit "$code"
}
trap at_end EXIT
trap 'exit 130' INT
trap 'exit 143' TERM
