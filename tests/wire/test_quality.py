"""Which flags keep a sample out, and how they are named."""

import numpy as np

from rigwatch.wire.messages import quality_flags as quality


def test_every_flag_has_a_name_and_a_bit_of_its_own():
    bits = list(quality.NAMES)
    assert np.bitwise_or.reduce(bits) == sum(bits)
    assert [quality.describe(bit) for bit in bits] == list(quality.NAMES.values())


def test_only_defects_keep_a_sample_out():
    flags = np.array([quality.GOOD, quality.RESAMPLED, quality.STUCK, quality.NON_FINITE], np.uint8)
    assert quality.valid(flags).tolist() == [True, True, False, False]
    assert quality.describe(quality.GOOD) == "good"
