"""The compiled watch is thrown away when anything that is compiled into it has changed."""

import hashlib
import inspect

from monitor import (
    aperiodic,
    departure,
    energies,
    episode,
    estimates,
    isolation,
    reference,
    reference_state,
    verdict,
    watch,
    watch_state,
    window,
)
from rigwatch.physics import transfer_function

SOURCES = (
    aperiodic, departure, energies, episode, estimates, isolation, reference, reference_state,
    verdict, watch_state, window, transfer_function,
)  # fmt: skip


def test_the_fingerprint_is_that_of_the_sources() -> None:
    joined = "".join(inspect.getsource(module) for module in SOURCES)
    fingerprint = hashlib.sha256(joined.encode()).hexdigest()[:12]
    assert fingerprint == watch.FINGERPRINT, f'put FINGERPRINT = "{fingerprint}" in watch.py'
