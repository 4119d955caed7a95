"""Result files: names, units, bytes, and what reading refuses."""

import errno
import functools
import json
import os
import subprocess
import sys
from pathlib import Path

import cf_xarray.units
import h5py
import numpy as np
import opened
import pint
import pint_xarray  # noqa: F401
import pytest
import xarray as xr
from hypothesis import HealthCheck, given, settings, strategies as st

from hpcclear.base.errors import InputError, StorageError
from hpcclear.base.outcome import FIELDS, JOINTS, Status, failed, record_type
from hpcclear.results import dataset, netcdf
from hpcclear.results.content import Results
from hpcclear.results.names import KINDS, designs_in
from hpcclear.results.provenance import program

SCENE = '[mechanism]\nkind = "slider-crank"  # Kurbel, naïve\n'
HASH = "c0ffee" * 10 + "beef"
WHOLE = record_type(len(JOINTS), 2, {field.when for field in FIELDS.values()})
"""A record of all that a scene may request, with levels in two bands."""


def outcomes(n: int) -> np.ndarray:
    rng = np.random.default_rng(n)
    found = np.zeros(n, WHOLE)
    for name in WHOLE.names:
        if WHOLE[name].base.kind == "f":
            found[name] = rng.random(found[name].shape)
    found["band"] = 500.0, 1000.0
    found["sample"] = np.arange(n)
    found["rhs_evaluations"] = rng.integers(1, 2**40, n)
    found["objective_uncertainty"] = np.nan
    if n > 3:
        found[3] = failed(3, Status.STEP_CAP, 17, WHOLE)[0]
    return found


def samples(n: int = 9) -> xr.Dataset:
    values = np.random.default_rng(1).random((n, 3))
    names, units = ["m2", "C", "mechanism.rod.length"], {"mechanism.rod.length": "m"}
    made_by = {"scene": SCENE, "scene_hash": HASH, **program()}
    return dataset.samples_dataset(names, values, units, outcomes(n), made_by).to_xarray()


def example(kind: str) -> xr.Dataset:
    """A dataset with every variable of its kind."""
    table = KINDS[kind]
    if kind == "samples":
        return samples()
    sizes = {name: 2 if name == "joint" else 3 + i for i, name in enumerate(table.coords)}
    counter = iter(range(1000))

    def fill(row) -> np.ndarray:
        shape = tuple(sizes[dim] for dim in row.dims)
        size = int(np.prod(shape, dtype=int))
        if row.dtype == "text":
            return np.array([f"tëxt {next(counter)}" for _ in range(size)]).reshape(shape)
        if row.dtype == "i1":
            return np.zeros(shape, np.int8)
        return np.arange(size).reshape(shape).astype(row.dtype)

    coords = {name: fill(row) for name, row in table.coords.items()}
    if "joint" in coords:
        coords["joint"] = np.array(JOINTS)
    data = {name: fill(row) for name, row in table.data.items()}
    if table.design_dims is not None:
        data["m2"] = np.ones(tuple(sizes[dim] for dim in table.design_dims))
    if table.limit_dims is not None:
        data["m2_lower"] = np.zeros(tuple(sizes[dim] for dim in table.limit_dims))
    return dataset.dataset(
        kind, coords, data, {"scene": SCENE, "scene_hash": HASH, **program()}
    ).to_xarray()


# -- table and builders -------------------------------------------------------------------------


def test_samples_are_sorted_and_come_back_as_the_same_records():
    n = 12
    shuffled = np.random.default_rng(0).permutation(n)
    records, values = outcomes(n), np.arange(2.0 * n).reshape(n, 2)
    found = dataset.samples_dataset(["m2", "C"], values[shuffled], {}, records[shuffled])
    assert dataset.records(found).tobytes() == records.tobytes()
    designs = designs_in(found)
    assert list(designs) == ["m2", "C"]
    np.testing.assert_array_equal(designs["C"], values[:, 1])
    assert np.isnan(found["objective"][3])
    assert found["rhs_evaluations"][3] == 17


@pytest.mark.parametrize("name", ["objective", "sample", "status", "2m", "a b", "", "m.ö"])
def test_names_that_cannot_be_design_variables_are_refused(name):
    with pytest.raises(InputError, match=r"study\.variables"):
        dataset.samples_dataset([name], np.ones((2, 1)), {name: "m"}, outcomes(2))


# -- files --------------------------------------------------------------------------------------


