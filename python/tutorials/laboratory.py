# %% [markdown]
# # From the laboratory
#
# A test rig has a mass before a stop, a shaker and a controller that holds the frequency where the displacement lags a quarter of a period behind the force: a test of
# phase resonance. It measures the *backbone*: frequency against amplitude, level by level of the force. A model is at hand, with a gap that was set by a feeler
# gauge and a damping ratio from a handbook. What does the test say of both, how well, and what does it leave unexplained?
#
# The rig is played by the program: a body whose gap, damping and stop are not those of the model, and readings that are off by one per cent a period.

# %%
import numpy as np

import signorini as sg

LEVELS = {"load[0].amplitude": (0.05, 0.3)}


def body(gap, ratio, stop):
    return sg.Scene.from_matrices(
        [[1.0]],
        [[1.0]],
        contact=[0],
        gap=gap,
        title="A mass before an elastic stop",
        contact_table={"method": "penalty", "stiffness": float(stop)},
        damping={"ratio": float(ratio), "mode": 1},
        load=[{"kind": "force", "displacement": 0, "amplitude": 0.2, "omega": 1.2}],
    )


rig = sg.phase_resonance(body(1.04, 0.042, 26.0), LEVELS, steps=9, noise=0.01, seed=5)
print(rig)
for k in range(0, len(rig), 3):
    print(f"force {rig.value[k]:.3f}: frequency {rig.omega[k]:.5f} ± {rig.omega_error[k]:.5f}, amplitude {rig.amplitude[k]:.4f} ± {rig.amplitude_error[k]:.4f}")

# %% [markdown]
# Errors are those of means over some hundred periods, from the scatter of blocks of them. The model is tested in the same way, but read exactly. What is compared are
# frequency, amplitude and work at each level, each over its error.


# %%
def readings(test):
    return np.concatenate([test.omega, test.amplitude, test.work])


errors = np.concatenate([rig.omega_error, rig.amplitude_error, rig.work_error])


def model(parameters):
    return readings(sg.phase_resonance(body(*parameters), LEVELS, steps=9, tolerance=1e-8))


def misfit(parameters):
    return (readings(rig) - model(parameters)) / errors


first = [1.0, 0.05, 20.0]
print(f"root mean square of misfits, in standard errors: {np.sqrt(np.mean(misfit(first) ** 2)):.1f}")

# %% [markdown]
# Gap and damping ratio are fitted by least squares (Gauss and Newton); the stiffness of the stop is believed.


# %%
def slopes(parameters, free):
    # per cent for per cent: what a parameter does is seen by one a little larger
    columns, here = [], model(parameters)
    for k in free:
        beside = list(parameters)
        beside[k] *= 1.001
        columns.append((model(beside) - here) / errors / 0.001)
    return np.array(columns).T


def fit(parameters, free):
    parameters = list(parameters)
    for _ in range(4):
        columns = slopes(parameters, free)
        steps = np.linalg.lstsq(columns, misfit(parameters), rcond=None)[0]
        for k, step in zip(free, steps):
            parameters[k] *= 1 + step
    spread = np.sqrt(np.diag(np.linalg.inv(columns.T @ columns)))
    return parameters, spread


def tell(parameters, spread, free):
    names = ["gap", "damping ratio", "stop"]
    for k, s in zip(free, spread):
        print(f"{names[k]:<14}{parameters[k]:.5g} ± {100 * s:.2f} %")
    rest = misfit(parameters)
    print(f"{'left':<14}{np.sqrt(np.sum(rest**2) / (len(rest) - len(free))):.2f} standard errors")


two = fit(first, [0, 1])
tell(*two, [0, 1])

# %% [markdown]
# Were the model right but for noise, about one standard error would be left. More than that is: the stop is not what it is believed to be. With its stiffness free
# as well:

# %%
three = fit(two[0], [0, 1, 2])
tell(*three, [0, 1, 2])

# %% [markdown]
# The rig had a gap of 1.04, a damping ratio of 0.042, and a stop of stiffness 26. How strongly each shows, to first order, an orbit says by itself: of the largest
# displacement and the largest pressure, in per cent for one per cent of the number, at a load of 0.2 and a frequency of 1.05:

# %%
gap, ratio, stop = three[0]
last = body(gap, ratio, stop)
o = sg.orbit(last, 1.05, sensitivity=["contact.gap", "damping.ratio", "contact.stiffness"])
for key, s in o.sensitivity.items():
    print(f"{key:<20}{s.amplitude / o.peaks['amplitude']['value'] * s.value:8.3f}{s.pressure / o.peaks['pressure']['value'] * s.value:8.3f}")

# %% [markdown]
# The points of the rig beside the curve of the model that was fitted:

# %%
figure = sg.phase_resonance(last, LEVELS, steps=40).plot()
upper = figure.axes[0]
upper.errorbar(rig.omega, rig.amplitude, xerr=2 * rig.omega_error, yerr=2 * rig.amplitude_error, fmt="o", mfc="none", color="0.2")
