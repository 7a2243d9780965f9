import errno
import json
import os
import subprocess
import sys
import time
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import h5py
import numpy as np
import pytest
import xarray
from matplotlib.figure import Figure
from matplotlib.layout_engine import ConstrainedLayoutEngine

from twindisc_cli.errors import OutputError, ValidityError
from twindisc_cli.results import Array, Axis, Dataset, Result, or_null
from twindisc_cli.results import files as files_module
from twindisc_cli.results.drawn import drawn_as
from twindisc_cli.results.files import write_all
from twindisc_cli.results.origin import Origin
from twindisc_cli.results.recorded import up_to_date, why
from twindisc_cli.results.store import images, plain, put, write

ORIGIN = Origin("small", ('schema = 1\nname = "µ"\n',), {"../data/t.csv": "ab" * 32}, "reconstructed", {})


def figure() -> Figure:
    drawn = Figure()
    drawn.add_subplot().plot([0.0, 1.0])
    return drawn


def dataset() -> Dataset:
    creepage, mu = np.linspace(0.0, 0.09, 200), np.linspace(0.05, 0.7, 60)
    return Dataset(
        axes=(
            Axis("mu", mu, "1", "coefficient of friction"),
            Axis("creepage", creepage, "1", "creepage"),
            Axis("theory", np.array(["exact", "fastsim"]), "1", "theory of contact"),
        ),
        arrays=(
            Array("apparent_friction", ("mu", "creepage"), np.outer(mu, np.tanh(creepage)), "1", "apparent friction"),
            Array("force", ("theory",), np.array([1.0, np.nan]), "N", "tangential force", optional=True),
            Array("saturated", ("mu",), mu > 0.3, "1", "whether all slides"),
            Array("load", (), np.array(72.0), "N", "normal load"),
            Array("state", ("theory",), np.array(["sliding", "µ"]), "1", "state"),
        ),
        attrs={"contact": "hertz", "passes": 3},
    )


RESULT = Result(
    command="friction-chart",
    summary=("two lines", "of µ"),
    json={
        "mu": or_null(np.array([0.5, np.nan])),
        "steps": ({"n": np.int64(3)},),
        "bound": or_null(np.inf),
        "ok": np.bool_(True),
    },
    dataset=dataset(),
    figure=figure,
    exit_code=5,
)


def test_xarray_reads_axes_units_and_names(tmp_path: Path) -> None:
    write(tmp_path, RESULT, ORIGIN, {})
    with xarray.open_dataset(tmp_path / "friction-chart.h5", engine="h5netcdf") as data:
        assert data["apparent_friction"].dims == ("mu", "creepage")
        np.testing.assert_array_equal(data["mu"], np.linspace(0.05, 0.7, 60))
        assert data["apparent_friction"].attrs["units"] == "1"
        assert data["force"].attrs["long_name"] == "tangential force"
        assert list(data["theory"].values) == ["exact", "fastsim"]
        assert list(data["state"].values) == ["sliding", "µ"]
        assert data["apparent_friction"].sel(mu=0.7, creepage=0.09).item() == pytest.approx(0.7 * np.tanh(0.09))
        assert data.attrs["contact"] == "hertz"


def test_every_array_has_scales_units_and_a_name(tmp_path: Path) -> None:
    write(tmp_path, RESULT, ORIGIN, {})
    assert_well_formed(tmp_path / "friction-chart.h5")


def assert_well_formed(path: Path) -> None:
    """Every data set of a result file has units, a long name, and a scale on every dimension."""
    with h5py.File(str(path)) as file:
        names: list[str] = []
        file.visit(names.append)
        for name in names:
            item = file[name]
            if not isinstance(item, h5py.Dataset):
                continue
            assert item.attrs["units"], name
            assert item.attrs["long_name"], name
            if not item.is_scale:
                assert all(len(dimension.keys()) == 1 for dimension in item.dims), name
        for name in ("Conventions", "title", "schema", "twindisc_version", "run_key", "provenance"):
            assert name in file.attrs, name
        assert file["config"].attrs["toml"]
        assert "provenance" in file


def test_the_origin_is_in_the_file(tmp_path: Path) -> None:
    write(tmp_path, RESULT, replace(ORIGIN, configs=("a = 1\n", "b = 2\n")), {})
    with h5py.File(str(tmp_path / "friction-chart.h5")) as file:
        assert dict(file["config"].attrs) == {"toml": "a = 1\n", "toml_2": "b = 2\n"}
        assert dict(file["provenance"].attrs) == {"../data/t.csv": "ab" * 32, "kind": "reconstructed"}


