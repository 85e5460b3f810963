"""Makes the helper modules beside the tests importable, and the simulated rig one for all tests."""

import sys
from pathlib import Path

import pytest

sys.path.insert(0, str(Path(__file__).parent))

from simulated_rig import SimulatedRig


@pytest.fixture(scope="session")
def rig() -> SimulatedRig:
    return SimulatedRig()
