#!/usr/bin/env bash
# Damaged inputs led by coverage (libFuzzer, on stable Rust): fuzz/run.sh [SECONDS [READER…]], one reader after the other, on one processor at low priority.
# Seeds are the scenes, meshes, and what the program writes (seeds.py); what is found stays below fuzz/target. A failing input is told, and the exit code is 1.
set -euo pipefail
cd "$(dirname "$0")/.."
seconds=${1:-60}
shift $(($# > 0 ? 1 : 0))
readers=("$@")
[ $# -gt 0 ] || readers=(scene study msh mtx mat series history results journal)
bin=fuzz/target/release/signorini-fuzz
RUSTC_WRAPPER="$PWD/fuzz/rustc.sh" nice -n 19 cargo build --release --locked --manifest-path fuzz/Cargo.toml --target-dir fuzz/target
.venv/bin/python fuzz/seeds.py target/release/signorini fuzz/target/seeds
code=0
for reader in "${readers[@]}"; do
  work=fuzz/target/corpus/$reader
  mkdir -p "$work" "fuzz/target/seeds/$reader" "fuzz/target/crashes/$reader"
  words=(-max_total_time="$seconds" -timeout=10 -rss_limit_mb=2048 -malloc_limit_mb=1024 -max_len=150000 -print_final_stats=1 -verbosity=1)
  words+=(-artifact_prefix="fuzz/target/crashes/$reader/")
  [ ! -f "fuzz/target/seeds/$reader.dict" ] || words+=(-dict="fuzz/target/seeds/$reader.dict")
  READER=$reader nice -n 19 "$bin" "${words[@]}" "$work" "fuzz/target/seeds/$reader" >"fuzz/target/$reader.log" 2>&1 || code=1
  awk -v r="$reader" '/ cov: /{for(i=1;i<NF;i++)if($i=="cov:"){if(!a)a=$(i+1);b=$(i+1)}} /number_of_executed_units/{n=$2} /average_exec/{s=$2} /peak_rss/{m=$2} /^SUMMARY|Test unit written|panicked at/{print r": "$0}
    END{printf "%-8s %9d executions, %6d a second, edges %5d to %5d, %4d MB\n", r, n, s, a, b, m}' "fuzz/target/$reader.log"
done
exit $code
