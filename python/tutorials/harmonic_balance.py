# %% [markdown]
# # A backbone, and your own harmonic balance checked
#
# Free periodic motions of a half plate on rollers: its nonsmooth modes. First the family that harmonic balance gives, on a few frequencies.

# %%
import numpy as np

import signorini as sg

scene = sg.Scene("scenarios/half-plate-orbit.toml")
series = sg.backbone(scene, method="hbm", harmonics=[3, 15], range=(1.80, 1.84), step=0.01)
print(series)
for name, k in zip(series.branches, range(2)):
    own = series.branch == k
    print(name, np.round(series.energy[own], 5))

# %% [markdown]
# The coefficients are those that you may have from your own program: frequencies `[p]`, coefficients `[p, 2 N_h + 1, n_O]` in the order
# a_0, a_1, b_1, a_2, … of all displacements but those in contact. Here they are, as if they were yours:

# %%
mine = series.branch[series.hbm.point] == 1
omega, coefficients = series.hbm.omega[mine], series.hbm.coefficients[mine]
print(omega, coefficients.shape)

# %% [markdown]
# Is each a true motion? The cross-check puts the series into the equations in time (`residual`), starts the exact integrator on it, and shoots for an orbit from
# there; `moved` is how far that orbit is from the series, relative.

# %%
checked = sg.crosscheck((omega, coefficients), scene)
for k in range(len(checked)):
    print(f"{checked.omega[k]:.2f}  residual in time {checked.residual[k]:.1e}  {checked.verdict[k]:<10} moved {checked.moved[k]:.1e}")

# %% [markdown]
# So these series satisfy the balance of fifteen harmonics to machine precision, the equations in time to a few per cent, and the orbits that shooting reaches from
# them are tens of per cent away: none of the five is a motion of this mesh. An orbit is:

# %%
o = sg.orbit(scene, 1.8)
print(o)
print(f"residual {o.residual:.1e}, largest multiplier {o.largest_multiplier:.4f}, touches for {o.contact_time / o.period:.3f} of the period")

# %% [markdown]
# Not every frequency has one, and the verdict says why. It is a value, not an exception:

# %%
nothing = sg.orbit(scene, 2.07)
print(bool(nothing), "-", nothing.message)

# %% [markdown]
# Orbits like these are exact for their mesh, but have no limit under refinement. The *viscous* nonlinear mode has one (`viscous=True`); a family of it comes with
# a statement of its errors.

# %%
viscous = sg.orbit("scenarios/half-plate-viscous.toml", 1.8, viscous=True)
print(f"energy {viscous.energy:.5f}, alpha {viscous.alpha:.6f}, handed round a period {viscous.energy_turned_over:.4f}")
figure = checked.plot()
