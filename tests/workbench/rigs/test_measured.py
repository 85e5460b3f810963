"""Silverbox, EMPS in open loop and the pneumatic cylinder: what the workbench must find there."""

from pathlib import Path

import pytest

from rigwatch.wire.errors import ConfigError
from rigwatch.workbench.compare.compare import compare
from rigwatch.workbench.explain.explain import explain
from rigwatch.workbench.steps.change import add
from rigwatch.workbench.study.creation import create
from rigwatch.workbench.study.study import open_study
from tests.workbench.conftest import CONFIGS

pytestmark = pytest.mark.long


@pytest.mark.nightly
def test_a_cubic_spring_is_named_in_silverbox(silverbox: Path, tmp_path: Path) -> None:
    found = explain(create(tmp_path / "s", CONFIGS / "studies" / "silverbox.toml", silverbox))
    assert found.verdict == "missing_effect"
    assert (found.ranking[0].effect, found.ranking[0].port) == ("cubic_stiffness", "load")


@pytest.mark.nightly
def test_silverbox_has_a_cubic_spring_and_no_quadratic_one(silverbox: Path, tmp_path: Path) -> None:
    study = create(tmp_path / "s", CONFIGS / "studies" / "silverbox.toml", silverbox)
    refused = add(study, "quadratic_stiffness")
    assert refused.step == "refused"
    add(study, "cubic_stiffness")
    study = open_study(study.folder)
    # The generator's zero is 6 mV off: visible once the spring no longer hides it.
    change = add(study, "offset", "drive")
    assert change.after.channels["output"].held_out_error < 1e-3


@pytest.mark.nightly
def test_emps_in_open_loop_beats_the_published_grey_box(emps: Path, tmp_path: Path) -> None:
    study = create(tmp_path / "s", CONFIGS / "studies" / "emps_position.toml", emps)
    error = compare(study).channels["position"].free_run_error
    assert error is not None
    assert error < 3.98e-3


@pytest.mark.nightly
def test_one_recording_of_the_cylinder_cannot_tell_viscous_from_coulomb(
    cylinder: Path, tmp_path: Path
) -> None:
    study = create(tmp_path / "s", CONFIGS / "studies" / "pneumatic_cylinder.toml", cylinder)
    found = explain(study)
    assert found.verdict == "undetermined"
    named = {f"{found.ranking[0].effect}@{found.ranking[0].port}", *found.rivals}
    assert {"viscous@seal", "coulomb@seal"} <= named
    experiment = found.next_experiment
    assert experiment is not None
    # Many speeds in one recording, instead of the two that it holds.
    assert "speed" in experiment.shape or "sine" in experiment.shape
    assert min(experiment.separation.values()) > 2 * min(experiment.now.values())


def test_a_session_that_is_not_there_is_named_and_nothing_is_made(
    cylinder: Path, tmp_path: Path
) -> None:
    with pytest.raises(ConfigError, match=r"file of this name in .*; --sessions names"):
        create(tmp_path / "s", CONFIGS / "studies" / "emps.toml", cylinder)
    assert not (tmp_path / "s" / "study.toml").exists()
