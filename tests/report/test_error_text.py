"""How an error with an effect is told beside the one without."""

import pytest

from rigwatch.workbench.fit import error_text


@pytest.mark.parametrize(
    ("value", "told"),
    [
        pytest.param(None, "-", id="not fitted"),
        pytest.param(0.123456, "0.1235", id="an error"),
        pytest.param(8.46e63, "diverges", id="a run that diverged"),
        pytest.param(float("inf"), "diverges", id="one beyond all numbers"),
    ],
)
def test_an_error_far_beyond_the_one_before_is_no_number(value: float | None, told: str) -> None:
    assert error_text(value, 0.5) == told
