"""The output folder: whole or not at all, and nobody else's files."""

from __future__ import annotations

import hashlib
import json
from pathlib import Path

import pytest

from bfppc_synth.codegen import package
from bfppc_synth.codegen.package import Overwrite, may_write, write_folder
from bfppc_synth.errors import UsageError

FILES = {"controller.py": b"one", "c/src/a.c": b"two", "plant.yaml": b"\xff\r\n"}


def write(out, files=FILES, name="plant_a", overwrite=Overwrite.REFUSE):
    write_folder(files, out, name=name, status="certified", overwrite=overwrite)


def names(folder):
    return sorted(path.name for path in folder.iterdir())


def contents(folder):
    return {
        path.relative_to(folder).as_posix(): path.read_bytes()
        for path in sorted(folder.rglob("*"))
        if path.is_file() and path.name != "manifest.json"
    }


def test_every_file_is_written_and_the_manifest_lists_its_hash(tmp_path):
    out = tmp_path / "deep" / "generated" / "plant_a"
    write(out)
    assert contents(out) == FILES
    manifest = json.loads((out / "manifest.json").read_text())
    assert manifest == {
        "format": "bfppc-synth/manifest/1",
        "name": "plant_a",
        "status": "certified",
        "files": {path: hashlib.sha256(data).hexdigest() for path, data in FILES.items()},
    }
    assert names(out.parent) == ["plant_a"]


def test_the_same_files_give_the_same_manifest(tmp_path):
    write(tmp_path / "one")
    write(tmp_path / "two", dict(reversed(FILES.items())))
    first, second = ((tmp_path / n / "manifest.json").read_bytes() for n in ("one", "two"))
    assert first == second
    assert first.endswith(b"}\n")


def test_the_folder_has_the_rights_of_any_new_folder(tmp_path):
    write(tmp_path / "out")
    (tmp_path / "other").mkdir()
    assert (tmp_path / "out").stat().st_mode == (tmp_path / "other").stat().st_mode


def test_a_second_run_replaces_only_what_the_first_one_wrote(tmp_path):
    out = tmp_path / "out"
    write(out)
    (out / "notes.txt").write_text("mine")
    (out / "c" / "mine").mkdir()
    (out / "c" / "mine" / "x.c").write_text("mine too")
    (out / "empty").mkdir()
    (out / "link").symlink_to("notes.txt")
    (out / "controller.py").write_text("edited")
    write(out, {"controller.py": b"new", "report.json": b"{}"})
    assert contents(out) == {
        "controller.py": b"new",
        "report.json": b"{}",
        "notes.txt": b"mine",
        "link": b"mine",
        "c/mine/x.c": b"mine too",
    }
    assert (out / "link").is_symlink()
    assert (out / "empty").is_dir()
    assert names(tmp_path) == ["out"]


def test_python_caches_of_old_code_are_dropped(tmp_path):
    out = tmp_path / "out"
    write(out)
    (out / "__pycache__").mkdir()
    (out / "__pycache__" / "controller.cpython-311.pyc").write_bytes(b"stale")
    write(out)
    assert contents(out) == FILES


def test_a_folder_of_another_plant_is_refused_unless_forced(tmp_path):
    out = tmp_path / "out"
    write(out)
    before = contents(out)
    with pytest.raises(UsageError, match="belongs to the plant plant_a, not to plant_b") as caught:
        write(out, {"x": b""}, name="plant_b")
    assert caught.value.exit_code == 2
    assert "--force" in str(caught.value)
    assert contents(out) == before
    write(out, {"x": b""}, name="plant_b", overwrite=Overwrite.FORCE)
    assert contents(out) == {"x": b""}


def test_a_folder_with_files_but_no_manifest_is_refused_unless_forced(tmp_path):
    out = tmp_path / "out"
    out.mkdir()
    may_write(out, name="plant_a", overwrite=Overwrite.REFUSE)
    (out / "thesis.tex").write_text("mine")
    for overwrite in (may_write, lambda out, **kw: write(out)):
        with pytest.raises(UsageError, match=r"no manifest\.json of this tool"):
            overwrite(out, name="plant_a", overwrite=Overwrite.REFUSE)
    write(out, overwrite=Overwrite.FORCE)
    assert contents(out) == {**FILES, "thesis.tex": b"mine"}


@pytest.mark.parametrize(
    "text",
    ["", "[]", "{}", '{"name": "plant_a"}', '{"format": "npm/1", "name": "plant_a"}', "\xff"],
)
def test_a_manifest_of_someone_else_is_no_manifest(tmp_path, text):
    out = tmp_path / "out"
    out.mkdir()
    (out / "manifest.json").write_bytes(text.encode("latin-1"))
    with pytest.raises(UsageError, match="no manifest"):
        write(out)


