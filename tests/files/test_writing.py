"""Files are replaced as a whole: permissions, links, and targets that are not regular files."""

import os
import stat
from pathlib import Path

import numpy as np
import pytest
from cases import loop_over
from curves import S2
from refused import P, raises

import symspline as ss

SPLINE = ss.CubicSpline(None, P, S2)
POSES = np.broadcast_to(np.eye(4), (3, 4, 4))


def plot(file):
    pytest.importorskip("matplotlib")
    ss.CubicSpline(None, [[0.0], [1.0]], "r:1").plot(file)


# Archives, tables and pictures are written in three places.
WRITERS = {
    "curve.npz": SPLINE.save,
    "many.npz": lambda file: ss.save({"a": SPLINE}, file),
    "poses.txt": lambda file: ss.poses.write_tum(file, [0, 1, 2], POSES),
    "poses.kitti": lambda file: ss.poses.write_kitti(file, POSES),
    "poses.csv": lambda file: ss.poses.write_euroc(file, [0, 1, 2], POSES),
    "curve.png": plot,
}
writers = pytest.mark.parametrize("name", WRITERS)
places = pytest.mark.parametrize("name", ["curve.npz", "poses.txt", "curve.png"])
posix = pytest.mark.skipif(os.name != "posix", reason="permissions, links and pipes as on POSIX systems")


def mode(path):
    return stat.S_IMODE(os.stat(path).st_mode)


@posix
@writers
def test_errors_name_the_file_of_the_user(tmp_path, name):
    path = tmp_path / "missing" / name
    with pytest.raises(FileNotFoundError) as error:
        WRITERS[name](path)
    assert error.value.filename == str(path)


@posix
@places
@loop_over("own", [0o640, 0o444])
def test_an_existing_file_keeps_its_permissions(tmp_path, name, own):
    path = tmp_path / name
    path.write_bytes(b"as it was")
    path.chmod(own)
    WRITERS[name](path)
    assert mode(path) == own and path.read_bytes() != b"as it was"
    assert os.listdir(tmp_path) == [name]


@posix
def test_a_new_file_has_the_usual_permissions(tmp_path):
    (tmp_path / "other").write_bytes(b"")
    SPLINE.save(tmp_path / "curve.npz")
    assert mode(tmp_path / "curve.npz") == mode(tmp_path / "other")


@posix
@places
def test_the_target_of_a_symbolic_link_is_replaced(tmp_path, name):
    target, link = tmp_path / "kept" / name, tmp_path / name
    target.parent.mkdir()
    target.write_bytes(b"as it was")
    link.symlink_to(Path("kept") / name)
    WRITERS[name](link)
    assert link.is_symlink() and target.read_bytes() != b"as it was"
    target.unlink()
    WRITERS[name](link)
    assert link.is_symlink() and target.is_file()


@posix
def test_links_in_a_circle_raise(tmp_path):
    (tmp_path / "a.npz").symlink_to("b.npz")
    (tmp_path / "b.npz").symlink_to("a.npz")
    raises("symbolic link", SPLINE.save, tmp_path / "a.npz", error=OSError)
    assert (tmp_path / "a.npz").is_symlink()


@posix
@places
def test_devices_pipes_and_folders_are_refused(tmp_path, name):
    pipe, folder, device = tmp_path / f"pipe-{name}", tmp_path / f"folder-{name}", tmp_path / f"device-{name}"
    os.mkfifo(pipe)
    folder.mkdir()
    device.symlink_to(os.devnull)
    for path, what in ((pipe, "pipe"), (folder, "folder"), (device, "device")):
        raises(what, WRITERS[name], path, error=OSError)
    assert stat.S_ISFIFO(os.stat(pipe).st_mode) and stat.S_ISCHR(os.stat(os.devnull).st_mode)


@places
def test_long_names(tmp_path, name):
    path = tmp_path / ("é" * ((250 - len(name)) // 2) + name)
    WRITERS[name](path)
    assert path.is_file() and len(os.listdir(tmp_path)) == 1


@places
def test_data_are_on_disk_before_the_file_is_replaced(tmp_path, name, monkeypatch):
    path, calls = tmp_path / name, []
    sync, replace = os.fsync, Path.replace
    monkeypatch.setattr(os, "fsync", lambda number: (calls.append(os.fstat(number).st_size), sync(number)))
    monkeypatch.setattr(Path, "replace", lambda a, b: (calls.append("replace"), replace(a, b))[1])
    WRITERS[name](path)
    assert calls == [path.stat().st_size, "replace"]


@places
def test_an_older_file_stays_if_writing_fails(tmp_path, name, monkeypatch):
    path = tmp_path / name
    path.write_bytes(b"as it was")

    def full(number):
        raise OSError(28, "No space left on device")

    monkeypatch.setattr(os, "fsync", full)
    raises("No space", WRITERS[name], path, error=OSError)
    assert path.read_bytes() == b"as it was" and os.listdir(tmp_path) == [name]


NON_PATHS = [0, 1, True, 2.0, None, b"name", ["name"]]


@writers
def test_invalid_file_names_and_non_paths_raise(name):
    for file in ("", "a\0b", "\ud800"):
        raises(r"^file ", WRITERS[name], file)
    # Pictures need not go to a file, and are drawn before.
    for file in NON_PATHS if WRITERS[name] is not plot else [2.0, b"name"]:
        raises(r"^file must be ", WRITERS[name], file, error=TypeError)


def test_pictures_have_an_ending(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    plot("curve")
    assert os.listdir() == ["curve.png"]
    raises(r"'a\.xyz': the name of a picture must end in \..*\.png, ", SPLINE.plot, "a.xyz")


READERS = {
    "load": ss.load,
    "read_tum": ss.poses.read_tum,
    "read_kitti": ss.poses.read_kitti,
    "read_euroc": ss.poses.read_euroc,
}


@pytest.mark.parametrize("name", READERS)
@loop_over("file", NON_PATHS)
def test_readers_reject_non_files(name, file):
    raises(r"^file must be ", READERS[name], file, error=TypeError)


def test_poses_and_times_are_paths_or_open_text_files(tmp_path):
    ss.poses.write_kitti(tmp_path / "poses", POSES)
    raises(r"^times must be ", ss.poses.read_kitti, tmp_path / "poses", 0, error=TypeError)
    with open(tmp_path / "poses", "rb") as file, pytest.raises(TypeError, match="file must be open as text"):
        ss.poses.read_kitti(file)


def test_damaged_text_files(tmp_path):
    import gzip

    data = gzip.compress(b"0 0 0 0 0 0 0 1\n" * 1000)
    (tmp_path / "cut.txt.gz").write_bytes(data[:-9])
    raises(r"cut\.txt\.gz is damaged", ss.poses.read_tum, tmp_path / "cut.txt.gz")
