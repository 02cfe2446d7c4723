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
# Errors are those of means over some hundred periods, from the scatter of blocks of them. The model is tested in the same way, but read exactly, with the derivatives of
# what is read by its parameters, the frequency following the phase. What is compared are frequency, amplitude and work at each level, each over its error.

# %%
KEYS = ["contact.gap", "damping.ratio", "contact.stiffness"]


def readings(of):
    return np.concatenate([of.omega, of.amplitude, of.work])


errors = np.concatenate([rig.omega_error, rig.amplitude_error, rig.work_error])


def model(parameters):
    test = sg.phase_resonance(body(*parameters), LEVELS, steps=9, sensitivity=KEYS)
    slopes = [value * readings(test.sensitivity[key]) / errors for key, value in zip(KEYS, parameters)]
    return (readings(rig) - readings(test)) / errors, np.array(slopes).T


first = [1.0, 0.05, 20.0]
print(f"root mean square of misfits, in standard errors: {np.sqrt(np.mean(model(first)[0] ** 2)):.1f}")

# %% [markdown]
# Gap and damping ratio are fitted by least squares (Gauss and Newton); the stiffness of the stop is believed.


# %%
def fit(parameters, free):
    parameters = list(parameters)
    for _ in range(4):
        misfit, slopes = model(parameters)
        columns = slopes[:, free]
        steps = np.linalg.lstsq(columns, misfit, rcond=None)[0]
        for k, step in zip(free, steps):
            parameters[k] *= 1 + step
    spread = np.sqrt(np.diag(np.linalg.inv(columns.T @ columns)))
    return parameters, spread


def tell(parameters, spread, free):
    names = ["gap", "damping ratio", "stop"]
    for k, s in zip(free, spread):
        print(f"{names[k]:<14}{parameters[k]:.5g} ± {100 * s:.2f} %")
    rest = model(parameters)[0]
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
# The rig had a gap of 1.04, a damping ratio of 0.042, and a stop of stiffness 26. How strongly each shows at the highest level, in per cent of frequency, amplitude and
# work for one per cent of the number:

# %%
last = body(*three[0])
test = sg.phase_resonance(last, LEVELS, steps=9, sensitivity=KEYS)
for key, value in zip(KEYS, three[0]):
    by = test.sensitivity[key]
    print(f"{key:<20}" + "".join(f"{value * getattr(by, name)[-1] / getattr(test, name)[-1]:8.3f}" for name in ["omega", "amplitude", "work"]))

# %% [markdown]
# The points of the rig beside the curve of the model that was fitted:

# %%
figure = sg.phase_resonance(last, LEVELS, steps=40).plot()
upper = figure.axes[0]
upper.errorbar(rig.omega, rig.amplitude, xerr=2 * rig.omega_error, yerr=2 * rig.amplitude_error, fmt="o", mfc="none", color="0.2")
