"""Other programs on the same matrices come to the same motion: `signorini precision` with every peer, each at its finest tolerance.

    .venv/bin/python validate/peers/check.py        after `make build peers`
"""

import json
import subprocess
import sys
import tempfile
from pathlib import Path

PEERS = ["scipy", "sundials", "diffsol"]
# of the last state, over its size, and of the switching times; measured 3e-11 and 5e-13 at the most
ERROR, TIMES = 1e-9, 1e-11


def main() -> int:
    root = Path(__file__).parents[2]
    with tempfile.TemporaryDirectory() as folder:
        command = [root / "target/release/signorini", "precision", "scenarios/plate-half.toml", "--json", "--repeats", "1"]
        command += ["-o", Path(folder) / "peers", *(word for peer in PEERS for word in ("--peer", peer))]
        answer = json.loads(subprocess.run(command, cwd=root, check=True, capture_output=True, text=True).stdout)
    points = answer["study"]["points"]
    own = next(p for p in points if p["method"] == "modal, cached")
    failed = []
    for peer in PEERS:
        of_peer = [p for p in points if p["method"].startswith(peer)]
        for method in sorted({p["method"] for p in of_peer}):
            finest = min((p for p in of_peer if p["method"] == method), key=lambda p: p["rtol"])
            text = f"{method} at {finest['rtol']:g}: {finest['switches']} switches, error {finest['error']:.1e}, times {finest['switch_error']:.1e}"
            coarse = finest["rtol"] > 1e-11
            good = finest["switches"] == own["switches"] and (coarse or finest["error"] < ERROR and finest["switch_error"] < TIMES)
            print("ok     " if good else "FAILED ", text)
            failed += [] if good else [method]
        failed += [] if of_peer else [peer]
    return 1 if failed else 0


sys.exit(main())
