"""JSON from files of unknown origin."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

from ibvs_qp.config.files import UnreadableFile, read_bytes
from sim.storage.limits import LARGEST_JSON


def read_json(file: Path) -> Any:
    """Content of a JSON file.

    Raises:
        UnreadableFile: When it cannot be read or is no JSON; 1000 levels of nesting are none that is read.
    """
    try:
        return json.loads(read_bytes(file, LARGEST_JSON))
    except (ValueError, RecursionError) as error:
        raise UnreadableFile(file, f"no JSON ({type(error).__name__}: {error})") from None
