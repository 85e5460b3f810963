"""Stores samples in a rig's ring from a compiled call."""

from rigwatch.wire.arrays import FloatArray, IntArray
from rigwatch.wire.delivery import RingArrays
from rigwatch.wire.kernel import part
from rigwatch.wire.messages import ByteArray


@part()
def put_run(  # noqa: PLR0917
    ring: RingArrays,
    first: int,
    device_us: IntArray,
    t_ns: IntArray,
    values: FloatArray,
    quality: ByteArray,
) -> None:
    """Store consecutive samples as `RingStore.add` does, no more than it has room for.

    Args:
        ring: filled.
        first: number of the first one.
        device_us, t_ns: shape (n,).
        values, quality: shape (n, channels).
    """
    for k in range(t_ns.size):
        row = (first + k) % ring.seq.size
        ring.seq[row], ring.device_us[row], ring.t_ns[row] = first + k, device_us[k], t_ns[k]
        for c in range(values.shape[1]):
            ring.values[c, row], ring.quality[c, row] = values[k, c], quality[k, c]