@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize("engine", ["h5netcdf", "netcdf4"])
def test_files_open_everywhere_and_hold_the_same(tmp_path, kind, engine):
    original, path = example(kind), tmp_path / "file.nc"
    opened.write(original, path)
    assert opened.read(path, kind, HASH).identical(original)
    with xr.open_dataset(path, engine=engine) as found:
        xr.testing.assert_equal(found.load(), original)
        assert found.attrs["scene"] == SCENE
        for name, variable in found.data_vars.items():
            if variable.dtype.kind == "f":
                assert np.isnan(variable.encoding["_FillValue"]), name
            else:
                assert "_FillValue" not in variable.encoding, name
    with h5py.File(path) as file:
        assert set(original.variables) <= set(file)


def test_numbers_survive_to_the_last_bit(tmp_path):
    values = np.array([-0.0, np.inf, -np.inf, np.nan, 5e-324, np.nextafter(1, 2), 1e308])
    original = xr.Dataset({"x": ("k", values), "n": ("k", np.arange(7) + 2**62)})
    opened.write(original, tmp_path / "x.nc")
    found = netcdf.load(tmp_path / "x.nc").to_xarray()
    assert found["x"].values.tobytes() == values.tobytes()
    assert found["n"].values.tobytes() == original["n"].values.tobytes()


def test_long_attributes_and_empty_dimensions(tmp_path):
    attributes = {"scene": "ä" * 200_000, "nothing": "", "number": 3.5}
    original = dataset.samples_dataset(
        [], np.empty((0, 0)), {}, outcomes(0), attributes
    ).to_xarray()
    opened.write(original, tmp_path / "x.nc")
    assert opened.read(tmp_path / "x.nc").identical(original)
    with xr.open_dataset(tmp_path / "x.nc", engine="h5netcdf") as found:
        assert found.attrs["scene"] == attributes["scene"]


def test_a_written_file_has_the_permissions_of_an_ordinary_one(tmp_path):
    (tmp_path / "ordinary").write_bytes(b"")
    opened.write(samples(), tmp_path / "x.nc")
    assert (tmp_path / "x.nc").stat().st_mode == (tmp_path / "ordinary").stat().st_mode
    assert sorted(entry.name for entry in tmp_path.iterdir()) == ["ordinary", "x.nc"]


# -- writing that fails -------------------------------------------------------------------------


def test_a_symbolic_link_is_replaced_and_what_it_points_to_is_left_alone(tmp_path):
    outside = tmp_path / "outside.nc"
    outside.write_text("precious")
    inside = tmp_path / "inside"
    inside.mkdir()
    (inside / "x.nc").symlink_to(outside)
    opened.write(samples(), inside / "x.nc")
    assert outside.read_text() == "precious"
    assert not (inside / "x.nc").is_symlink()
    opened.read(inside / "x.nc", "samples")
    (tmp_path / "link").symlink_to(inside)  # a linked directory is what the user asked for
    opened.write(samples(), tmp_path / "link" / "y.nc")
    opened.read(inside / "y.nc", "samples")


def places(folder: Path) -> dict[str, Path]:
    (folder / "file").write_text("")
    (folder / "directory").mkdir()
    (folder / "loop").symlink_to(folder / "loop")
    (folder / "link").symlink_to(folder / "nowhere")
    return {
        "missing directory": folder / "no" / "x.nc",
        "file as directory": folder / "file" / "x.nc",
        "directory in the way": folder / "directory",
        "loop": folder / "loop" / "x.nc",
        "link to nowhere": folder / "link",
        "long name": folder / ("x" * 300),
        "proc": Path("/proc/x.nc"),
    }


PLACES = ["missing directory", "file as directory", "directory in the way", "loop", "proc"]


@pytest.mark.parametrize("case", [*PLACES, "link to nowhere", "long name"])
def test_places_that_cannot_be_written_to_are_bad_input(tmp_path, case):
    place = places(tmp_path)[case]
    before = sorted(tmp_path.iterdir())
    with pytest.raises(InputError, match="output"):
        opened.write(samples(), place)
    assert sorted(tmp_path.iterdir()) == before


@pytest.mark.parametrize("call", ["write", "fsync", "replace"])
@pytest.mark.parametrize("code", [errno.ENOSPC, errno.EDQUOT, errno.EIO])
def test_a_failing_disk_keeps_the_last_good_file(tmp_path, monkeypatch, call, code):
    path = tmp_path / "x.nc"
    opened.write(samples(5), path)
    good = path.read_bytes()

    def fail(*args: object, **kwargs: object) -> None:
        raise OSError(code, os.strerror(code))

    with monkeypatch.context() as patch:
        patch.setattr(os, call, fail)
        with pytest.raises(StorageError, match=os.strerror(code)):
            opened.write(samples(6), path)
    assert path.read_bytes() == good
    assert [entry.name for entry in tmp_path.iterdir()] == ["x.nc"]


