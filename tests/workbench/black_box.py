"""The simulated rig under a multisine, and the black box beside a healthy recording of it."""

from functools import cache
from pathlib import Path
from tempfile import TemporaryDirectory

from rigwatch.simulated import write_session
from rigwatch.workbench.study.creation import create
from rigwatch.workbench.study.study import Study
from sim_plant.excitation import Multisine
from sim_plant.scenario import Scenario

TEMPLATE = Path(__file__).parents[2] / "configs" / "studies" / "rig_black_box.toml"


def record(
    folder: Path, name: str, noise: int, phases: int = 1, *, period: int = 1024, **effects: float
) -> None:
    """Writes a session: noise and phases are seeds, the period is in samples."""
    whole = _recorded(name, noise, phases, period, tuple(effects.items()))
    (folder / f"{name}.mcap").write_bytes(whole)


@cache
def _recorded(
    name: str, noise: int, phases: int, period: int, effects: tuple[tuple[str, float], ...]
) -> bytes:
    shape = Multisine(amplitude=2.5, start=0.5, stop=12.0, period=period, seed=phases)
    scenario = Scenario(
        name=name, duration_s=24.0, lead_in_s=8.0, excitation=shape, effects=dict(effects)
    )
    with TemporaryDirectory() as folder:
        path = Path(folder) / f"{name}.mcap"
        write_session(path, scenario, seed=noise)
        return path.read_bytes()


def study(folder: Path, text: str = "") -> Study:
    """A study of `rig.mcap` beside `healthy.mcap`; as the template says it where no text does."""
    template = folder / "template.toml"
    template.write_text(text or TEMPLATE.read_text(encoding="utf-8"), encoding="utf-8")
    return create(folder / "study", template)
