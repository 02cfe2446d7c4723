"""SciPy's solve_ivp with events on the same matrices: the peer of `signorini precision --peer scipy`; with friction time stepping beside it.

Reads a problem written by signorini (argument 1: HDF5 with M, K, N_C, N_O, gap, f, u0, v0, active0, until; with friction E, limit, surface) and prints one
JSON object a line: method, rtol, wall_s (median), setup_s (the phases' dense matrices), nfev, u, v, switches.
The phases are dense and inverted once; events are the gaps of free nodes and the pressures of nodes in contact, with friction what is left of the limit of
nodes that stick, and the slip velocities of the others.
"""
import json
import statistics
import sys
import time

import h5py
import numpy as np
from scipy.integrate import solve_ivp

OPEN, CLOSED, STICK, PLUS, MINUS = range(5)
SIGN = {PLUS: 1.0, MINUS: -1.0}


class Phase:
    """`u'' = force - stiffness u`; monitors `rows u + rates u' + offset`, each of a point, with the state that it leads to."""

    def __init__(self, p, states):
        n, n_c = p["N_O"].shape[1], len(states)
        touches = states != OPEN
        c, f = np.flatnonzero(touches), np.flatnonzero(~touches)
        a, d = np.zeros((n_c, n)), np.zeros(n_c)
        d[c] = p["gap"][c]
        if len(f):
            block = p["N_C"][np.ix_(f, f)]
            a[f] = -np.linalg.solve(block, p["N_O"][f])
            d[f] = -np.linalg.solve(block, p["N_C"][np.ix_(f, c)] @ p["gap"][c])
        star = np.vstack([np.eye(n), a])
        shift = np.concatenate([np.zeros(n), d])
        m = star.T @ p["M"] @ star
        k = star.T @ p["K"] @ star
        force = star.T @ (p["f"] - p["K"] @ shift)
        # pressures of all points
        pressure, constant = -(p["N_O"] + p["N_C"] @ a), -(p["N_C"] @ d)
        slips = [i for i in range(n_c) if states[i] in SIGN]
        for i in slips:
            e = SIGN[states[i]] * p["limit"][i] * p["E"][i]
            k = k + np.outer(e, pressure[i])
            force = force - e * constant[i]
        self.stiffness, self.force = np.linalg.solve(m, k), np.linalg.solve(m, force)
        stuck = np.flatnonzero(states == STICK)
        if len(stuck):
            # the forces that keep them at rest
            e = p["E"][stuck]
            columns = np.linalg.solve(m, e.T)
            inverse = np.linalg.inv(e @ columns)
            hold, held = inverse @ e @ self.stiffness, -inverse @ e @ self.force
            self.stiffness = self.stiffness - columns @ hold
            self.force = self.force + columns @ held
        monitors = []
        for i in range(n_c):
            nothing = np.zeros(n)
            if not touches[i]:
                monitors.append((i, CLOSED, -a[i], nothing, p["gap"][i] - d[i]))
                continue
            monitors.append((i, OPEN, pressure[i], nothing, constant[i]))
            if states[i] == STICK:
                row, (j,) = p["limit"][i] * pressure[i], np.flatnonzero(stuck == i)
                limit = p["limit"][i] * constant[i]
                # the force that holds falls to -limit: it slips forwards
                monitors.append((i, PLUS, row + hold[j], nothing, limit + held[j]))
                monitors.append((i, MINUS, row - hold[j], nothing, limit - held[j]))
            if states[i] in SIGN:
                sigma = SIGN[states[i]]
                monitors.append((i, STICK, nothing, sigma * p["E"][i], -sigma * p["surface"][i]))
        self.points = [m[0] for m in monitors]
        self.to = [m[1] for m in monitors]
        self.rows = np.array([np.concatenate([m[2], m[3]]) for m in monitors])
        self.offset = np.array([m[4] for m in monitors])
        self.n = n

    def rhs(self, _t, y):
        u, v = y[: self.n], y[self.n :]
        return np.concatenate([v, self.force - self.stiffness @ u])

    def events(self):
        def make(i):
            row, offset = self.rows[i], self.offset[i]

            def event(_t, y):
                return row @ y + offset

            event.terminal, event.direction = True, -1
            return event

        return [make(i) for i in range(len(self.offset))]


class Body:
    """A problem with the phases that have been met."""

    def __init__(self, p):
        self.p, self.phases, self.setup = p, {}, 0.0

    def phase(self, states):
        key = states.tobytes()
        if key not in self.phases:
            start = time.perf_counter()
            self.phases[key] = Phase(self.p, states)
            self.setup += time.perf_counter() - start
        return self.phases[key]

    def slipping(self, i, y):
        """What a point does that comes into contact."""
        if self.p["limit"][i] == 0.0:
            return CLOSED
        n = len(y) // 2
        v = self.p["E"][i] @ y[n:] - self.p["surface"][i]
        size = np.abs(y[n:]).max()
        return STICK if abs(v) <= 1e-12 * size else PLUS if v > 0 else MINUS

    def switch(self, states, phase, k, y):
        """The states behind a monitor, and the velocities: what comes to rest does so exactly."""
        i, to = phase.points[k], phase.to[k]
        states = states.copy()
        if to == STICK:
            e = self.p["E"][i]
            y[phase.n :] -= e * (e @ y[phase.n :] - self.p["surface"][i]) / (e @ e)
        states[i] = self.slipping(i, y) if to == CLOSED else to
        return states

    def settled(self, states, y):
        """The states in which nothing is held by more than friction can."""
        for _ in range(4 * len(states)):
            phase = self.phase(states)
            h = phase.rows @ y + phase.offset
            size = 1e-12 * np.abs(phase.rows) @ np.abs(y)
            beyond = [k for k in range(len(h)) if phase.to[k] in SIGN and h[k] < -size[k]]
            if not beyond:
                break
            states = self.switch(states, phase, min(beyond, key=lambda k: h[k]), y)
        return states


