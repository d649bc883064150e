"""The lock of a folder: one holder at a time."""

from __future__ import annotations

from pathlib import Path

import pytest

from ibvs_qp.config.errors import IbvsQpError
from sim.storage.folder import locked_folder


def test_a_folder_has_one_holder_at_a_time(tmp_path: Path) -> None:
    folder = tmp_path / "run"
    with locked_folder(folder):
        with pytest.raises(IbvsQpError, match="in use by another process"), locked_folder(folder):
            pass
        (folder / "file").write_text("")
    with locked_folder(folder):
        assert (folder / "file").exists()
