"""The name under which a dialog saves."""

from __future__ import annotations

from pathlib import Path

import pytest

pytest.importorskip("imgui_bundle")

from viewer.app.file_dialog import named_file
from viewer.errors import InputError


def test_the_file_is_what_the_user_means(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    monkeypatch.setenv("HOME", str(tmp_path))
    assert named_file(" a.csv ", ".csv") == named_file("~/a", ".csv") == tmp_path / "a.csv"
    assert named_file("a.b", ".csv") == tmp_path / "a.b.csv"
    assert named_file("A.Scan4D.json", ".scan4d.json") == tmp_path / "A.Scan4D.json"
    assert named_file("a.json", ".scan4d.json") == tmp_path / "a.json.scan4d.json"
    assert named_file("a.TPS", ".csv", ".tps") == tmp_path / "a.TPS"
    assert named_file("a", ".csv", ".tps") == tmp_path / "a.csv"
    for wrong in ("", str(tmp_path), "~"):
        with pytest.raises(InputError, match="is a folder"):
            named_file(wrong, ".csv")
    for wrong in ("nowhere/a.csv", "f" * 300 + "/a.csv"):
        with pytest.raises(InputError, match="this folder does not exist"):
            named_file(wrong, ".csv")
