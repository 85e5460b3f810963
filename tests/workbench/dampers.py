"""Recordings of a damper whose force has been made here, studied with effects of one's own."""

from collections.abc import Callable
from pathlib import Path

import numpy as np

from rigwatch.workbench.steps.change import learn
from rigwatch.workbench.study.study import Study
from tests.workbench.machine import studied
from tests.workbench.studies.test_recordings_apart import DAMPER, UNITS

Force = Callable[[np.ndarray, np.ndarray], np.ndarray]
LIBRARY = """
[effects.{name}]
port = "force"
expression = "{expression}"
physics = "Made for a test."
source = "a test"
{parameters}
"""


def stroke(seed: int, force: Force, noise: float = 0.2) -> dict[str, np.ndarray]:
    """Twelve seconds of displacement, speed and force, 3 N s/m of it viscous."""
    generator = np.random.default_rng(seed)
    t = np.arange(1200) / 100
    phases = generator.uniform(0, 6, 3)
    x = 0.012 * sum(
        np.sin(2 * np.pi * f * t + p) for f, p in zip((0.3, 0.7, 1.1), phases, strict=True)
    )
    v = np.gradient(x, 0.01)
    return {"x": x, "v": v, "force": 3 * v + force(x, v) + noise * generator.normal(size=len(t))}


def damper(folder: Path, force: Force, own: str = "") -> Study:
    """The study of such a damper; `own` is a file of effects."""
    study = studied(folder / "made", DAMPER, [stroke(0, force)], [stroke(1, force)], UNITS)
    if not own:
        return study
    path = folder / "own.toml"
    path.write_text(own)
    return learn(study, path)[0]


def effect(name: str, expression: str, **parameters: str) -> str:
    """An effect as its file writes it; parameters as inline tables."""
    lines = [f"parameters.{key} = {{ {value} }}" for key, value in parameters.items()]
    return LIBRARY.format(name=name, expression=expression, parameters="\n".join(lines))
