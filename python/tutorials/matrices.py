# %% [markdown]
# # A body from another finite-element program
#
# Whatever has a mass and a stiffness matrix can be a body. Here a chain of masses stands for your program: a bar of twenty linear elements, held at the left,
# whose right end meets an obstacle.

# %%
import numpy as np
import scipy.sparse as sp

import signorini as sg

n, h = 20, 1 / 20
ones = np.ones(n)
K = sp.diags([-ones[1:], 2 * ones, -ones[1:]], [-1, 0, 1]).tolil() / h
M = sp.diags([ones[1:], 4 * ones, ones[1:]], [-1, 0, 1]).tolil() * h / 6
K[n - 1, n - 1], M[n - 1, n - 1] = 1 / h, 2 * h / 6

# %% [markdown]
# The displacement that the obstacle limits is the last one, at a gap of 1. For the nodal boundary method the stress there is `N_C u_C + N_O u_O`: of a linear
# element E (u_n - u_{n-1}) / h.

# %%
N_C = np.array([[1 / h]])
N_O = np.zeros((1, n - 1))
N_O[0, -1] = -1 / h
scene = sg.Scene.from_matrices(
    M, K, contact=[n - 1], gap=1.0, N_C=N_C, N_O=N_O,
    initial={"mode": 1, "amplitude": -1.1}, run={"until": 8.0, "integrator": "modal"},
)
r = sg.run(scene)
print(r)

# %% [markdown]
# The same bar made by the program itself:

# %%
bar = sg.Scene({
    "body": {"kind": "bar", "size": [1.0], "elements": [n], "young": 1.0, "density": 1.0},
    "support": [{"edge": "left", "fix": ["x"]}],
    "contact": {"edge": "right", "gap": 1.0, "stress": "nodal-mean"},
    "initial": {"mode": 1, "amplitude": -1.1},
    "run": {"until": 8.0, "integrator": "modal"},
})
own = sg.run(bar)
print(f"switching times differ by {np.abs(r.switches.t - own.switches.t).max():.1e}")

# %% [markdown]
# Without `N_C`, `N_O` the stress is the nodal reaction, which needs nothing but M and K. In general that is another discretisation of the same contact; for linear
# elements in a row it is the same stress:

# %%
reaction = sg.run(sg.Scene.from_matrices(
    M, K, contact=[n - 1], gap=1.0, initial={"mode": 1, "amplitude": -1.1}, run={"until": 8.0, "integrator": "modal"},
))
print(f"switching times differ by {np.abs(r.switches.t - reaction.switches.t).max():.1e}")

# %% [markdown]
# For the command line, or a colleague: the scene and its matrices as files.

# %%
scene.save("bar-from-matrices.toml", overwrite=True)
print(np.array_equal(sg.run("bar-from-matrices.toml").u, r.u))
