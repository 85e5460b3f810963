"""rigwatch and what users of SciPy, CasADi, pysindy and SysIdentPy do, on the same data.

python -m benchmarks comparison          # the table
python -m benchmarks.comparing.page      # the same, written to docs/comparison.md
"""
