"""Files of arrays as a table's lines: MATLAB's .mat and NumPy's .npy and .npz, for captures and for tables of a map alike."""

import zipfile
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from bench.captures.capture import CaptureError
from bench.captures.units import split_heading
from drivers.interfaces.text import Text, text

Array = NDArray[Any]

#: So many numbers are read at most.
_MOST = 20_000_000
_NPY, _ZIP, _HDF5 = b"\x93NUMPY", b"PK\x03\x04", b"\x89HDF\r\n\x1a\n"
#: MATLAB's own text stands before the HDF5 of its version 7.3.
_BEFORE_HDF5 = 512
#: How PicoScope's files tell the times of their samples (PicoScope 6 User's Guide, binary formats).
_START, _INTERVAL = "Tstart", "Tinterval"
#: What marks a separator in a table's line, and is none in a name.
_MARKS = str.maketrans(",;\t\n", "    ")


def array_lines(path: Path) -> list[str] | None:
    """Return the lines of a comma-separated table, with a heading where its columns have names; None for a file of another kind.

    Columns are vectors of one length by their names, structures' fields, matrices of one shape (a grid) with the vectors of its axes, the
    columns of matrices beside vectors of one side, or the columns of one matrix. Raises CaptureError for arrays that make no table.
    """
    try:
        with path.open("rb") as file:
            begin = file.read(_BEFORE_HDF5 + len(_HDF5))
    except OSError:
        # The reader of text says what it is.
        return None
    if begin.startswith(b"MATLAB") and begin.endswith(_HDF5):
        raise _refused(path, text("is of MATLAB's version 7.3; save it again with save('FILE.mat', 'NAME', …, '-v7')"))
    # Where there is no zero byte it is a text with another ending.
    matlab = begin.startswith(b"MATLAB 5.0") or (path.suffix.lower() == ".mat" and b"\0" in begin)
    if not matlab and not begin.startswith(_NPY) and not (begin.startswith(_ZIP) and path.suffix.lower() == ".npz"):
        return None
    try:
        named = _of_matlab(path) if matlab else _of_numpy(path, begin.startswith(_NPY))
    except CaptureError:
        raise
    except Exception as error:
        # What a damaged file raises is in no list.
        raise _refused(path, text("cannot be read: {error}; save it again", error=f"{error}")) from error
    names, columns = _columns(path, named)
    rows = [",".join(row) for row in zip(*(each.astype(np.str_).tolist() for each in columns), strict=True)]
    return [",".join(name.translate(_MARKS) for name in names), *rows] if any(names) else rows


def _refused(path: Path, what: Text) -> CaptureError:
    return CaptureError(str(path), what)


