"""Measurements of speed and memory; `python -m benchmarks` prints them as one report."""

import os

# Linear algebra takes one thread, which is to be said before numpy is loaded.
os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")
