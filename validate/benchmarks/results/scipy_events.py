"""SciPy's DOP853 with events on the benchmarks of one degree of freedom, as results for `signorini benchmark --with`:

    python3 validate/benchmarks/results/scipy_events.py > validate/benchmarks/results/scipy.toml
"""

import math
import time

import numpy as np
import scipy
from scipy.integrate import solve_ivp
from scipy.optimize import brentq

TIGHT = {"method": "DOP853", "rtol": 1e-12, "atol": 1e-14}


def until(rate, t, x, event, end):
    """From (t, x) to the first time at which `event` falls through zero."""
    event.terminal, event.direction = True, -1
    run = solve_ivp(rate, (t, end), x, events=event, **TIGHT)
    return run.t[-1], run.y[:, -1]


def two_element_bar():
    """u_C = min(0.5, u): M = 4/3, K = 1 open; M = 2/3, K = 2 about 0.25 closed."""
    phases = [
        (lambda t, x: [x[1], -0.75 * x[0]], lambda t, x: 0.5 - x[0]),
        (lambda t, x: [x[1], -3.0 * (x[0] - 0.25)], lambda t, x: x[0] - 0.5),
    ]
    t, x, times = 0.0, [-1.0, 0.0], []
    for k in range(3):
        rate, event = phases[k % 2]
        if k:
            # it begins where the event is zero: a little further on
            run = solve_ivp(rate, (t, t + 1e-3), x, **TIGHT)
            t, x = run.t[-1], run.y[:, -1]
        t, x = until(rate, t, x, event, t + 20.0)
        times.append(t)
    return {
        "first closing": times[0],
        "first opening": times[1],
        "period: from one closing to the next": times[2] - times[0],
    }


def elastic_stop_mode():
    """Half a period from rest at -A ends at rest: A by bisection."""
    half = math.pi / 1.3

    def speed(a):
        t, x = until(lambda t, x: [x[1], -x[0]], 0.0, [-a, 0.0], lambda t, x: 1.0 - x[0], half)
        run = solve_ivp(lambda t, x: [x[1], -x[0] - 20.0 * (x[0] - 1.0)], (t, half), x, **TIGHT)
        return run.y[1, -1]

    return {"amplitude away from the stop": brentq(speed, 1.5, 3.0, xtol=1e-13)}


def den_hartog():
    """From turning point to turning point, friction against the motion, for 400 periods: what it settles to."""
    work, x, t, sign = 0.0, [0.9, 0.0], 0.0, -1.0
    period, places = 2 * math.pi / 0.7, []
    while t < 400 * period:
        rate = lambda t, x, s=sign: [x[1], 0.6 * math.cos(0.7 * t) - x[0] - 0.3 * s]
        run = solve_ivp(rate, (t, t + 1e-4), x, **TIGHT)
        t, x = until(rate, run.t[-1], run.y[:, -1], lambda t, x, s=sign: s * x[1], t + 20.0)
        places.append(x[0])
        sign = -sign
    amplitude = 0.5 * abs(places[-1] - places[-2])
    work = 0.3 * (abs(places[-1] - places[-2]) + abs(places[-2] - places[-3]))
    return {"amplitude": amplitude, "work of friction a period, over 4 R A": work / (1.2 * amplitude)}


def main():
    print(f'code = "SciPy {scipy.__version__}, DOP853 with events"')
    print('note = "rtol 1e-12, atol 1e-14; restarted at each event; by scipy_events.py beside this file"')
    values, seconds = [], ["\n[seconds]"]
    for name, case in [("two-element-bar", two_element_bar), ("elastic-stop-mode", elastic_stop_mode), ("den-hartog", den_hartog)]:
        start = time.perf_counter()
        found = case()
        seconds.append(f"{name} = {time.perf_counter() - start:.2f}")
        values.append(f"\n[values.{name}]")
        values += [f'"{key}" = {float(np.round(x, 14))!r}' for key, x in found.items()]
    print("\n".join(seconds + values))


main()
