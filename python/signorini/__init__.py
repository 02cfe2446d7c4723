"""Reference solutions for the vibration of elastic bodies in unilateral (Signorini) contact.

>>> import signorini as sg
>>> r = sg.run("scenarios/plate.toml")                       # doctest: +SKIP
>>> o = sg.orbit("scenarios/half-plate-orbit.toml", 1.8)     # doctest: +SKIP
>>> b = sg.backbone("scenarios/half-plate-orbit.toml")       # doctest: +SKIP

A ``Scene`` says what is computed: a TOML file, a dict, or matrices of another program. Functions return objects whose attributes
have the names of the JSON keys of the command line, arrays as NumPy arrays; ``open`` reads files of results. Numerical outcomes
are values; bad input is a ``SceneError`` with file, line and key. Units are those of the scene.
"""

from ._commands import backbone, bands, basins, compare, crosscheck, curve, diagram, modes, orbit, orbits, phase_resonance, response, run, tori, trust
from ._errors import FileError, NumericsError, SceneError, SignoriniError
from ._files import Group
from ._mesh import Mesh
from ._results import (
    Attractor,
    Bands,
    Basins,
    Comparison,
    Crosscheck,
    Curve,
    Curves,
    Diagram,
    Family,
    Figure,
    Modes,
    Orbit,
    OrbitFound,
    PhaseResonance,
    Point,
    Result,
    Run,
    Tori,
    Trust,
    Verdict,
    open,
)
from ._scene import Scene
from ._sweep import Failure, Sweep, sweep
from ._signorini import __version__

__all__ = [
    "Attractor",
    "Bands",
    "Basins",
    "Comparison",
    "Crosscheck",
    "Curve",
    "Curves",
    "Diagram",
    "Failure",
    "Family",
    "Figure",
    "FileError",
    "Group",
    "Mesh",
    "Modes",
    "NumericsError",
    "Orbit",
    "OrbitFound",
    "PhaseResonance",
    "Point",
    "Result",
    "Run",
    "Scene",
    "SceneError",
    "SignoriniError",
    "Sweep",
    "Tori",
    "Trust",
    "Verdict",
    "__version__",
    "backbone",
    "bands",
    "basins",
    "compare",
    "crosscheck",
    "curve",
    "diagram",
    "modes",
    "open",
    "orbit",
    "orbits",
    "phase_resonance",
    "response",
    "run",
    "sweep",
    "tori",
    "trust",
]
