"""Security advisories on the crates of Cargo.lock, from the OSV database (which has those of RustSec). A vulnerability is refused; what is only information (a crate that nobody maintains) is told.

    python3 .ci/advisories.py        exit code 0: none; 1: some; 75: the database cannot be reached
"""

import json
import os
import sys
import tomllib
import urllib.error
import urllib.request
from pathlib import Path

SERVER = os.environ.get("SIGNORINI_OSV", "https://api.osv.dev")
# advisories that do not touch what is used here, and why
KNOWN: dict[str, str] = {}


def ask(path: str, body: object = None) -> dict:
    data = None if body is None else json.dumps(body).encode()
    request = urllib.request.Request(f"{SERVER}/v1/{path}", data, {"Content-Type": "application/json"})
    with urllib.request.urlopen(request, timeout=30) as answer:
        return json.load(answer)


def main() -> int:
    lock = tomllib.loads((Path(__file__).parents[1] / "Cargo.lock").read_text())
    crates = [(p["name"], p["version"]) for p in lock["package"] if "registry" in p.get("source", "")]
    queries = [{"package": {"name": n, "ecosystem": "crates.io"}, "version": v} for n, v in crates]
    try:
        answers = []
        for start in range(0, len(queries), 500):
            answers += ask("querybatch", {"queries": queries[start : start + 500]})["results"]
        assert len(answers) == len(crates), "an answer for every crate"
        found = sorted({(v["id"], n, version) for (n, version), a in zip(crates, answers) for v in a.get("vulns", [])})
        details = {id: ask(f"vulns/{id}") for id in {f[0] for f in found}}
    except (urllib.error.URLError, TimeoutError) as reason:
        print(f"SKIPPED: the database of advisories cannot be reached ({reason}): {len(crates)} crates are not checked")
        return 75
    refused = 0
    for id, name, version in found:
        advisory = details[id]
        about = f"{id} {name} {version}: {advisory.get('summary', '')}"
        parts = [a.get("database_specific") or {} for a in advisory.get("affected", [])]
        if id in KNOWN:
            print(f"known    {about} ({KNOWN[id]})")
        elif advisory.get("withdrawn") or any(p.get("informational") for p in parts):
            print(f"told     {about}")
        else:
            print(f"REFUSED  {about}")
            refused += 1
    print(f"{len(crates)} crates, {len(found)} advisories, {refused} refused")
    return min(refused, 1)


sys.exit(main())