def run(body, method, rtol):
    p = body.p
    y, t, nfev, switches = np.concatenate([p["u0"], p["v0"]]), 0.0, 0, []
    states = p["active0"].copy()
    for i in np.flatnonzero(states):
        states[i] = body.slipping(i, y)
    states = body.settled(states, y)
    while t < p["until"]:
        phase = body.phase(states)
        s = solve_ivp(phase.rhs, (t, p["until"]), y, method=method, rtol=rtol,
                      atol=1e-3 * rtol, events=phase.events())
        nfev += s.nfev
        t, y = s.t[-1], s.y[:, -1].copy()
        if s.status == 1:
            for k, times in enumerate(s.t_events):
                if len(times):
                    states = body.switch(states, phase, k, y)
                    switches.append(float(times[-1]))
            states = body.settled(states, y)
    return y, nfev, switches


class Stepping:
    """Steps that know no events: displacements half-way, the law of the normal direction there, velocities with friction, displacements
    (Moreau 1988; Acary and Brogliato 2008, explicit in displacements)."""

    def __init__(self, p):
        n = p["N_O"].shape[1]
        self.p, self.n = p, n
        self.inverse = np.linalg.inv(p["M"][:n, :n])
        self.rubs = np.flatnonzero(p["limit"])
        self.e = p["E"][self.rubs]
        self.columns = self.inverse @ self.e.T
        self.gram = self.e @ self.columns
        self.follow = {}

    def normal(self, u, touches):
        """`u_C` and the pressures at `u_O`, from the set that was the last."""
        p = self.p
        for _ in range(100):
            key = touches.tobytes()
            if key not in self.follow:
                f = np.flatnonzero(~touches)
                self.follow[key] = f, np.linalg.inv(p["N_C"][np.ix_(f, f)])
            f, inverse = self.follow[key]
            x = np.where(touches, p["gap"], 0.0)
            x[f] = -inverse @ (p["N_O"][f] @ u + p["N_C"][f] @ x)
            pressure = -(p["N_O"] @ u + p["N_C"] @ x)
            wrong = np.where(touches, pressure < 0, x > p["gap"])
            if not wrong.any():
                return x, pressure, touches
            touches = touches ^ wrong
        raise RuntimeError("no set of contacts was found")

    def run(self, h):
        p, n = self.p, self.n
        count = int(np.ceil(p["until"] / h))
        h = p["until"] / count
        u, v = p["u0"].copy(), p["v0"].copy()
        touches, force = p["active0"] != OPEN, np.zeros(len(self.rubs))
        for _ in range(count):
            u = u + 0.5 * h * v
            x, pressure, touches = self.normal(u, touches)
            whole = p["f"][:n] - p["K"][:n] @ np.concatenate([u, x])
            v = v + h * (self.inverse @ whole)
            limit = h * p["limit"][self.rubs] * np.where(touches, pressure, 0.0)[self.rubs]
            if limit.any():
                slip = self.e @ v - p["surface"][self.rubs]
                force = np.clip(force, -limit, limit)
                # the impulses of friction, point by point
                for _ in range(1000):
                    before = force.copy()
                    for k in range(len(limit)):
                        rate = slip[k] + self.gram[k] @ force
                        force[k] = np.clip(force[k] - rate / self.gram[k, k], -limit[k], limit[k])
                    if np.abs(force - before).max() <= 1e-14 * limit.max():
                        break
                v = v + self.columns @ force
            u = u + 0.5 * h * v
        return np.concatenate([u, v]), count


def timed(solve, repeats):
    """What it comes to, and the median of some times."""
    walls, answer = [], solve()
    for _ in range(repeats):
        start = time.perf_counter()
        answer = solve()
        walls.append(time.perf_counter() - start)
    return answer, statistics.median(walls)


def say(method, rtol, wall, setup, nfev, y, switches):
    n = len(y) // 2
    print(json.dumps({"method": method, "rtol": rtol, "wall_s": wall, "setup_s": setup, "nfev": nfev, "u": y[:n].tolist(),
                      "v": y[n:].tolist(), "switches": switches}), flush=True)


def main():
    with h5py.File(sys.argv[1]) as f:
        p = {k: f[k][()] for k in f}
    p["active0"] = np.where(p["active0"] != 0, CLOSED, OPEN)
    rubs = "E" in p
    if not rubs:
        p["limit"] = np.zeros(len(p["gap"]))
    repeats = int(sys.argv[2])
    for method, ladder in (("RK45", [1e-4, 1e-6, 1e-8]), ("DOP853", [1e-4, 1e-6, 1e-8, 1e-10, 1e-12])):
        for rtol in ladder:
            body = Body(p)
            (y, nfev, switches), wall = timed(lambda: run(body, method, rtol), repeats)
            say(method, rtol, wall, body.setup, nfev, y, switches)
    if rubs:
        stepping = Stepping(p)
        highest = np.sqrt(np.abs(np.linalg.eigvals(stepping.inverse @ p["K"][: stepping.n, : stepping.n])).max())
        for steps in (1, 4, 16, 64, 256):
            (y, count), wall = timed(lambda: stepping.run(1.0 / (highest * steps)), 1)
            # in the place of the tolerance the step over the whole time
            say("time stepping", 1.0 / count, wall, 0.0, count, y, [])


main()
