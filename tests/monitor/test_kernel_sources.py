"""Compiled watches are thrown away when anything that is compiled into them has changed."""

import hashlib
import inspect
from types import ModuleType

import pytest

from monitor.decision import departure, episode, estimates, isolation, sample_kernel
from monitor.decision import isolation_verdict as verdict
from monitor.decision import kernel_state as watch_state
from monitor.estimation import energies, window
from monitor.observer import decision_state, observer_decision, window_statistics
from monitor.reference import aperiodic, reference_state
from monitor.reference import learning as reference
from rigwatch.physics.transfer import transfer_function

SOURCES: dict[ModuleType, tuple[ModuleType, ...]] = {
    sample_kernel: (
        aperiodic, departure, energies, episode, estimates, isolation, reference, reference_state,
        verdict, watch_state, window, transfer_function,
    ),
    observer_decision: (decision_state, window_statistics),
}  # fmt: skip


@pytest.mark.parametrize("kernel", SOURCES, ids=lambda module: module.__name__)
def test_the_fingerprint_is_that_of_the_sources(kernel: ModuleType) -> None:
    joined = "".join(inspect.getsource(module) for module in SOURCES[kernel])
    fingerprint = hashlib.sha256(joined.encode()).hexdigest()[:12]
    assert fingerprint == kernel.FINGERPRINT, (
        f'put FINGERPRINT = "{fingerprint}" in {kernel.__name__}'
    )
