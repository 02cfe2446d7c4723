"""SciPy's solve_ivp with events on the same matrices: the peer of `signorini precision --peer scipy`.

Reads a problem written by signorini (argument 1: HDF5 with M, K, N_C, N_O, gap, f, u0, v0, active0, until) and prints one JSON
object a line: method, rtol, wall_s (median), setup_s (the phases' dense matrices), nfev, u, v, switches.
The phases are dense and inverted once; events are the gaps of free nodes and the pressures of nodes in contact.
"""
import json
import statistics
import sys
import time

import h5py
import numpy as np
from scipy.integrate import solve_ivp


class Phase:
    def __init__(self, p, active):
        n_o, n_c = p["N_O"].shape[1], len(active)
        c, f = np.flatnonzero(active), np.flatnonzero(~active)
        a, d = np.zeros((n_c, n_o)), np.zeros(n_c)
        d[c] = p["gap"][c]
        if len(f):
            block = p["N_C"][np.ix_(f, f)]
            a[f] = -np.linalg.solve(block, p["N_O"][f])
            d[f] = -np.linalg.solve(block, p["N_C"][np.ix_(f, c)] @ p["gap"][c])
        star = np.vstack([np.eye(n_o), a])
        shift = np.concatenate([np.zeros(n_o), d])
        m = star.T @ p["M"] @ star
        self.stiffness = np.linalg.solve(m, star.T @ p["K"] @ star)
        self.force = np.linalg.solve(m, star.T @ (p["f"] - p["K"] @ shift))
        # monitors h = rows @ u_O + offset
        self.rows, self.offset = np.zeros((n_c, n_o)), np.zeros(n_c)
        self.rows[f], self.offset[f] = -a[f], p["gap"][f] - d[f]
        pressure = p["N_O"] + p["N_C"] @ a
        self.rows[c], self.offset[c] = -pressure[c], -(p["N_C"] @ d)[c]
        self.n = n_o

    def rhs(self, _t, y):
        u, v = y[: self.n], y[self.n :]
        return np.concatenate([v, self.force - self.stiffness @ u])

    def events(self):
        def make(i):
            row, offset = self.rows[i], self.offset[i]

            def event(_t, y):
                return row @ y[: self.n] + offset

            event.terminal, event.direction = True, -1
            return event

        return [make(i) for i in range(len(self.offset))]


def run(p, phases, method, rtol):
    active = p["active0"].copy()
    y, t, nfev, switches = np.concatenate([p["u0"], p["v0"]]), 0.0, 0, []
    setup = 0.0
    while t < p["until"]:
        key = active.tobytes()
        if key not in phases:
            start = time.perf_counter()
            phases[key] = Phase(p, active)
            setup += time.perf_counter() - start
        phase = phases[key]
        s = solve_ivp(phase.rhs, (t, p["until"]), y, method=method, rtol=rtol,
                      atol=1e-3 * rtol, events=phase.events())
        nfev += s.nfev
        t, y = s.t[-1], s.y[:, -1]
        if s.status == 1:
            for i, times in enumerate(s.t_events):
                if len(times):
                    active[i] = not active[i]
                    switches.append(float(times[-1]))
    return y, nfev, switches, setup


def main():
    with h5py.File(sys.argv[1]) as f:
        p = {k: f[k][()] for k in f}
    p["active0"] = p["active0"].astype(bool)
    repeats = int(sys.argv[2])
    n = len(p["u0"])
    for method, ladder in (("RK45", [1e-4, 1e-6, 1e-8]), ("DOP853", [1e-4, 1e-6, 1e-8, 1e-10, 1e-12])):
        for rtol in ladder:
            phases, walls = {}, []
            _, _, _, setup = run(p, phases, method, rtol)
            for _ in range(repeats):
                start = time.perf_counter()
                y, nfev, switches, _ = run(p, phases, method, rtol)
                walls.append(time.perf_counter() - start)
            print(json.dumps({"method": method, "rtol": rtol, "wall_s": statistics.median(walls),
                              "setup_s": setup, "nfev": nfev, "u": y[:n].tolist(),
                              "v": y[n:].tolist(), "switches": switches}), flush=True)


main()
