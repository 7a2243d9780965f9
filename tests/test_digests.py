"""The digest of a large file is remembered while the file stays as it is, and never beyond."""

import os
import subprocess
import sys
from hashlib import sha256
from pathlib import Path

import pytest
from definitions import VALID

from twindisc_cli import digests
from twindisc_cli.cli import main
from twindisc_cli.digests import digest_of


@pytest.fixture
def cache(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """The cache folder, where every file is large and none has just changed."""
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "cache"))
    monkeypatch.setattr(digests, "REMEMBERED_FROM", 1)
    monkeypatch.setattr(digests, "SETTLED_NS", -(10**9))
    return tmp_path / "cache/twindisc/digests.json"


def not_read(monkeypatch: pytest.MonkeyPatch) -> None:
    def refuse(path: Path) -> bytes:
        raise AssertionError(f"{path} was read")

    monkeypatch.setattr(digests, "read_regular", refuse)


def of(content: bytes) -> str:
    return sha256(content).hexdigest()


def test_a_file_is_read_once(tmp_path: Path, cache: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    (tmp_path / "rig.csv").write_bytes(b"1,2")
    assert digest_of(tmp_path / "rig.csv") == of(b"1,2")
    assert cache.exists()
    not_read(monkeypatch)
    assert digest_of(tmp_path / "rig.csv") == of(b"1,2")


def test_a_file_of_the_same_length_and_date_with_another_content_is_another(tmp_path: Path, cache: Path) -> None:
    path = tmp_path / "rig.csv"
    path.write_bytes(b"1,2")
    was = path.stat()
    assert digest_of(path) == of(b"1,2")
    path.write_bytes(b"1,3")
    os.utime(path, ns=(was.st_atime_ns, was.st_mtime_ns))
    assert digest_of(path) == of(b"1,3")
    (tmp_path / "new.csv").write_bytes(b"1,4")
    (tmp_path / "new.csv").replace(path)
    assert digest_of(path) == of(b"1,4")


def test_a_file_that_changed_just_now_is_not_remembered(
    tmp_path: Path, cache: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(digests, "SETTLED_NS", 3600 * 10**9)
    (tmp_path / "rig.csv").write_bytes(b"1,2")
    assert digest_of(tmp_path / "rig.csv") == of(b"1,2")
    assert not cache.exists()


@pytest.mark.parametrize("content", [b"", b"[]", b"{", b'{"1:2": 3}', b"\xff", b"[" * 100_000])
def test_a_broken_cache_is_made_again(tmp_path: Path, cache: Path, content: bytes) -> None:
    cache.parent.mkdir(parents=True)
    cache.write_bytes(content)
    (tmp_path / "rig.csv").write_bytes(b"1,2")
    assert [digest_of(tmp_path / "rig.csv") for _ in range(2)] == [of(b"1,2")] * 2


def test_where_no_cache_can_be_the_file_is_read(tmp_path: Path, cache: Path) -> None:
    (tmp_path / "cache").write_text("a file, not a folder")
    (tmp_path / "rig.csv").write_bytes(b"1,2")
    assert [digest_of(tmp_path / "rig.csv") for _ in range(2)] == [of(b"1,2")] * 2


def test_what_is_up_to_date_is_told_without_numpy_and_hdf5(tmp_path: Path) -> None:
    (tmp_path / "x.toml").write_text(VALID)
    command = ["check", str(tmp_path / "x.toml"), "-o", str(tmp_path / "out")]
    with pytest.raises(SystemExit):
        main(command)
    code = "import sys, atexit; from twindisc_cli.cli import main; atexit.register(lambda: print(*sys.modules)); main()"
    told = subprocess.run([sys.executable, "-c", code, *command], capture_output=True, text=True, check=False).stdout
    assert "up to date" in told
    assert not {"numpy", "h5py", "pandas", "matplotlib", "scipy"} & set(told.split())
