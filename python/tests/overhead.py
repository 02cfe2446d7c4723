"""What `sg.run` costs over the library call, and how long its arrays take to read: best of 20 each. Run from the project's folder."""

import time

import signorini as sg
from signorini import _signorini

COUNT = 20
scene = sg.Scene("scenarios/plate.toml")


def timed(act) -> tuple[float, object]:
    start = time.perf_counter()
    result = act()
    return time.perf_counter() - start, result


bare, library = (min(_signorini.library_run(scene._scene, keeps) for _ in range(COUNT)) for keeps in (False, True))
runs = [timed(lambda: sg.run(scene)) for _ in range(COUNT)]
run = min(seconds for seconds, _ in runs)
read = min(timed(lambda r=r: (r.t, r.u, r.v, r.active, r.pressure))[0] for _, r in runs)
print(f"library call with its states in memory {1e3 * library:.1f} ms (without {1e3 * bare:.1f} ms)")
print(f"sg.run {100 * (run / library - 1):+.1f} % ({100 * (run / bare - 1):+.1f} %); reading all arrays of its file {100 * read / library:.1f} % more")
