"""Proper inputs of every reader, small: `.venv/bin/python fuzz/seeds.py PROGRAM FOLDER` writes them into FOLDER/READER/."""

import json
import re
import shutil
import subprocess
import sys
import time
from pathlib import Path

import h5py
import numpy as np

BAR = """[body]
kind = "bar"
size = [1.0]
elements = [3]
young = 1.0
density = 1.0
[[support]]
edge = "left"
fix = ["x"]
[contact]
edge = "right"
gap = 1.0
[initial]
mode = 1
amplitude = -1.2
[orbit]
omega = 1.8
[run]
until = 3.0
samples = 2
"""


def words_of(schema: object) -> set[str]:
    """The keys and the words that a schema knows."""
    found: set[str] = set()
    if isinstance(schema, dict):
        found |= set(schema.get("properties", {})) | {w for w in [*schema.get("enum", []), schema.get("const")] if isinstance(w, str)}
        for value in schema.values():
            found |= words_of(value)
    elif isinstance(schema, list):
        for value in schema:
            found |= words_of(value)
    return found


def dictionary(words: set[str]) -> bytes:
    escaped = ["".join(c if c.isalnum() or c in " -_$%#.[]=" else f"\\x{ord(c):02x}" for c in w) for w in sorted(words) if w.isascii()]
    return "".join(f'"{w}"\n' for w in escaped if w).encode()


def small(source: Path) -> bytes:
    """The same file without chunks, which leave much of it empty."""
    target = source.with_suffix(".small")
    with h5py.File(source) as f, h5py.File(target, "w") as g:
        g.attrs.update(f.attrs)

        def copy(name: str, of: h5py.Group | h5py.Dataset) -> None:
            new = g.create_dataset(name, data=of[()], dtype=of.dtype) if isinstance(of, h5py.Dataset) else g.require_group(name)
            new.attrs.update(of.attrs)

        f.visititems(copy)
    return target.read_bytes()


def main(program: Path, folder: Path) -> None:
    root = Path(__file__).parents[1]

    def put(reader: str, name: str, data: bytes) -> None:
        (folder / reader).mkdir(parents=True, exist_ok=True)
        (folder / reader / name).write_bytes(data)

    shutil.rmtree(folder, ignore_errors=True)
    for path in sorted((root / "scenarios").glob("*.toml")):
        put("scene", path.name, path.read_bytes())
    for path in sorted((root / "scenarios").glob("*.mtx")):
        put("mtx", path.name, path.read_bytes())
    put("mtx", "dense.mtx", b"%%MatrixMarket matrix array real symmetric\n2 2\n1\n2\n3\n")
    meshes = sorted((root / "tests/reference/meshes").glob("*.msh")) + sorted((root / "scenarios/meshes").glob("*.msh"))
    for path in meshes:
        if path.stat().st_size < 20_000:
            put("msh", path.name, path.read_bytes())
    put("history", "a.csv", b"t, f\n# measured\n0, 0\n0.5; 1e-3\n1\t2.5\n")
    put("series", "a.csv", b"point,omega,k,part,u_1,u_2\na,1.5,0,cos,0,0\na,1.5,1,cos,1,2\na,1.5,1,sin,0,1\nb,1.6,0,cos,0,1\nb,1.6,1,cos,1,1\nb,1.6,1,sin,1,2\n")
    put("series", "viscous.csv", b"point;omega;alpha;k;part;u_1;u_2\na;1.5;0.1;0;cos;0;0\na;1.5;0.1;1;cos;1;2\n")
    put("study", "a.toml", b'scene = "bar.toml"\ncommand = "run"\noptions = ["--quiet"]\n[vary]\n"contact.gap" = [1, 2]\n"run.until" = [1.0, 2.0]\n')
    put("study", "zip.toml", b'scene = "bar.toml"\ncommand = "backbone"\nzip = true\n[vary]\n"body.elements" = [[2], [3]]\n"orbit.omega" = [1.5, 1.6]\n')
    numbers = {"1e308", "-1", "nan", "inf", "0", "9007199254740993", "18446744073709551615"}
    for reader, words in [("scene", ["schema"]), ("study", ["schema", "study"])]:
        schema = json.loads(subprocess.run([program.resolve(), *words], check=True, capture_output=True).stdout)
        (folder / f"{reader}.dict").write_bytes(dictionary(words_of(schema) | numbers))
    for reader in ["msh", "mtx", "series", "history"]:
        text = "\n".join(path.read_text() for path in sorted((folder / reader).iterdir()))
        (folder / f"{reader}.dict").write_bytes(dictionary(set(re.findall(r"[$%A-Za-z_]\w+", text)) | numbers))
    made = folder / "made"
    made.mkdir()
    (made / "bar.toml").write_text(BAR)

    def call(*words: str) -> None:
        subprocess.run([program.resolve(), *words, "-q", "--force", "--threads", "1"], cwd=made, check=False, capture_output=True)

    call("run", "bar.toml", "-o", "run.h5")
    call("orbit", "bar.toml", "-o", "orbit.h5")
    call("backbone", "bar.toml", "--viscous", "--beta", "0.05", "--range", "1.75,1.8", "-o", "family.h5")
    call("backbone", "bar.toml", "--method", "hbm", "--harmonics", "3", "--range", "1.75,1.77", "-o", "series.h5")
    call("compare", "bar.toml", "--methods", "nbm,penalty", "--elements", "2,3", "-o", "compared")
    for path in sorted(made.glob("*.h5")):
        put("results", path.name, small(path))
    with h5py.File(made / "a.mat", "w", userblock_size=512) as f:
        f.create_dataset("K", data=np.array([[2.0, 1.0, 0.0], [0.0, 3.0, 4.0]])).attrs["MATLAB_class"] = np.bytes_("double")
    put("mat", "a.mat", (made / "a.mat").read_bytes())
    with h5py.File(made / "b.mat", "w") as f:
        f.create_dataset("K", data=np.arange(16, dtype="i4").reshape(4, 4), chunks=(2, 2), compression="gzip")
    put("mat", "b.mat", (made / "b.mat").read_bytes())
    # a family as it stands while it is computed, without the checksums that its lines begin with
    words = [program.resolve(), "backbone", "bar.toml", "--range", "1.6,1.9", "--step", "0.0001", "-o", "begun.h5", "-q", "--threads", "1"]
    process = subprocess.Popen(words, cwd=made, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
    lines: list[bytes] = []
    while len(lines) < 4 and process.poll() is None:
        time.sleep(0.02)
        journal = made / "begun.h5.journal"
        lines = journal.read_bytes().split(b"\n")[:4] if journal.is_file() else []
    process.kill()
    process.wait()
    put("journal", "a.txt", b"\n".join(line.partition(b" ")[2] for line in lines))
    shutil.rmtree(made)


main(Path(sys.argv[1]), Path(sys.argv[2]))
