# %% [markdown]
# # First run
#
# A clamped plate meets a rigid obstacle with its right edge. The scene is a file; everything in it can be changed from here.

# %%
import numpy as np

import signorini as sg

scene = sg.Scene("scenarios/plate.toml")
r = sg.run(scene)
print(r)
print(f"energy drift inside phases {r.energy_drift:.1e}, largest penetration {r.max_penetration:.1e}")

# %% [markdown]
# Arrays are NumPy arrays. `u` has all displacements, the contact displacements included; `mesh.dof_map` says which column is which. The contact
# displacements along the normals are ready made.

# %%
print(r.t.shape, r.u.shape, r.pressure.shape)
gap_left = r.mesh.gap - r.contact_displacement
print(f"touching during {np.ptp(r.t[r.active.any(axis=1)]):.4f} of {r.t_end}; smallest gap {gap_left.min():.1e}")
print(r.switches[:1])

# %% [markdown]
# The first switch is that of the middle of the edge; two nodes as far from it follow together. Why does the energy fall at them? With the paper's
# inertia the mass of a contact node is another one in contact: each switch has its jump, which the ledger keeps apart from the drift.

# %%
print(f"sum of the jumps {r.energy_jumps:.6f}, change of the energy {r.energy_end - r.energy_start:.6f}")

# %% [markdown]
# The same plate with one inertia in every phase loses nothing:

# %%
constant = sg.run(scene.with_(contact__inertia="constant"))
change = constant.energy_end - constant.energy_start
print("kept to ten digits:", abs(change) < 1e-10 * constant.energy_start)

# %% [markdown]
# A picture, and the file for later (or for `signorini plot`, ParaView, MATLAB):

# %%
figure = r.plot()
r.save("plate.h5", overwrite=True)
again = sg.open("plate.h5")
print(np.array_equal(again.u, r.u))

# %% [markdown]
# What is wrong in a scene is said with its place:

# %%
try:
    scene.with_(contact__edge="upper")
except sg.SceneError as e:
    print(e.key, "in line", e.line, "-", e.message)
    print(e.help)
