"""Other programs on the same matrices come to the same motion: `signorini precision` with every peer, each at its finest tolerance, without friction, on two bodies, and with friction (there
time stepping too, which knows no events); and GetFEM and CalculiX, where they are installed, on the same mesh and data.

    .venv/bin/python validate/peers/check.py        after `make build peers`
"""

import json
import os
import shutil
import subprocess
import sys
import tempfile
from pathlib import Path

PEERS = ["scipy", "sundials", "diffsol"]
STEPPING = "scipy time stepping"
# what `make peers` leaves out, loudly, where the packages of the system do not have it
OPTIONAL = {"sundials": Path("target/peers/sundials_peer")}
# of the last state, over its size, and of the switching times; measured 3e-11 and 5e-13 at the most
ERROR, TIMES = 1e-9, 1e-11
# with friction measured 6e-11 and 2e-11; time stepping 4.4e-7, of the second order
RUBBED, STEPS, ORDER = 1e-10, 1e-6, (12.0, 20.0)
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


# a bar on a rigid plane: the closed form of its wave; here 0.9 % and 0.4 % off with forty elements, CalculiX 1.5 and 2.2 % (rows of its mass are dropped at the contact), whose
# energy changes by 2 %; frequencies are those of the same elements, to the digits that CalculiX prints
BAR = {"contact_time": (2 * 100 / (210000 / 7.85e-9) ** 0.5, 0.02), "impulse": (0.157, 0.03)}
PRINTED, ENERGIES = 2e-6, (1e-11, 0.03)


def calculix(root: Path) -> list[str]:
    if shutil.which(os.environ.get("SIGNORINI_CALCULIX", "ccx")) is None:
        skipped("CalculiX (Debian: calculix-ccx): its massless contact is not compared with")
        return []
    body = precision(root, "validate/peers/anvil.toml", "--peer", "calculix", "--peers-only")["bodies"][0]
    told = [(f"frequency {k + 1}", abs(b / a - 1) < PRINTED, a, b) for k, (a, b) in enumerate(body["frequencies"])]
    for name, (exact, accepted) in BAR.items():
        told.append((name, all(abs(x / exact - 1) < accepted for x in body[name]), *body[name]))
    told.append(("change of the energy", all(x < accepted for x, accepted in zip(body["energy"], ENERGIES)), *body["energy"]))
    for name, good, own, other in told:
        print("ok     " if good else "FAILED ", f"calculix, {name}: {own:.6g} here, {other:.6g} there")
    failed = [name for name, good, *_ in told if not good]
    return failed if len(body["frequencies"]) == 5 else [*failed, "calculix"]


def compared(points: list[dict], peers: list[str], own: dict, times: float) -> list[str]:
    failed = []
    for peer in peers:
        of_peer = [p for p in points if p["method"].startswith(peer) and p["method"] != STEPPING]
        for method in sorted({p["method"] for p in of_peer}):
            finest = min((p for p in of_peer if p["method"] == method), key=lambda p: p["rtol"])
            apart = finest["switch_error"]
            text = f"{method} at {finest['rtol']:g}: {finest['switches']} switches, error {finest['error']:.1e}, times {'differ' if apart is None else f'{apart:.1e}'}"
            coarse = finest["rtol"] > 1e-11
            good = finest["switches"] == own["switches"] and (coarse or finest["error"] < ERROR and apart is not None and apart < times)
            print("ok     " if good else "FAILED ", text)
            failed += [] if good else [method]
        failed += [] if of_peer else [peer]
    return failed


def rubbed(root: Path, peers: list[str]) -> list[str]:
    """A plate that lands point by point on a rough slope, sticks and slips; by events and by steps."""
    points = precision(root, "validate/peers/slope.toml", *(word for peer in peers for word in ("--peer", peer)))["points"]
    own = next(p for p in points if p["method"] == "auto, cold")
    failed = compared(points, peers, own, RUBBED)
    steps = sorted((p for p in points if p["method"] == STEPPING), key=lambda p: p["rtol"])[:2]
    if len(steps) < 2:
        return [*failed, STEPPING]
    fine, coarse = steps[0]["error"], steps[1]["error"]
    good = fine < STEPS and ORDER[0] < coarse / fine < ORDER[1]
    print("ok     " if good else "FAILED ", f"{STEPPING}: error {fine:.1e}, {coarse / fine:.1f} times that with four times the step")
    return failed if good else [*failed, STEPPING]


def main() -> int:
    root = Path(__file__).parents[2]
    peers = [peer for peer in PEERS if peer not in OPTIONAL or (root / OPTIONAL[peer]).is_file()]
    for peer in set(PEERS) - set(peers):
        skipped(f"{peer}: nothing is compared with it")
    points = precision(root, "scenarios/plate-half.toml", *(word for peer in peers for word in ("--peer", peer)))["points"]
    own = next(p for p in points if p["method"] == "modal, cached")
    failed = getfem(root) + calculix(root) + compared(points, peers, own, TIMES)
    points = precision(root, "validate/peers/two-plates.toml", *(word for peer in peers for word in ("--peer", peer)))["points"]
    failed += compared(points, peers, next(p for p in points if p["method"] == "modal, cached"), TIMES)
    # diffsol's peer knows no friction
    failed += rubbed(root, [peer for peer in peers if peer != "diffsol"])
    return 1 if failed else 0


sys.exit(main())