def test_the_same_result_gives_the_same_bytes(tmp_path: Path) -> None:
    write(tmp_path / "a", RESULT, ORIGIN, {"page.html": b"<p>"})
    time.sleep(1.1)  # HDF5 notes times in whole seconds
    write(tmp_path / "b", replace(RESULT, dataset=dataset()), ORIGIN, {"page.html": b"<p>"})
    names = sorted(p.name for p in (tmp_path / "a").iterdir())
    assert names == ["friction-chart.h5", "friction-chart.png", "page.html"]
    for name in names:
        assert (tmp_path / "a" / name).read_bytes() == (tmp_path / "b" / name).read_bytes(), name


def test_a_stored_outcome_comes_back_whole(tmp_path: Path) -> None:
    paths = write(tmp_path, RESULT, ORIGIN, {"revised.toml": b"x = 1"})
    stored = up_to_date(tmp_path / "friction-chart.h5", ORIGIN.run_key("friction-chart"))
    assert stored is not None
    assert stored.json == {"mu": [0.5, None], "steps": [{"n": 3}], "bound": None, "ok": True}
    assert stored.exit_code == 5
    assert stored.summary == ("two lines", "of µ")
    assert set(stored.files) == set(paths)


@pytest.mark.parametrize(
    "change",
    [
        {"configs": ("schema = 2\n",)},
        {"inputs": {"../data/t.csv": "cd" * 32}},
        {"options": {"validate": True}},
    ],
)
def test_a_changed_origin_is_not_up_to_date(tmp_path: Path, change: dict[str, object]) -> None:
    write(tmp_path, RESULT, ORIGIN, {})
    changed: Origin = replace(ORIGIN, **change)  # type: ignore[arg-type]
    assert up_to_date(tmp_path / "friction-chart.h5", changed.run_key("friction-chart")) is None
    assert ORIGIN.run_key("friction-chart") != ORIGIN.run_key("thermal")


def test_a_damaged_or_incomplete_result_is_not_up_to_date(tmp_path: Path) -> None:
    path, key = tmp_path / "friction-chart.h5", ORIGIN.run_key("friction-chart")
    assert up_to_date(path, key) is None
    write(tmp_path, RESULT, ORIGIN, {})
    (tmp_path / "friction-chart.png").unlink()
    assert up_to_date(path, key) is None
    write(tmp_path, RESULT, ORIGIN, {})
    path.write_bytes(path.read_bytes()[:3000])
    assert up_to_date(path, key) is None


def test_texts_are_no_variables_that_a_table_would_repeat(tmp_path: Path) -> None:
    write(tmp_path, RESULT, ORIGIN, {})
    with xarray.open_dataset(tmp_path / "friction-chart.h5", engine="h5netcdf") as data:
        assert set(data.variables) == {a.name for a in (*dataset().axes, *dataset().arrays)}


def test_a_bit_that_flipped_is_found_wherever_it_is(tmp_path: Path) -> None:
    path, key = tmp_path / "friction-chart.h5", ORIGIN.run_key("friction-chart")
    write(tmp_path, RESULT, ORIGIN, {})
    whole = path.read_bytes()
    for place in np.linspace(0, len(whole) - 1, 400).astype(int):
        path.write_bytes(whole[:place] + bytes([whole[place] ^ 4]) + whole[place + 1 :])
        assert up_to_date(path, key) is None, place
    path.write_bytes(whole)
    assert up_to_date(path, key) is not None


@pytest.mark.parametrize("content", [b"", b"of another run"])
def test_a_neighbour_that_was_emptied_or_exchanged_is_found(tmp_path: Path, content: bytes) -> None:
    path, key = tmp_path / "friction-chart.h5", ORIGIN.run_key("friction-chart")
    write(tmp_path, RESULT, ORIGIN, {"page.html": b"<p>"})
    (tmp_path / "page.html").write_bytes(content)
    assert up_to_date(path, key) is None
    assert why(path, "friction-chart", ORIGIN) == "page.html beside it was changed"


@pytest.mark.parametrize("number", [0, 1, 2])
def test_a_run_killed_while_it_puts_its_files_in_place_leaves_no_mixture(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, number: int
) -> None:
    """As if killed at its `number`-th renaming: the new page beside the old HDF5 file would pass for a result."""
    path, extra = tmp_path / "friction-chart.h5", {"page.html": b"<p>"}
    write(tmp_path, RESULT, ORIGIN, extra)
    renamed, uses = Path.replace, iter(range(9))

    def dying(source: Path, target: Path) -> Path:
        if next(uses) >= number:
            raise KeyboardInterrupt
        return renamed(source, target)

    monkeypatch.setattr(Path, "replace", dying)
    changed = replace(ORIGIN, configs=("schema = 1\n",))
    with pytest.raises(KeyboardInterrupt):
        write(tmp_path, replace(RESULT, summary=("other",)), changed, {"page.html": b"<p>other"})
    assert not path.exists()
    assert not list(tmp_path.glob(".*"))


