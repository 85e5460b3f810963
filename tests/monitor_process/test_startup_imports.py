"""A monitor starts quickly: what only other schemes and commissioning use is not imported."""

import subprocess
import sys

SLOW = ("scipy.signal", "scipy.stats", "scipy.optimize", "sympy")


def test_a_monitor_of_the_friction_scheme_imports_nothing_slow() -> None:
    code = f"import sys, monitor.process; print([m for m in {SLOW!r} if m in sys.modules])"
    done = subprocess.run(
        [sys.executable, "-c", code], check=True, capture_output=True, text=True, timeout=60
    )
    assert done.stdout.strip() == "[]"
