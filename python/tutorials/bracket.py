# %% [markdown]
# # A bracket that meets a stop
#
# An angle bracket of steel with a bush of nylon hangs from a wall; its nose is a tenth of a millimetre from a stop. SI units. What an engineer asks first: how often does it swing,
# how hard does it hit, how far does it move, and how far may that be trusted?

# %%
import numpy as np

import signorini as sg

scene = sg.Scene("scenarios/bracket.toml")
modes = sg.modes(scene, 4)
print((modes.to_pandas() / (2 * np.pi)).round(1))

# %% [markdown]
# Frequencies in hertz: with the nose free, and with all of it held at the stop. The motion begins in the first mode, one and a half times as far out as the gap:

# %%
run = sg.run(scene.with_({"probe": [{"name": "corner", "at": [0.0, 0.1], "quantity": ["displacement"]}]}))
table = run.to_pandas()
force = run.resultants["nose"]
hardest = np.hypot(*force.T).argmax()
print(f"{len(run.switches)} switches in {1e3 * run.t_end:.0f} ms; hardest {abs(force[hardest, 0]):.0f} N at {1e3 * run.t[hardest]:.3f} ms")
print(f"largest pressure {run.pressure.max() / 1e6:.0f} MPa; the stop takes {abs(run.forces.impulse[0][0]):.3f} N s")
print(f"the corner moves by {1e6 * np.hypot(*run.probes['corner']['displacement'].T).max():.0f} micrometres")

# %% [markdown]
# Energies, contact, forces and probes stand in a table by time, ready for pandas; displacements of all nodes in an array with named axes, for xarray.

# %%
print(table.filter(like="corner").describe().loc[["min", "max"]].round(7))
print(dict(run.to_xarray().sizes))

# %% [markdown]
# A wider gap, a softer bush: every combination in a process of its own, and a table of what comes of it. (In a script such a call stands under `if __name__ == "__main__":`.)

# %%
values = {"contact.plane": [{"normal": [1.0, 0.0], "offset": x} for x in (0.1001, 0.1002)], "material[1].young": [3e9, 1e9]}
swept = sg.sweep(scene, values)
hits = swept.to_pandas(switches=lambda r: len(r.switches), newton=lambda r: round(float(r.forces.maximum[0]), 1))
print(hits[["material[1].young", "switches", "newton"]])

# %% [markdown]
# The contact force over time. How far it may be trusted the command `signorini trust scenarios/bracket.toml` says: it computes the same with elements of second order and with the
# other discretisation of the contact.

# %%
figure = run.plot()
