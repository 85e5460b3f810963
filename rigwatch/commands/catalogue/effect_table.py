"""Effects as text: a table of all, the details of one, and the tables of the index page."""

from collections.abc import Mapping

from rigwatch.physics.engine.equations import Effect, EffectParameter, library

KINDS = {
    "force": "Forces, torques, flows, currents and powers",
    "actuator": "Drives",
    "signal": "Drives and sensors",
    "sensor": "Sensors",
}
"""Kinds of ports with the headings of their effects."""


RARER = " °"
"""Marks effects that are tried only where a study asks for the whole library."""


def listed() -> dict[str, dict[str, Effect]]:
    """The library's effects by kind of port."""
    found = library()
    return {kind: {n: e for n, e in found.items() if e.port == kind} for kind in KINDS}


def described(name: str, effect: Effect) -> list[str]:
    """The details of one effect, as lines."""
    lines = [
        f"{name}: {effect.physics}",
        "",
        f"  enters     at a port of kind {effect.port}",
        f"  expression {effect.expression}",
    ]
    lines += [f"  state {n:4} d/dt = {s.derivative}" for n, s in effect.states.items()
              if s.derivative]  # fmt: skip
    lines += [f"  state {n:4} at each sample = {s.update}" for n, s in effect.states.items()
              if s.update]  # fmt: skip
    lines += [f"  parameter  {_parameter(n, p)}" for n, p in effect.parameters.items()]
    lines.append(f"  source     {effect.source}")
    if effect.confused_with:
        lines.append(f"  looks like {', '.join(effect.confused_with)}")
    if effect.elective:
        lines.append("  rarer      tried with whole_library = true in the study")
    if effect.refines:
        lines.append(f"  refines    {effect.refines}, which is tried first")
    return lines


def _parameter(name: str, p: EffectParameter) -> str:
    scale = f" times the size of {p.scale}" if p.scale else ""
    bounds = f", from {p.low:g} to {p.high:g}" if p.low > float("-inf") else ""
    return f"{name} [{p.unit}], {p.role}, {p.value:g}{bounds}{scale}"


def markdown(effects: Mapping[str, Mapping[str, Effect]]) -> str:
    """The index page's tables."""
    parts = []
    for kind, found in effects.items():
        rows = [
            f"| `{name}`{RARER * e.elective} | `{_shown(e.expression)}` | {e.physics} | {_like(e)}"
            f" | {e.source} |"
            for name, e in sorted(found.items())
        ]
        head = ["| effect | expression | physics | looks like | source |", "| --- " * 5 + "|"]
        parts.append("\n".join([f"## {KINDS[kind]}", "", *head, *rows]))
    return "\n\n".join(parts) + "\n"


def _shown(expression: str) -> str:
    return expression if len(expression) <= 90 else f"{expression[:87]}…"


def _like(effect: Effect) -> str:
    return ", ".join(f"`{name}`" for name in effect.confused_with)
