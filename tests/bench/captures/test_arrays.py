"""Files of arrays are the table that a text file of the same numbers is, or are refused with what to do."""

import zipfile
from pathlib import Path
from typing import Any

import h5py
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays
from scipy.io import savemat

from bench.analysis.map_columns import map_columns
from bench.captures import CaptureError, read_capture
from bench.captures.arrays import array_lines
from bench.i18n.errors import InputError

TIME = np.arange(8) * 1e-3
WAVE = np.array([0.0, 1.5, -0.25, 3.0, 0.125, -2.0, 1.0, 0.5])
ID, IQ = np.linspace(-4.0, 0.0, 3), np.linspace(-5.0, 5.0, 5)
PSI_D, PSI_Q = 0.1 + 2e-3 * ID[:, None] + 0.0 * IQ, 3e-3 * IQ + 0.0 * ID[:, None]


def put(folder: Path, name: str, *bare: Any, **named: Any) -> Path:
    path = folder / name
    if path.suffix == ".mat":
        savemat(path, named)
    elif path.suffix == ".npy":
        np.save(path, *bare)
    else:
        np.savez_compressed(path, **named)
    return path


@pytest.mark.parametrize("name", ["record.mat", "record.npz"])
def test_vectors_are_columns_by_their_names(tmp_path: Path, name: str) -> None:
    capture = read_capture(put(tmp_path, name, CH1_V=WAVE.astype(np.float32), time_s=TIME, remark="cold", pairs=4))
    assert [(each.name, each.unit) for each in capture.channels] == [("CH1", "V")]
    np.testing.assert_array_equal(capture.channel("CH1").values, WAVE)
    np.testing.assert_allclose(capture.times(), TIME)


@pytest.mark.parametrize("turned", [False, True])
def test_one_matrix_has_its_columns_along_the_shorter_side(tmp_path: Path, turned: bool) -> None:
    table = np.column_stack((TIME, WAVE, -WAVE))
    capture = read_capture(put(tmp_path, "record.npy", table.T if turned else table))
    np.testing.assert_array_equal(capture.channels[1].values, -WAVE)
    np.testing.assert_allclose(capture.times(), TIME)


def test_named_fields_are_columns(tmp_path: Path) -> None:
    table = np.zeros(TIME.size, dtype=[("t [ms]", "f8"), ("U [V]", "f4")])
    table["t [ms]"], table["U [V]"] = 1e3 * TIME, WAVE
    capture = read_capture(put(tmp_path, "record.npy", table))
    assert (capture.channels[0].name, capture.channels[0].unit) == ("U", "V")
    np.testing.assert_allclose(capture.times(), TIME)


def test_a_picoscope_tells_its_times_by_start_and_interval(tmp_path: Path) -> None:
    path = tmp_path / "record.mat"
    savemat(path, {"A": WAVE[:, None], "Tstart": -2e-3, "Tinterval": 1e-3, "Length": 8}, format="4")
    capture = read_capture(path)
    np.testing.assert_allclose(capture.times(), TIME - 2e-3)
    assert [each.name for each in capture.channels] == ["A"]


@pytest.mark.parametrize("way", ["axes", "turned", "matrices", "structure"])
def test_a_map_of_matrices_is_the_map_of_its_rows(tmp_path: Path, way: str) -> None:
    d, q = np.meshgrid(ID, IQ, indexing="ij")
    given_as: dict[str, Any] = {"id_A": ID, "iq_A": IQ, "psi_d_Vs": PSI_D, "psi_q_Vs": PSI_Q}
    if way == "turned":
        given_as |= {"psi_d_Vs": PSI_D.T, "psi_q_Vs": PSI_Q.T}
    elif way == "matrices":
        given_as |= {"id_A": d, "iq_A": q}
    elif way == "structure":
        given_as = {"map": given_as}
    found = map_columns(put(tmp_path, "map.mat", **given_as), ())
    order = np.lexsort(found.points.T[::-1])
    np.testing.assert_allclose(found.points[order], np.column_stack((d.ravel(), q.ravel())))
    np.testing.assert_allclose(found.flux[order], np.column_stack((PSI_D.ravel(), PSI_Q.ravel())))


@pytest.mark.parametrize(
    ("name", "named", "said"),
    [
        ("record.npz", {"t": TIME, "CH1": WAVE[:-1]}, "make no table: t 8, CH1 7"),
        ("record.mat", {"id_A": ID, "iq_A": ID, "psi_d_Vs": np.eye(3), "psi_q_Vs": np.eye(3)}, "currents as matrices"),
        ("record.npz", {"t": TIME, "CH1": np.array([{}] * 8, dtype=object)}, "holds objects"),
        ("record.mat", {"t": np.array([TIME, "x"], dtype=object)}, "cells and objects as arrays"),
        ("record.npz", {"t": TIME, "CH1": WAVE * 1j}, "complex numbers as two"),
        ("record.mat", {"words": "none"}, "make no table: none"),
    ],
)
def test_arrays_that_make_no_table_are_refused(tmp_path: Path, name: str, named: dict[str, Any], said: str) -> None:
    with pytest.raises(CaptureError, match=said):
        read_capture(put(tmp_path, name, **named))


