"""How much memory a foreign file may ask for: packed, a few kilobytes can mean gigabytes."""

BASE, RATIO = 1 << 25, 50
"""Bytes that any file may take, and bytes more for each of its own."""


class Budget:
    """What is left of the bytes that a file of `size` bytes may take."""

    def __init__(self, size: int) -> None:
        self.left = BASE + RATIO * size

    def take(self, wanted: int) -> None:
        """Use up `wanted` bytes.

        Raises:
            ValueError: so many are not left.
        """
        if wanted > self.left:
            raise ValueError(f"unpacks to more than {self.left >> 20} MB, expected less")
        self.left -= wanted