def test_what_the_last_result_had_beside_it_goes_with_it(tmp_path: Path) -> None:
    write(tmp_path, RESULT, ORIGIN, {"page.html": b"<p>"})
    (tmp_path / "mine.txt").write_text("not of this result")
    put(tmp_path, images(RESULT, ORIGIN, {}, formats=("pdf", "svg"), dpi=80))
    assert {p.name for p in tmp_path.iterdir()} == {
        "friction-chart.h5",
        "friction-chart.pdf",
        "friction-chart.svg",
        "mine.txt",
    }


def test_a_figure_is_the_same_bytes_in_every_format() -> None:
    first, second = (images(RESULT, ORIGIN, {}, formats=("png", "pdf", "svg")) for _ in range(2))
    assert first == second
    assert first["friction-chart.pdf"].startswith(b"%PDF")
    assert b"<svg" in first["friction-chart.svg"]


def test_two_that_write_at_once_leave_the_files_of_one(tmp_path: Path) -> None:
    script = (
        "import sys; from pathlib import Path; from twindisc_cli.results.files import write_all\n"
        "for _ in range(60): write_all({Path(sys.argv[1]) / n: sys.argv[2].encode() for n in ('a', 'b', 'c')})"
    )
    both = [subprocess.Popen([sys.executable, "-c", script, str(tmp_path), name]) for name in ("one", "two")]
    assert [process.wait() for process in both] == [0, 0]
    assert len({(tmp_path / name).read_bytes() for name in "abc"}) == 1
    assert {p.name for p in tmp_path.iterdir()} == set("abc")


def test_why_a_result_is_made_again_is_said(tmp_path: Path) -> None:
    path = tmp_path / "friction-chart.h5"
    assert why(path, "friction-chart", ORIGIN) == "is not there"
    write(tmp_path, RESULT, replace(ORIGIN, configs=("a.b = 1\nc = 2\n",)), {})
    assert why(path, "friction-chart", replace(ORIGIN, configs=("a.b = 3\nc = 2\n",))) == (
        "the definition says something else at a.b"
    )
    write(tmp_path, RESULT, ORIGIN, {})
    assert why(path, "friction-chart", ORIGIN) == ""
    assert why(path, "friction-chart", replace(ORIGIN, inputs={"../data/t.csv": "cd"})) == "../data/t.csv was changed"
    assert why(path, "friction-chart", replace(ORIGIN, options={"dpi": 300})) == "dpi is another"
    (tmp_path / "friction-chart.png").unlink()
    assert why(path, "friction-chart", ORIGIN) == "friction-chart.png beside it is gone"


def test_json_holds_no_nan_and_no_numpy() -> None:
    value = plain(or_null({"a": np.array([[1.0, np.nan]]), "b": np.float32(0.5), "c": -np.inf, "d": None, 3: "x"}))
    assert value == {"a": [[1.0, None]], "b": 0.5, "c": None, "d": None, "3": "x"}
    json.dumps(value, allow_nan=False)


def test_an_array_must_fit_its_axes() -> None:
    axis = Axis("y", np.arange(3.0), "m", "position")
    with pytest.raises(ValueError, match="has shape"):
        Dataset((axis,), (Array("p", ("y",), np.zeros(4), "Pa", "pressure"),))
    with pytest.raises(ValueError, match="twice"):
        Dataset((axis,), (Array("y", ("y",), np.zeros(3), "m", "again"),))


# What cannot be written leaves what was there.


def failing(call: Callable[..., object], number: int, code: int) -> Callable[..., object]:
    """The call, which fails from its `number`-th use on."""
    uses = iter(range(1000))

    def wrapped(*args: object) -> object:
        if next(uses) >= number:
            raise OSError(code, os.strerror(code))
        return call(*args)

    return wrapped