def test_an_interrupt_in_the_middle_of_a_write_leaves_no_rubbish(tmp_path, monkeypatch):
    real = os.write
    calls = []

    def interrupted(descriptor: int, data: memoryview) -> int:
        calls.append(1)
        if len(calls) > 1:
            raise KeyboardInterrupt
        return real(descriptor, data[:100])  # short writes are allowed

    monkeypatch.setattr(os, "write", interrupted)
    with pytest.raises(KeyboardInterrupt):
        opened.write(samples(), tmp_path / "x.nc")
    assert list(tmp_path.iterdir()) == []


# -- reading what is not right ------------------------------------------------------------------


@functools.cache
def sealed() -> bytes:
    image = dataset.encode(Results.of(samples())).getvalue()
    return image + netcdf.seal(image)


def refuses(folder: Path, content: bytes) -> str:
    path = folder / "damaged.nc"
    path.write_bytes(content)
    with pytest.raises(InputError) as caught:
        opened.read(path, "samples")
    return caught.value.reason


DAMAGE = settings(
    max_examples=300, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture]
)


@DAMAGE
@given(data=st.data())
def test_truncated_files_are_refused(tmp_path, data):
    refuses(tmp_path, sealed()[: data.draw(st.integers(0, len(sealed()) - 1))])


@DAMAGE
@given(data=st.data())
def test_changed_bytes_are_refused(tmp_path, data):
    position = data.draw(st.integers(0, len(sealed()) - 1))
    patch = data.draw(st.binary(min_size=1, max_size=64))
    content = sealed()[:position] + patch + sealed()[position + len(patch) :]
    if content != sealed():
        refuses(tmp_path, content)


@DAMAGE
@given(content=st.binary(max_size=2000))
def test_foreign_bytes_are_refused(tmp_path, content):
    refuses(tmp_path, content)
    refuses(tmp_path, content + netcdf.seal(content))


def test_files_that_are_not_there_or_no_files_are_refused(tmp_path):
    os.mkfifo(tmp_path / "pipe")
    for place in (tmp_path / "none.nc", tmp_path, tmp_path / "pipe", Path("/dev/zero")):
        with pytest.raises(InputError):
            opened.read(place)


def test_a_file_of_another_kind_or_scene_is_refused(tmp_path):
    path = tmp_path / "x.nc"
    opened.write(samples(), path)
    with pytest.raises(InputError, match="it holds samples, not front"):
        opened.read(path, "front")
    with pytest.raises(InputError, match="another scene"):
        opened.read(path, "samples", "0" * 64)


SPOILT = {
    "missing": lambda content: content.drop_vars("objective"),
    "coordinate": lambda content: content.drop_vars("joint"),
    "unknown": lambda content: content.assign(surprise=("sample", np.zeros(9))),
    "type": lambda content: content.assign(rhs_evaluations=content["rhs_evaluations"] * 1.0),
    "dimensions": lambda content: content.assign(mean_gap=content["mean_gap"].T),
    "kind": lambda content: content.assign_attrs(hpcclear_kind="potato"),
    "design": lambda content: content.assign(C=content["C"].where(content["sample"] > 2)),
    "status": lambda content: content.assign(status=content["status"] + np.int8(100)),
    "finished without a number": lambda content: content.assign(
        objective=content["objective"] * np.nan
    ),
    "failed with a number": lambda content: content.assign(
        objective=content["objective"].fillna(0.0)
    ),
    "order": lambda content: content.isel(sample=slice(None, None, -1)),
}


@pytest.mark.parametrize("what", SPOILT)
def test_sealed_files_that_say_what_cannot_be_are_refused(tmp_path, what):
    with xr.set_options(keep_attrs=True):
        spoilt = SPOILT[what](samples())
    opened.write(spoilt, tmp_path / "x.nc")
    with pytest.raises(InputError):
        opened.read(tmp_path / "x.nc", "samples")


def virtual(file: h5py.File, secret: str) -> None:
    layout = h5py.VirtualLayout((9,), "f8")
    layout[:] = h5py.VirtualSource(secret, "x", (9,))
    file.create_virtual_dataset("spy", layout)


