"""What all tests share."""

import os

from hypothesis import settings

# A loaded machine must not fail a test: speed is measured in tests/benchmarks.
# The suite has minutes; MOTORBENCH_EXAMPLES=1000 searches longer.
settings.register_profile("motorbench", deadline=None, max_examples=int(os.environ.get("MOTORBENCH_EXAMPLES", "40")))
settings.load_profile("motorbench")

# Two workers with two BLAS threads each only get in each other's way on two cores.
for variable in ("OPENBLAS_NUM_THREADS", "OMP_NUM_THREADS", "MKL_NUM_THREADS"):
    os.environ.setdefault(variable, "1")
