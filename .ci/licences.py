"""Licences of all crates that are linked, and the page of direct dependencies: what is not permissive, or not on the page, is refused.

    python3 .ci/licences.py [--texts FILE]

`--texts` writes the texts of all of them into a file that goes along with what is given to others: archive, wheel, package of conda.
"""

import argparse
import json
import re
import subprocess
import sys
from pathlib import Path

PERMISSIVE = {
    "MIT", "Apache-2.0", "Apache-2.0 WITH LLVM-exception", "BSD-1-Clause", "BSD-2-Clause", "BSD-3-Clause", "ISC", "Zlib", "Unicode-3.0", "Unicode-DFS-2016",
    "BSL-1.0", "CC0-1.0", "Unlicense", "0BSD", "MIT-0", "OFL-1.1", "MPL-2.0",
}
# their licence is a file: read, and found permissive
BY_FILE = {"hdf5-metno-src": "HDF5's own, of the kind of BSD-3-Clause"}


def permitted(expression: str) -> bool:
    """An SPDX expression of AND, OR and brackets; the old slash is an OR."""
    words = re.findall(r"\(|\)|[^\s()]+", expression.replace("/", " OR ").replace(" WITH ", "~"))

    def term() -> bool:
        word = words.pop(0)
        if word == "(":
            value = either()
            words.pop(0)
            return value
        return word.replace("~", " WITH ") in PERMISSIVE

    def both() -> bool:
        value = term()
        while words and words[0] == "AND":
            words.pop(0)
            value = term() and value
        return value

    def either() -> bool:
        value = both()
        while words and words[0] == "OR":
            words.pop(0)
            value = both() or value
        return value

    return either()


def texts(packages: list[dict]) -> str:
    """The texts of licences that crates bring, each once, with those that it is of."""
    of: dict[str, list[str]] = {}
    for p in packages:
        folder = Path(p["manifest_path"]).parent
        names = [f"{p['name']} {p['version']} ({p['license'] or 'its own'})"]
        files = [f for f in sorted(folder.iterdir()) if re.match(r"(?i)(licen[cs]e|copying|copyright|notice|unlicense)", f.name) and f.is_file()]
        # the library in C that a crate brings has a licence of its own
        files += [f for f in sorted(folder.glob("ext/*/*")) if re.match(r"(?i)(licen[cs]e|copying)", f.name) and f.is_file()]
        for text in [f.read_text(errors="replace").strip() for f in files] or [f"{p['license']} (the crate brings no text)"]:
            of.setdefault(text, []).extend(n for n in names if n not in of.get(text, []))
    parts = [", ".join(names) + "\n\n" + text for text, names in of.items()]
    return ("\n\n" + "=" * 100 + "\n\n").join(["What is linked into signorini, and under which licences.", *parts]) + "\n"


def main() -> int:
    parser = argparse.ArgumentParser()
    parser.add_argument("--texts", type=Path)
    given = parser.parse_args()
    root = Path(__file__).parents[1]
    words = ["cargo", "metadata", "--format-version", "1", "--locked"]
    data = json.loads(subprocess.run(words, cwd=root, check=True, capture_output=True, text=True).stdout)
    page = (root / "docs/reference/dependencies.md").read_text()
    own = [p for p in data["packages"] if p["source"] is None]
    others = [p for p in data["packages"] if p["source"] is not None]
    wrong = [f"{p['name']} {p['version']}: licence {p['license'] or 'in a file'}" for p in others if p["name"] not in BY_FILE and not permitted(p["license"] or "?")]
    inside = {p["name"] for p in own}
    named = {d["rename"] or d["name"] for p in own for d in p["dependencies"] if d["name"] not in inside}
    direct = {d["name"] for p in own for d in p["dependencies"] if d["name"] not in inside}
    wrong += [f"{name} is not on docs/reference/dependencies.md" for name in sorted(direct) if f"`{name}`" not in page]
    for line in wrong:
        print(line)
    if given.texts is not None:
        given.texts.write_text(texts(others))
    print(f"{len(others)} crates, {len(named)} of them by name: {'all permissive and listed' if not wrong else 'REFUSED'}")
    return 1 if wrong else 0


sys.exit(main())