HOSTILE = {
    "chunked bomb": lambda file, secret: file.create_dataset(
        "bomb", (10**6, 10**6), "f8", chunks=(1000, 1000)
    ),
    "unallocated": lambda file, secret: file.create_dataset("bomb", (10**12,), "f8"),
    "external data": lambda file, secret: file.create_dataset(
        "spy", (9,), "i1", external=[(secret, 0, 80)]
    ),
    "external link": lambda file, secret: file.__setitem__("spy", h5py.ExternalLink(secret, "/x")),
    "soft link": lambda file, secret: file.__setitem__("spy", h5py.SoftLink("/objective")),
    "virtual": virtual,
    "group": lambda file, secret: file.create_group("objects/deep"),
    "compound": lambda file, secret: file.create_dataset("spy", data=np.zeros(3, "i4,f8")),
    "reference": lambda file, secret: file.attrs.__setitem__("spy", file["objective"].ref),
    "opaque": lambda file, secret: file.create_dataset("spy", data=np.void(b"cos\nsystem\n")),
}


@pytest.mark.parametrize("what", HOSTILE)
def test_hostile_structure_under_a_forged_seal_is_refused(tmp_path, what):
    path, secret = tmp_path / "x.nc", tmp_path / "secret"
    secret.write_bytes(b"password" * 10)
    opened.write(samples(), path)
    with h5py.File(path, "r+") as file:
        HOSTILE[what](file, str(secret))
    image = path.read_bytes()
    path.write_bytes(image + netcdf.seal(image))
    with pytest.raises(InputError, match="structure"):
        opened.read(path, "samples")


# -- conventions --------------------------------------------------------------------------------


@pytest.mark.nightly
def test_cf_checker_finds_no_error(tmp_path):
    """All kinds in one start of the checker's program, which takes longer than its work."""
    for kind in KINDS:
        opened.write(example(kind), tmp_path / f"{kind}.nc")
    command = [str(Path(sys.executable).with_name("compliance-checker")), "--test", "cf:1.11"]
    report = tmp_path / "report.json"
    subprocess.run(
        [*command, "--format", "json_new", "--output", report, *sorted(tmp_path.glob("*.nc"))],
        capture_output=True, check=False,
    )  # fmt: skip
    found = json.loads(report.read_text())
    assert len(found) == len(KINDS)
    for path, suites in found.items():
        messages = [
            text for entry in suites["cf:1.11"]["high_priorities"] for text in entry["msgs"]
        ]
        # The checker wants a calendar date of any dimension called time; ours is elapsed time.
        unexpected = [text for text in messages if "should have standard_name='time'" not in text]
        assert unexpected == [], path
        assert Path(path).stem == "response" or messages == []


@pytest.mark.parametrize("kind", KINDS)
def test_units_and_flags_are_understood_by_pint_xarray_and_cf_xarray(tmp_path, kind):
    registry = pint.UnitRegistry()
    opened.write(example(kind), tmp_path / "x.nc")
    with xr.open_dataset(tmp_path / "x.nc", decode_timedelta=False) as found:
        measured = [n for n, v in found.data_vars.items() if "units" in v.attrs]
        for name in measured:
            plain = registry.parse_units(found[name].attrs["units"])
            udunits = cf_xarray.units.units.parse_units(found[name].attrs["units"])
            assert plain.dimensionality == udunits.dimensionality, name
        quantities = found[measured].reset_coords(drop=True).pint.quantify()
        assert all(quantities[name].pint.units is not None for name in measured)
        flags = [name for name, variable in found.data_vars.items() if variable.cf.is_flag_variable]
        codes = [n for n, v in found.data_vars.items() if v.dtype == np.int8]
        assert sorted(flags) == sorted(codes)
        if "status" in found:
            np.testing.assert_array_equal(found["status"].cf == "ok", found["status"] == Status.OK)


def test_results_select_as_xarray_does():
    content = samples(6)
    found = Results.of(content)
    for chosen in (
        {"sample": 2},
        {"sample": [4, 1]},
        {"joint": -1},
        {"sample": slice(1, 4), "joint": 0},
    ):
        assert found.isel(chosen).to_xarray().identical(content.isel(chosen))
    label = str(content["joint"].values[1])
    assert found.sel(joint=label).to_xarray().identical(content.sel(joint=label))
    assert found.sel(joint=[label]).to_xarray().identical(content.sel(joint=[label]))
    one = content["mean_gap"].sel(joint=label)
    np.testing.assert_array_equal(found["mean_gap"].sel(joint=label), one)
    assert Results.of(found.to_xarray()).attrs == content.attrs
    with pytest.raises(KeyError):
        found.sel(joint="nowhere")
