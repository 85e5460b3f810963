"""The editor of own effects and models: initial texts, and checked texts with their pictures."""

from pathlib import Path
from typing import Any

import numpy as np

from rigwatch.page import Plot, limits
from rigwatch.physics.engine.equations import Model, model_text
from rigwatch.workbench.catalogue import Curve, Draft, draft_of_effects, draft_of_model
from rigwatch.workbench.study import Study

WIDTH, HEIGHT, NUMBERS = 320, 200, 40
"""Size of a picture [pixels], and most rows of its table."""
BEGIN = """# An own effect: a force at a port of kind "{port}", as a function of {names}.
# Other kinds of ports: "actuator" and "sensor", where u is the signal that arrives.

[effects.my_effect]
port = "{port}"
expression = "{expression}"
physics = "What happens, in a sentence."
source = "own"

[effects.my_effect.parameters.k]
unit = "{unit}"
role = "strength"
"""


def first_text(study: Study, kind: str) -> tuple[str, str]:
    """Name and content of the file that the editor opens: an own one, or one to begin with."""
    if kind == "model":
        return _first_model(study.file.model, study.folder)
    for name in study.file.effect_files:
        return Path(name).name, study.own_files[name]
    ports = {port.kind for port in study.model.ports.values()}
    if "force" in ports:
        words = {"port": "force", "names": "x and v", "expression": "k*v", "unit": "{F}/({v})"}
    else:
        port = min(ports, default="sensor")
        words = {"port": port, "names": "u", "expression": "u + k*u", "unit": "1"}
    text = BEGIN
    for name, value in words.items():
        text = text.replace(f"{{{name}}}", value)
    return "my_effects.toml", text


def _first_model(name: str, folder: Path) -> tuple[str, str]:
    """A model's own file, or a copy of a shipped one under another name."""
    if name.endswith(".toml"):
        return Path(name).name, (folder / name).read_text(encoding="utf-8")
    text = model_text(name).replace(f'name = "{name}"', f'name = "my-{name}"', 1)
    return f"my-{name}.toml", text


def begun_model(name: str) -> tuple[str, str]:
    """Name and content of a copy of a shipped model."""
    return _first_model(name, Path())


def checked(kind: str, name: str, text: str, model: Model | None) -> dict[str, Any]:
    """A text's problems, and the pictures of what it describes."""
    if kind == "effect" and model is not None:
        draft = draft_of_effects(text, name, model)
    else:
        draft = draft_of_model(text, name)
    return {
        "usable": draft.usable,
        "problems": [vars(one) for one in draft.problems],
        "told": draft.told,
        "figures": _figures(draft),
    }


def _figures(draft: Draft) -> list[dict[str, Any]]:
    return [
        {"title": f"{name}: {curve.up} against {curve.across}", **_figure(name, curve)}
        for name, curves in draft.drawn.items()
        for curve in curves
    ]


def _figure(name: str, curve: Curve) -> dict[str, Any]:
    """A curve as SVG, and some of its points for the table beside it."""
    plot = Plot(
        f"{name}: {curve.up} against {curve.across}", limits(curve.x), limits(curve.y),
        curve.across, curve.up, WIDTH, HEIGHT,
    )  # fmt: skip
    plot.line(curve.x, curve.y, "held", width=2)
    taken = np.unique(np.linspace(0, len(curve.x) - 1, NUMBERS).astype(int))
    points = np.stack([curve.x[taken], curve.y[taken]], axis=1)
    return {
        "svg": str(plot.drawn()),
        "axes": [curve.across, curve.up],
        "points": [[float(f"{value:.5g}") for value in row] for row in points.tolist()],
    }
