"""What all tests share."""

import os

# Two workers with two BLAS threads each only get in each other's way on two cores.
for variable in ("OPENBLAS_NUM_THREADS", "OMP_NUM_THREADS", "MKL_NUM_THREADS"):
    os.environ.setdefault(variable, "1")
