"""The compiled watch is thrown away when anything that is compiled into it has changed."""

import hashlib
import inspect

from monitor.decision import departure, episode, estimates, isolation
from monitor.decision import isolation_verdict as verdict
from monitor.decision import kernel_state as watch_state
from monitor.decision import sample_kernel as watch
from monitor.estimation import energies, window
from monitor.reference import aperiodic, reference_state
from monitor.reference import learning as reference
from rigwatch.physics.transfer import transfer_function

SOURCES = (
    aperiodic, departure, energies, episode, estimates, isolation, reference, reference_state,
    verdict, watch_state, window, transfer_function,
)  # fmt: skip


def test_the_fingerprint_is_that_of_the_sources() -> None:
    joined = "".join(inspect.getsource(module) for module in SOURCES)
    fingerprint = hashlib.sha256(joined.encode()).hexdigest()[:12]
    assert fingerprint == watch.FINGERPRINT, (
        f'put FINGERPRINT = "{fingerprint}" in sample_kernel.py'
    )