def _check_size(path: Path, count: float) -> None:
    if count > _MOST:
        raise _refused(
            path, text("holds more than {most} million numbers; save a shorter part", most=_MOST // 1_000_000)
        )


def _of_numpy(path: Path, single: bool) -> dict[str, Array]:
    if not single:
        with zipfile.ZipFile(path) as members:
            _check_size(path, sum(member.file_size for member in members.infolist()) / 8)
    else:
        _check_size(path, path.stat().st_size / 8)
    try:
        # What is pickled runs a program when it is read.
        read = np.load(path, allow_pickle=False)
        named = {"": read} if single else {name: read[name] for name in read.files}
        if others := [name for name, value in named.items() if not isinstance(value, np.ndarray)]:
            raise _refused(path, text("holds other files than arrays: {others}; unpack it", others=others))
    except CaptureError:
        raise
    except ValueError as error:
        if "pickle" not in str(error):
            raise
        raise _refused(path, text("holds objects, which are not read; save arrays of numbers")) from error
    return _fields(path, named)


def _of_matlab(path: Path) -> dict[str, Array]:
    from scipy.io import loadmat, whosmat  # takes a while to load

    _check_size(path, sum(float(np.prod(shape, dtype=float)) for _, shape, _ in whosmat(path)))
    found = loadmat(path, squeeze_me=True)
    return _fields(path, {name: np.asarray(value) for name, value in found.items() if not name.startswith("__")})


def _fields(path: Path, named: Mapping[str, Array]) -> dict[str, Array]:
    """Return arrays of numbers by name, a structure's fields by theirs; words are left out. Raises CaptureError for other things."""
    result: dict[str, Array] = {}
    for name, value in named.items():
        if value.dtype.names is not None:
            for field in value.dtype.names:
                one = value[field]
                within = np.asarray(one.item() if one.dtype == object and not one.shape else one)
                result |= _fields(path, {f"{name}.{field}" if field in result or field in named else field: within})
        elif value.dtype.kind in "mM" and value.size:
            # A column of time, in seconds from its first value; what is no time becomes no number.
            result[f"{name} (s)"] = np.squeeze((value - value.ravel()[0]) / np.timedelta64(1, "s"))
        elif value.dtype.kind in "biuf":
            result[name] = np.squeeze(value.astype(np.int64) if value.dtype.kind == "b" else value)
        elif value.dtype.kind not in "US":
            raise _refused(
                path,
                text(
                    "'{name}' is of type {kind}; allowed are arrays of real numbers and structures of them. Save tables, cells and "
                    "objects as arrays, complex numbers as two",
                    name=name or path.name,
                    kind=str(value.dtype),
                ),
            )
    return result


def _columns(path: Path, named: Mapping[str, Array]) -> tuple[list[str], list[Array]]:
    arrays = {name: value for name, value in named.items() if value.size > 1}
    grids = {name: value for name, value in arrays.items() if value.ndim > 1}
    shapes = {value.shape for value in (grids or arrays).values()}
    if len(arrays) == 1 and grids:
        (matrix,) = grids.values()
        if matrix.ndim == 2:
            columns = list(matrix.T if matrix.shape[0] >= matrix.shape[1] else matrix)
            return [""] * len(columns), columns
    if len(shapes) != 1:
        raise _unlike(path, arrays)
    (shape,) = shapes
    if len(shape) > 2:
        raise _unlike(path, arrays)
    axes = {value.shape for value in arrays.values()} - {shape}
    if len(shape) == 2 and len(axes) == 1 and shape[0] != shape[1]:
        # Vectors along one side: the matrices are columns beside them.
        (length,) = axes
        grids = {name: value if shape[:1] == length else value.T for name, value in grids.items()}
        if length in (shape[:1], shape[1:]):
            arrays = {
                name: column for name, value in arrays.items() for name, column in _split(name, grids.get(name, value))
            }
            shape, grids = length, {}
    columns = []
    for value in arrays.values():
        if value.shape != shape:
            fitting = [axis for axis, length in enumerate(shape) if value.shape == (length,)]
            if len(fitting) != 1:
                raise _unlike(path, arrays)
            value = np.broadcast_to(np.expand_dims(value, [k for k in range(len(shape)) if k != fitting[0]]), shape)
        columns.append(value.ravel())
    names = list(arrays)
    if _INTERVAL in named and not grids and named[_INTERVAL].size == 1:
        times = float(named.get(_START, np.zeros(()))) + float(named[_INTERVAL]) * np.arange(shape[0])
        names, columns = ["time", *names], [times, *columns]
    return names, columns


def _split(name: str, value: Array) -> list[tuple[str, Array]]:
    """Return a vector, or the columns of a matrix under its name with their number and the unit that it states."""
    if value.ndim == 1:
        return [(name, value)]
    bare, unit = split_heading(name)
    return [(f"{bare}{k + 1} ({unit})" if unit else f"{bare}{k + 1}", column) for k, column in enumerate(value.T)]


def _unlike(path: Path, arrays: Mapping[str, Array]) -> CaptureError:
    return _refused(
        path,
        text(
            "its arrays make no table: {shapes}. Allowed are vectors of one length, or matrices of one shape, with vectors of their two "
            "axes where these differ in length; else give the currents as matrices too",
            shapes=[f"{name or 'array'} {'×'.join(map(str, value.shape))}" for name, value in arrays.items()]
            or text("none"),
        ),
    )