def test_a_file_of_the_user_in_the_way_is_kept_unless_forced(tmp_path):
    out = tmp_path / "out"
    write(out)
    (out / "report.html").write_text("mine")
    (out / "verify").write_text("mine")
    new = {**FILES, "report.html": b"new", "verify/run.sh": b"new"}
    with pytest.raises(UsageError, match="move it away"):
        write(out, new)
    assert (out / "report.html").read_text() == (out / "verify").read_text() == "mine"
    assert names(tmp_path) == ["out"]
    write(out, new, overwrite=Overwrite.FORCE)
    assert contents(out) == new


def test_a_forged_manifest_reaches_nothing_outside(tmp_path):
    out, outside = tmp_path / "out", tmp_path / "precious"
    outside.write_text("keep")
    write(out)
    manifest = json.loads((out / "manifest.json").read_text())
    manifest["files"] |= {"../precious": "", str(outside): "", "c/../../precious": ""}
    (out / "manifest.json").write_text(json.dumps(manifest))
    write(out)
    assert outside.read_text() == "keep"
    assert contents(out) == FILES


@pytest.mark.parametrize(
    "path", ["../x", "/x", "a/../x", "manifest.json", "", "a//b", "./a", "a\\b"]
)
def test_a_path_that_leads_elsewhere_is_refused(tmp_path, path):
    with pytest.raises(UsageError, match="is not a path that a generated folder can hold"):
        write(tmp_path / "out", {path: b""})
    assert names(tmp_path) == []


def test_a_file_in_the_place_of_the_folder_is_refused(tmp_path):
    file = tmp_path / "file"
    file.write_text("mine")
    for out in (file, file / "below" / "it"):
        for overwrite in Overwrite:
            with pytest.raises(UsageError, match="file: is a file") as caught:
                write(out, overwrite=overwrite)
            assert "--out" in str(caught.value)
    assert file.read_text() == "mine"


@pytest.mark.parametrize("target", ["folder", "nowhere"])
def test_a_symbolic_link_is_refused(tmp_path, target):
    (tmp_path / "folder").mkdir()
    (tmp_path / "link").symlink_to(target)
    for overwrite in Overwrite:
        with pytest.raises(UsageError, match="symbolic link"):
            write(tmp_path / "link", overwrite=overwrite)
    assert (tmp_path / "link").is_symlink()
    write(tmp_path / "folder" / "inside")


def test_a_link_above_the_folder_is_followed(tmp_path):
    (tmp_path / "disk").mkdir()
    (tmp_path / "link").symlink_to("disk")
    write(tmp_path / "link" / "out")
    assert contents(tmp_path / "disk" / "out") == FILES


def test_a_relative_folder_and_the_present_one(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    write(Path("generated/plant_a"))
    assert contents(tmp_path / "generated" / "plant_a") == FILES
    assert names(tmp_path) == ["generated"]


def test_the_current_directory_is_not_pulled_away(tmp_path, monkeypatch):
    (tmp_path / "here" / "below").mkdir(parents=True)
    monkeypatch.chdir(tmp_path / "here")
    for out in (Path(), tmp_path, tmp_path / "here"):
        for overwrite in Overwrite:
            with pytest.raises(UsageError, match="current directory"):
                write(out, overwrite=overwrite)
    write(Path("below"))
    assert contents(tmp_path / "here" / "below") == FILES


@pytest.mark.parametrize("stage", ["_fill", "_carry_over", "_write_manifest", "_swap"])
@pytest.mark.parametrize("existing", ["nothing", "an old folder"])
def test_an_interruption_leaves_the_old_folder_or_none(tmp_path, monkeypatch, stage, existing):
    out = tmp_path / "out"
    if existing != "nothing":
        write(out)
        (out / "notes.txt").write_text("mine")
    before = contents(tmp_path)

    def interrupt(*args, **kwargs):
        raise KeyboardInterrupt

    monkeypatch.setattr(package, stage, interrupt)
    with pytest.raises(KeyboardInterrupt):
        write(out, {"controller.py": b"half"})
    assert contents(tmp_path) == before
    assert names(tmp_path) == ([] if existing == "nothing" else ["out"])


def test_an_interruption_between_the_two_renames_brings_the_old_folder_back(tmp_path, monkeypatch):
    out = tmp_path / "out"
    write(out)
    rename = Path.rename

    def once(self, target):
        if self.name.endswith(".new"):
            raise KeyboardInterrupt
        return rename(self, target)

    monkeypatch.setattr(Path, "rename", once)
    with pytest.raises(KeyboardInterrupt):
        write(out, {"controller.py": b"half"})
    assert contents(out) == FILES
    assert names(tmp_path) == ["out"]


def test_what_the_system_refuses_is_a_sentence(tmp_path, monkeypatch):
    def full(*args, **kwargs):
        raise OSError(28, "No space left on device")

    monkeypatch.setattr(package, "_fill", full)
    with pytest.raises(UsageError, match="No space left on device: nothing was written"):
        write(tmp_path / "out")
    assert names(tmp_path) == []
