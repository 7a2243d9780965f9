"""How every process of the test run is set up, before anything heavy is imported."""

import os
import sys

os.environ.setdefault("OMP_NUM_THREADS", "1")  # the runner has a process for each core
# Hundreds of processes are started: one that compiles scipy and matplotlib anew takes seconds longer.
os.environ.pop("PYTHONDONTWRITEBYTECODE", None)
sys.dont_write_bytecode = False
