import pytest

from ffd_lightning.errors import ConfigError, DataError
from ffd_lightning.files import atomic_file, lock_folder


@pytest.mark.parametrize("durable", [True, False])
def test_nobody_sees_half_of_a_file(tmp_path, durable):
    path = tmp_path / "file"
    path.write_text("earlier")
    with atomic_file(path, durable) as first, atomic_file(path, durable) as second:
        first.write(b"one")
        second.write(b"another")
        assert path.read_text() == "earlier"
    assert path.read_text() == "one"
    file = atomic_file(path)
    file.__enter__().write(b"half of it")
    assert file.__exit__(KeyError, KeyError(), None) is False
    assert path.read_text() == "one"
    assert list(tmp_path.iterdir()) == [path]


def test_a_folder_is_taken_once(tmp_path):
    lock = lock_folder(tmp_path / "new", "taken")  # kept: what is collected frees its file too
    with lock, pytest.raises(ConfigError, match="taken"):
        lock_folder(tmp_path / "new", "taken")
    with lock_folder(tmp_path / "new", "taken"):
        pass
    (tmp_path / "file").touch()
    with pytest.raises(DataError, match="cannot write the folder"):
        lock_folder(tmp_path / "file", "taken")
