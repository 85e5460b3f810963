"""What holds for all tests: generated cases are judged by their outcome, never by their time."""

import os

from hypothesis import settings

settings.register_profile("rigwatch", deadline=None, derandomize=os.environ.get("CI") == "true")
settings.load_profile("rigwatch")
