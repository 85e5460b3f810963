"""One simulated rig for all tests here."""

import pytest

from tests.detectors.simulated_rig import SimulatedRig


@pytest.fixture(scope="session")
def rig() -> SimulatedRig:
    return SimulatedRig()
