"""Memory limit for foreign files: a few kilobytes may decompress to gigabytes."""

BASE, RATIO = 1 << 25, 50
"""Memory allowed for any file [bytes], plus the memory per byte of the file."""


class Budget:
    """The remaining memory that a file of `size` bytes may use."""

    def __init__(self, size: int) -> None:
        self.left = BASE + RATIO * size

    def take(self, wanted: int) -> None:
        """Use `wanted` bytes.

        Raises:
            ValueError: fewer bytes remain.
        """
        if wanted > self.left:
            raise ValueError(f"unpacks to more than {self.left >> 20} MB, expected less")
        self.left -= wanted
