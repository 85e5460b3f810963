"""A recording cannot decide; the experiment that is proposed does."""

from benchmarks.next_experiment import decide


def test_the_proposed_experiment_tells_a_lopsided_spring_from_a_sensor_s_offset() -> None:
    case = decide("quadratic_stiffness", 3.0, 0.02)
    assert case is not None, "one sine must not be enough"
    assert "offset@position_sensor" in case.rivals
    assert case.proposal
    assert case.right, case
