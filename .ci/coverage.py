"""How much of the code the tests run through: `make coverage`.

    python3 .ci/coverage.py     builds the tests and the program with counters, runs the default suite, writes docs/reference/coverage.md

Lines of the program and of the core, by room (a folder of `src`); lines of tests are not counted. Only our own crates
count. The tools are those of the compiler's own LLVM (`rustup component add llvm-tools`).
"""

import json
import os
import re
import shutil
import subprocess
import sys
from pathlib import Path

ROOT = Path(__file__).parents[1]
PAGE = ROOT / "docs/reference/coverage.md"
TARGET = Path(os.environ.get("CARGO_TARGET_DIR", ROOT / "target"))
FOLDER = TARGET / "coverage"
TESTS = ["cargo", "test", "--release", "--locked", "--workspace", "--lib", "--bins", "--tests"]
HEAD = """# Coverage

How much of the code the tests run through (`make coverage`, half an hour): lines of each room that some test of the
default suite executed, the lines of tests themselves left out; what is derived (arguments of commands, tables of keys)
counts on the lines that it is derived from. A line that is run is not a line that is checked: what
numbers are held against is told in [validation](validation.md).

| room | lines | run through | |
| --- | ---: | ---: | --- |
"""


def tools() -> Path:
    root = subprocess.run(["rustc", "--print", "sysroot"], capture_output=True, text=True, check=True).stdout.strip()
    found = list(Path(root).glob("lib/rustlib/*/bin/llvm-profdata"))
    if not found:
        raise SystemExit("no llvm-profdata beside the compiler: rustup component add llvm-tools")
    return found[0].parent


def lines_of(export: dict) -> dict[Path, dict[int, int]]:
    """Of each file of `src` how often each line was run: the most of all that tells of it."""
    counted: dict[Path, dict[int, int]] = {}
    for file in export["data"][0]["files"]:
        path = Path(file["filename"])
        if not path.is_relative_to(ROOT / "src") or "examples" in path.parts:
            continue
        own: dict[int, int] = {}
        segments = file["segments"]
        for (line, _, count, has, _, gap), (end, *_) in zip(segments, [*segments[1:], [segments[-1][0]]]):
            if not has or gap:
                continue
            for k in range(line, max(end, line + 1)):
                own[k] = max(own.get(k, 0), count)
        counted[path.relative_to(ROOT)] = own
    return counted


def without_tests(path: Path, own: dict[int, int]) -> dict[int, int]:
    text = (ROOT / path).read_text().splitlines()
    begin = next((k for k, line in enumerate(text, 1) if re.match(r"#\[cfg\((all\()?test", line)), len(text) + 1)
    says = [None, *text]
    return {k: n for k, n in own.items() if k < begin and k < len(says) and says[k].strip() not in ("", "}", "};")}


def room(path: Path) -> str:
    parts = path.parts[1:]
    depth = 2 if parts[0] == "core" else 1
    return "/".join(["src", *parts[: depth if len(parts) > depth else len(parts) - 1]])


def measured() -> list[Path]:
    """Run the suite; the programs that wrote profiles."""
    shutil.rmtree(FOLDER, ignore_errors=True)
    FOLDER.mkdir(parents=True)
    # of the crates of this workspace alone
    wrapper = FOLDER / "rustc.sh"
    wrapper.write_text('#!/bin/sh\nexec "$@" -C instrument-coverage\n')
    wrapper.chmod(0o755)
    env = {**os.environ, "RUSTC_WORKSPACE_WRAPPER": str(wrapper), "LLVM_PROFILE_FILE": f"{FOLDER}/%4m.profraw"}
    build = subprocess.run([*TESTS, "--no-run", "--message-format=json"], cwd=ROOT, env=env, stdout=subprocess.PIPE, text=True, check=True)
    said = [json.loads(line) for line in build.stdout.splitlines() if line.startswith("{")]
    programs = {Path(m["executable"]) for m in said if m.get("executable")}
    subprocess.run(TESTS, cwd=ROOT, env=env, check=True)
    return sorted(programs)


def main() -> int:
    own = tools()
    binaries = measured()
    profile = FOLDER / "all.profdata"
    raw = FOLDER / "list.txt"
    raw.write_text("\n".join(str(p) for p in FOLDER.glob("*.profraw")) + "\n")
    subprocess.run([own / "llvm-profdata", "merge", "-sparse", "--failure-mode=all", "-f", raw, "-o", profile], check=True)
    objects = [word for binary in binaries[1:] for word in ("-object", binary)]
    command = [own / "llvm-cov", "export", "-skip-functions", "-instr-profile", profile, binaries[0], *objects]
    export = json.loads(subprocess.run(command, capture_output=True, check=True).stdout)
    rooms: dict[str, list[int]] = {}
    for path, lines in lines_of(export).items():
        kept = without_tests(path, lines)
        sum_of = rooms.setdefault(room(path), [0, 0])
        sum_of[0] += len(kept)
        sum_of[1] += sum(n > 0 for n in kept.values())
    if not rooms:
        raise SystemExit(f"no file of {ROOT / 'src'} in the profiles")

    def row(name: str, lines: int, run: int) -> str:
        share = run / max(lines, 1)
        return f"| {name} | {lines} | {100 * share:.1f} % | {'█' * round(20 * share)} |"

    ordered = sorted(rooms.items())
    every = [sum(r[k] for r in rooms.values()) for k in (0, 1)]
    rows = [row(f"`{name}`", *counts) for name, counts in ordered] + [row("**all**", *every)]
    PAGE.write_text(HEAD + "\n".join(rows) + "\n")
    print("\n".join(rows[-1:]))
    return 0


sys.exit(main())