def test_a_version_that_is_hdf5_is_named(tmp_path: Path) -> None:
    path = tmp_path / "record.mat"
    path.write_bytes(b"MATLAB 7.3 MAT-file".ljust(512) + b"\x89HDF\r\n\x1a\n" + bytes(64))
    with pytest.raises(CaptureError, match=r"7\.3; save it again .*-v7"):
        read_capture(path)


@pytest.mark.parametrize("name", ["record.mat", "record.npz"])
def test_a_damaged_file_is_refused(tmp_path: Path, name: str) -> None:
    path = put(tmp_path, name, t=TIME, CH1=WAVE)
    whole = path.read_bytes()
    for length in range(8, len(whole), 37):
        path.write_bytes(whole[:length])
        with pytest.raises(CaptureError):
            read_capture(path)


@settings(max_examples=8)
@given(arrays(np.float64, (5, 3), elements=st.floats(-1e9, 1e9)))
def test_no_digit_is_lost(tmp_path_factory: pytest.TempPathFactory, table: np.ndarray) -> None:
    path = tmp_path_factory.mktemp("arrays") / "table.npy"
    np.save(path, table)
    lines = array_lines(path)
    assert lines is not None
    assert [[float(cell) for cell in line.split(",")] for line in lines] == table.tolist()


def test_a_map_without_names_is_refused_with_what_to_do(tmp_path: Path) -> None:
    with pytest.raises(InputError, match="numbers in place of headings"):
        map_columns(put(tmp_path, "map.npy", np.column_stack((TIME, WAVE, TIME, WAVE))), ())


@pytest.mark.parametrize("name", ["record.mat", "record.npz"])
def test_matrices_beside_a_vector_are_columns(tmp_path: Path, name: str) -> None:
    capture = read_capture(
        put(tmp_path, name, t_s=TIME, u_V=np.column_stack((WAVE, 2 * WAVE)), i_A=np.vstack((WAVE, 3 * WAVE)).T)
    )
    assert [(each.name, each.unit) for each in capture.channels] == [("u1", "V"), ("u2", "V"), ("i1", "A"), ("i2", "A")]
    np.testing.assert_array_equal(capture.channel("i2").values, 3 * WAVE)
    np.testing.assert_allclose(capture.times(), TIME)


@pytest.mark.parametrize("begin", ["2026-11-29T10:00:00", None])
def test_times_of_day_are_seconds_from_the_first(tmp_path: Path, begin: str | None) -> None:
    since = (TIME * 1e9).astype("timedelta64[ns]")
    capture = read_capture(put(tmp_path, "log.npz", time=since + np.datetime64(begin) if begin else since, CH1_V=WAVE))
    np.testing.assert_allclose(capture.times(), TIME, atol=1e-12)


@pytest.mark.parametrize("name", ["record.mat", "record.npz", "record.npy"])
def test_a_text_with_such_an_ending_is_read_as_text(tmp_path: Path, name: str) -> None:
    path = tmp_path / name
    np.savetxt(path, np.column_stack((TIME, WAVE)), delimiter=",", header="time (s),CH1 (V)", comments="")
    np.testing.assert_array_equal(read_capture(path).channel("CH1").values, WAVE)


def test_what_is_no_array_is_named(tmp_path: Path) -> None:
    with zipfile.ZipFile(tmp_path / "packed.npz", "w") as packed:
        packed.writestr("scope.csv", "time (s),CH1 (V)\n0,1\n1,2\n")
    with pytest.raises(CaptureError, match=r"other files than arrays: scope\.csv"):
        read_capture(tmp_path / "packed.npz")
    with pytest.raises(CaptureError, match="its arrays make no table: array 3×4×5"):
        read_capture(put(tmp_path, "cube.npy", np.ones((3, 4, 5))))
    with h5py.File(tmp_path / "other.h5", "w") as file:
        file["t"] = TIME
    with pytest.raises(CaptureError, match=r"of HDF5 nothing else is read; save the arrays as \.mat"):
        read_capture(tmp_path / "other.h5")


def test_a_tables_names_state_newton_metres(tmp_path: Path) -> None:
    table = {
        "id_A": [0.0, -1.0, 0.0],
        "iq_A": [0.0, 0.0, 1.0],
        "psi_d_Vs": [0.1, 0.098, 0.1],
        "psi_q_Vs": [0.0, 0.0, 3e-3],
    }
    found = map_columns(put(tmp_path, "map.npz", **table, torque_mN_m=np.array([0.0, 0.0, 150.0])), ())
    np.testing.assert_allclose(found.torque, [0.0, 0.0, 0.15])
