"""What `sg.run` costs over the library call, and how long its arrays take: best of 20, the two in turn. Run from the project's folder."""

import time

import signorini as sg
from signorini import _signorini

scene = sg.Scene("scenarios/plate.toml")
library, run, read = [], [], []
for _ in range(20):
    library.append(_signorini.library_run(scene._scene))
    start = time.perf_counter()
    r = sg.run(scene)
    run.append(time.perf_counter() - start)
    r.t, r.u, r.v, r.active, r.pressure
    read.append(time.perf_counter() - start)
    # the file of a result goes with it
    del r
best = min(library)
print(f"library call, no states kept: {1e3 * best:.1f} ms; sg.run {100 * (min(run) / best - 1):+.1f} %, with all arrays read {100 * (min(read) / best - 1):+.1f} %")
