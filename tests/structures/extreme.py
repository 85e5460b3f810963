"""The Kabe antenna with everything unknown."""

from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import msgspec
import numpy as np

from rigwatch.structures.model.checks import load_structure
from rigwatch.structures.model.description import Load, Structure, coefficient
from rigwatch.structures.records.record import Record
from sim_plant.structure import simulate, with_noise

FILE = Path(__file__).parents[2] / "configs" / "structures" / "kabe_antenna.toml"


@dataclass
class Extreme:
    """The case that was given up in 1999: everything unknown, of the antenna or another structure.

    Each node is pushed by six sines; each spring has a cubic coefficient of 10 to 20 % of its
    stiffness per m². Guesses are off by up to 30 %, those of the cubic coefficients are zero.
    """

    file: Path = FILE
    noise: float = 0.0
    force: float = 40.0
    dt: float = 0.01
    truth: dict[str, float] = field(default_factory=dict)
    loads: dict[str, Any] = field(default_factory=dict)
    values: dict[str, float] = field(default_factory=dict)

    def __post_init__(self) -> None:
        random, structure = np.random.default_rng(4), load_structure(self.file)
        for name, node in structure.nodes.items():
            mass = coefficient(node.mass).value
            size = self.force if mass > 0.5 else 0.01 * self.force
            omegas, phases = random.uniform(5, 45, 6), random.uniform(0, 6.28, 6)
            sines = [
                {"amplitude": size, "omega": float(w), "phase": float(p)}
                for w, p in zip(omegas, phases, strict=True)
            ]
            self.loads[f"push{name}"] = {"node": name, "sines": sines}
            self.truth[f"m{name}"] = mass
        for name, spring in structure.springs.items():
            stiffness = coefficient(spring.stiffness).value
            cubic = 0.1 * stiffness * (1 + random.uniform(0, 1))
            self.truth |= {name: stiffness, f"{name}_cubic": cubic}
            self.values[f"springs.{name}.cubic"] = cubic

    def guesses(self) -> dict[str, float]:
        """Where the identification starts."""
        random = np.random.default_rng(5)
        return {
            name: 0.0 if name.endswith("cubic") else value * (1 + random.uniform(-0.3, 0.3))
            for name, value in self.truth.items()
        }

    def structure(self) -> Structure:
        """The structure under these loads."""
        loads = msgspec.convert(self.loads, dict[str, Load])
        return msgspec.structs.replace(load_structure(self.file), loads=loads)

    def record(self, duration: float = 10.0) -> Record:
        """Positions of all nodes."""
        made = simulate(self.file, self.dt, duration, loads=self.loads, values=self.values)
        positions = [f"x{node}" for node in load_structure(self.file).nodes]
        made = with_noise(made, dict.fromkeys(positions, self.noise), 1, normal=True)
        return Record(self.dt, {name: made.columns[name] for name in positions})
