"""A stretch of a recording has its rows, and what is known of them."""

import numpy as np

from rigwatch.physics.engine.fit.recording import Recording, apart
from rigwatch.physics.transfer import Derivative

DERIVED = (Derivative(40.0, 1, 256.0),)


def three_parts() -> Recording:
    return Recording(
        0.15,
        np.arange(60.0).reshape(30, 2),
        np.arange(30.0)[:, None],
        parts=(10, 12, 8),
        driving=1,
        passed=0.2,
        breaks=(4, 15, 22),
        spacings=(0.1, 0.2, 0.1),
        derived=DERIVED,
    )


def test_a_stretch_keeps_the_boundaries_that_it_spans() -> None:
    cut = three_parts().stretch(4, 24)
    assert cut.parts == (6, 12, 2)
    assert cut.spacings == (0.1, 0.2, 0.1)
    assert cut.dt == np.average([0.1, 0.2, 0.1], weights=[6, 12, 2])
    assert cut.breaks == (0, 11, 18)
    assert cut.outputs[:, 0].tolist() == [*range(4, 24)]
    assert cut.inputs[:, 1].tolist() == [*range(9, 49, 2)]
    assert (cut.driving, cut.passed, cut.derived) == (1, 0.2, DERIVED)


def test_each_recording_apart_has_its_own_rate() -> None:
    first, second, third = apart(three_parts())
    assert [one.dt for one in (first, second, third)] == [0.1, 0.2, 0.1]
    assert not any(one.spacings for one in (first, second, third))
    assert [one.breaks for one in (first, second, third)] == [(4,), (5,), (0,)]
    assert second.outputs[:, 0].tolist() == [*range(10, 22)]
    assert second.passed == 0.2
