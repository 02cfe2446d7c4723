"""Instructions of whole commands, against those of the last release: what a change costs, on whatever machine.

    python3 .ci/counts.py BINARY             compare with validate/counts.toml; exit code 1: something takes more; 75: no valgrind here
    python3 .ci/counts.py BINARY --keep      write that table anew (with a release, a change that is worth its price, or another way to count)

Counted by valgrind's `callgrind` without its caches, which shows every machine the same processor (AVX2); memory is
handed out by the C library. Counts hang on the compiler, and a little on the processor (its caches, what its C library
copies with): both stand in the table, and with others they are told, and nothing fails. What writes the file is left
out: it does so every other second, more often on a slow machine.
"""

import re
import shutil
import subprocess
import sys
import tempfile
import tomllib
from pathlib import Path

ROOT = Path(__file__).parents[1]
TABLE = ROOT / "validate/counts.toml"
# what a count may differ by: hashes begin elsewhere in every process (2e-4 were seen)
LIMIT = 0.1

# the function that writes the file, which is not counted
WRITES = "signorini::store::writer::Writer::flush"

# the parts of the program that take the time, each on a small case: a scene with some keys changed (a minute in all, fifty times slower than without the
# counter), and a command for it
COMMANDS = {
    "plate, Dormand-Prince": ("plate", {"integrator": '"dop853"', "elements": "[8, 4]"}, "run"),
    "plate, modes": ("plate", {"integrator": '"modal"', "elements": "[8, 4]"}, "run"),
    "plate, Chebyshev": ("plate", {"integrator": '"chebyshev"', "elements": "[8, 4]"}, "run"),
    "half disc (mesh of Gmsh)": ("half-disc", {"until": "0.5"}, "run"),
    "friction": ("rough-wall", {"until": "0.12", "samples": "12"}, "run"),
    "two bodies": ("blocks", {"until": "0.4"}, "run"),
    "an orbit": ("half-plate-orbit", {}, "orbit --omega 1.8"),
    "a sweep": ("driven-stop", {}, "response --sweep up --range 1.0,1.02"),
    "harmonic balance": ("half-plate-orbit", {}, "backbone --method hbm --harmonics 7 --range 1.7,1.72"),
}


def compiler() -> str:
    return subprocess.run(["rustc", "--version"], capture_output=True, text=True, check=True).stdout.split()[1]


def processor() -> str:
    found = re.search(r"model name\s*: (.*)", Path("/proc/cpuinfo").read_text())
    return found[1] if found else "unknown"


def count(binary: Path, name: str) -> int:
    """Millions of instructions."""
    scene, changes, command = COMMANDS[name]
    text = (ROOT / f"scenarios/{scene}.toml").read_text()
    for key, value in changes.items():
        text, found = re.subn(rf"^{key} = [^\n#]*", f"{key} = {value} ", text, flags=re.M)
        assert found == 1, f"{scene}: one key {key}"
    # its meshes and matrices lie beside it
    text = re.sub(r'^file = "', f'file = "{ROOT}/scenarios/', text, flags=re.M)
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "scene.toml"
        path.write_text(text)
        verb, *options = command.split()
        words = [verb, str(path), *options, "-o", f"{folder}/answer.h5", "--threads", "1", "-q"]
        leave_out = [f"--toggle-collect={WRITES}", "--collect-atstart=yes"]
        tool = ["valgrind", "--tool=callgrind", *leave_out, f"--callgrind-out-file={folder}/profile"]
        done = subprocess.run([*tool, str(binary), *words], cwd=ROOT, capture_output=True, text=True)
        found = re.search(r"Collected : (\d+)", done.stderr)
        if done.returncode != 0 or found is None:
            raise SystemExit(f"signorini {command} {scene}: exit code {done.returncode}\n{done.stderr[-2000:]}")
        return round(int(found[1]) / 1e6)


def main() -> int:
    binary = Path(sys.argv[1]).resolve()
    if shutil.which("valgrind") is None:
        print("SKIPPED: no valgrind on this machine: instructions are not counted")
        return 75
    known = tomllib.loads(TABLE.read_text()) if TABLE.exists() else {"compiler": "", "processor": "", "millions": {}}
    here = {"compiler": compiler(), "processor": processor()}
    same = all(known[name] == own for name, own in here.items())
    now, worse = {}, 0
    for name in COMMANDS:
        now[name] = count(binary, name)
        before = known["millions"].get(name)
        change = "" if before is None else f"{before:8d}  {100 * (now[name] / before - 1):+6.1f} %"
        is_worse = before is not None and now[name] > (1 + LIMIT) * before
        worse += is_worse
        print(f"{now[name]:8d}  {change:20s} {name}{'  MORE' if is_worse and same else ''}", flush=True)
    if "--keep" in sys.argv:
        lines = [f'"{name}" = {value}' for name, value in now.items()]
        head = "# Millions of instructions of whole commands, by .ci/counts.py --keep; what writes the file is left out."
        by = [f'{name} = "{own}"' for name, own in here.items()]
        TABLE.write_text("\n".join([head, *by, "", "[millions]", *lines]) + "\n")
        return 0
    if not same:
        print(f"counted with {here}, the table with {known['compiler']}, {known['processor']}: told, not held against it")
        return 0
    print(f"{len(now)} commands, {worse} that take more than {100 * LIMIT:.0f} % more")
    return min(worse, 1)


sys.exit(main())