@pytest.mark.parametrize("number", [0, 1])
@pytest.mark.parametrize(
    ("code", "says"), [(errno.ENOSPC, "No space left on device"), (errno.EACCES, "Permission denied")]
)
def test_a_failed_write_keeps_the_old_result(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, number: int, code: int, says: str
) -> None:
    write(tmp_path, RESULT, ORIGIN, {})
    before = {p.name: p.read_bytes() for p in tmp_path.iterdir()}
    monkeypatch.setattr(files_module.os, "fsync", failing(os.fsync, number, code))
    with pytest.raises(OutputError, match=f"cannot be written: {says}; nothing was changed") as error:
        write(tmp_path, replace(RESULT, exit_code=0), ORIGIN, {})
    assert error.value.exit_code == 2
    assert {p.name: p.read_bytes() for p in tmp_path.iterdir()} == before


def test_an_interrupt_leaves_nothing_half_written(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    def interrupt(_: int) -> None:
        raise KeyboardInterrupt

    monkeypatch.setattr(files_module.os, "fsync", interrupt)
    with pytest.raises(KeyboardInterrupt):
        write(tmp_path, RESULT, ORIGIN, {})
    assert list(tmp_path.iterdir()) == []


def test_a_folder_in_the_way_is_told(tmp_path: Path) -> None:
    (tmp_path / "a.h5").mkdir()
    with pytest.raises(OutputError, match=r"a\.h5: cannot be written"):
        write_all({tmp_path / "a.h5": b"1"})
    (tmp_path / "file").write_text("")
    with pytest.raises(OutputError, match="cannot be written"):
        write_all({tmp_path / "file" / "b.h5": b"1"})
    assert sorted(p.name for p in tmp_path.iterdir()) == ["a.h5", "file"]


@pytest.mark.skipif(os.geteuid() == 0, reason="root may write anywhere")
def test_a_read_only_folder_is_told(tmp_path: Path) -> None:
    tmp_path.chmod(0o500)
    with pytest.raises(OutputError, match="Permission denied"):
        write_all({tmp_path / "a.h5": b"1"})


@pytest.mark.parametrize("value", [np.nan, np.inf])
def test_a_number_that_is_none_is_never_written_unless_it_is_declared(tmp_path: Path, value: float) -> None:
    p0, broken = Axis("y", np.arange(2.0), "m", "position"), np.array([1.0, value])
    spoilt = {
        "peak_pressure": Dataset((p0,), (Array("peak_pressure", ("y",), broken, "Pa", "peak pressure"),)),
        "y": Dataset((replace(p0, values=broken),), ()),
        "error": Dataset((p0,), (), {"error": value}),
    }
    outcomes = [(name, replace(RESULT, dataset=spoilt[name])) for name in spoilt]
    outcomes += [("depth_um", replace(RESULT, json={"a": 1, "steps": [{"depth_um": 2.0}, {"depth_um": value}]}))]
    outcomes += [("mu", replace(RESULT, json={"mu": broken}))]
    for name, result in outcomes:
        with pytest.raises(ValidityError, match=f"{name} came out as no finite number"):
            write(tmp_path, result, ORIGIN, {})
        assert not list(tmp_path.iterdir())
    write(tmp_path, replace(RESULT, json=or_null({"mu": broken})), ORIGIN, {})


def test_what_a_killed_process_left_behind_is_removed_by_the_next_that_writes(tmp_path: Path) -> None:
    killed = subprocess.run([sys.executable, "-c", "import os; print(os.getpid())"], capture_output=True, check=True)
    abandoned = tmp_path / f".a.h5.{int(killed.stdout)}.tmp"
    in_use = tmp_path / f".a.h5.{os.getppid()}.tmp"
    other = tmp_path / f".b.h5.{int(killed.stdout)}.tmp"
    for path in (abandoned, in_use, other):
        path.write_text("half")
    write_all({tmp_path / "a.h5": b"whole"})
    assert {path.name for path in tmp_path.iterdir()} == {"a.h5", in_use.name, other.name}


@pytest.mark.parametrize("form", ["png", "svg"])
def test_a_figure_stands_where_it_stood_however_the_layout_was_solved(monkeypatch, form):
    rng, solve = np.random.default_rng(1), ConstrainedLayoutEngine.execute

    def in_another_order(engine: ConstrainedLayoutEngine, of: Figure) -> None:
        solve(engine, of)
        for axes in of.axes:
            box = axes.get_position().bounds
            axes.set_position(tuple(box + rng.uniform(-1e-15, 1e-15, 4)))

    monkeypatch.setattr(ConstrainedLayoutEngine, "execute", in_another_order)
    one, other = (Figure(layout="constrained") for _ in range(2))
    for drawn in (one, other):
        drawn.suptitle("title")
        drawn.add_subplot().plot([0.0, 1.0])
    assert drawn_as(one, form, 100) == drawn_as(other, form, 100)
    assert one.axes[0].get_position().bounds == other.axes[0].get_position().bounds
