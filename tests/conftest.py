"""What holds for all tests: generated cases are judged by their outcome, never by their time."""

import os

from hypothesis import settings

os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")  # as the commands do, before NumPy is imported
settings.register_profile("rigwatch", deadline=None, derandomize=os.environ.get("CI") == "true")
settings.load_profile("rigwatch")
