"""Other programs on the same matrices come to the same motion: `signorini precision` with every peer, each at its finest tolerance; and GetFEM, where it
is installed, on the same mesh and data.

    .venv/bin/python validate/peers/check.py        after `make build peers`
"""

import json
import os
import subprocess
import sys
import tempfile
from pathlib import Path

PEERS = ["scipy", "sundials", "diffsol"]
# what `make peers` leaves out, loudly, where the packages of the system do not have it
OPTIONAL = {"sundials": Path("target/peers/sundials_peer")}
# of the last state, over its size, and of the switching times; measured 3e-11 and 5e-13 at the most
ERROR, TIMES = 1e-9, 1e-11
# GetFEM's frequencies are those of the same elements (measured 1e-14); its penalty and its time steps are good for percents (measured 1.2 %, 2 %)
FREQUENCIES, CONTACT = 1e-10, 0.03


def precision(root: Path, *words: str) -> dict:
    with tempfile.TemporaryDirectory() as folder:
        command = [root / "target/release/signorini", "precision", "--json", "--repeats", "1", "-o", Path(folder) / "peers", *words]
        answer = subprocess.run(command, cwd=root, check=True, capture_output=True, text=True).stdout
    return json.loads(answer)["study"]


def skipped(what: str) -> None:
    """Told, and counted by .ci/run."""
    print(f"SKIPPED: {what}")
    if counted := os.environ.get("SIGNORINI_SKIPPED"):
        with open(counted, "a") as file:
            print(what, file=file)


def getfem(root: Path) -> list[str]:
    python = os.environ.get("SIGNORINI_GETFEM", "/usr/bin/python3")
    if subprocess.run([python, "-c", "import getfem, scipy"], capture_output=True).returncode:
        skipped("GetFEM (Debian: python3-getfem, python3-scipy): no other finite element program is compared with")
        return []
    body = precision(root, "scenarios/half-disc.toml", "--peer", "getfem", "--peers-only")["bodies"][0]
    pairs = [(f"frequency {k + 1}", pair, FREQUENCIES) for k, pair in enumerate(body["frequencies"])]
    pairs += [(name, body[name], CONTACT) for name in ["contact_time", "impulse"]]
    failed = []
    for name, (own, other), accepted in pairs:
        good = abs(other / own - 1) < accepted
        print("ok     " if good else "FAILED ", f"getfem, {name}: {own:.6g} here, {other:.6g} there, {other / own - 1:+.1e}")
        failed += [] if good else [name]
    return failed if len(pairs) == 7 else [*failed, "getfem"]


def main() -> int:
    root = Path(__file__).parents[2]
    peers = [peer for peer in PEERS if peer not in OPTIONAL or (root / OPTIONAL[peer]).is_file()]
    for peer in set(PEERS) - set(peers):
        skipped(f"{peer}: nothing is compared with it")
    points = precision(root, "scenarios/plate-half.toml", *(word for peer in peers for word in ("--peer", peer)))["points"]
    own = next(p for p in points if p["method"] == "modal, cached")
    failed = getfem(root)
    for peer in peers:
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
