"""Cell sources of a notebook and of its copy, to tell whether the copy is current."""

from __future__ import annotations

import importlib.util
from pathlib import Path
from typing import Any

from sim.notebook.render import NOTE_ID

#: Kind of a cell ("code" or "markdown") and its text.
CellSource = tuple[str, str]


def load_app(notebook: Path) -> Any:
    """The marimo app of a notebook; no cell has run, but for its setup."""
    spec = importlib.util.spec_from_file_location(f"notebook_{notebook.stem}", notebook)
    assert spec is not None and spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module.app


def notebook_sources(notebook: Path) -> list[CellSource]:
    """Cells as an export of a notebook, without running it, would hold them."""
    import nbformat
    from marimo._ast import load  # the command line's export does the same, two seconds later
    from marimo._ast.app import InternalApp
    from marimo._convert.ipynb.from_ir import convert_from_ir_to_ipynb

    app = load.load_app(notebook)
    assert app is not None, f"{notebook} is no notebook"
    text = convert_from_ir_to_ipynb(InternalApp(app), sort_mode="top-down")
    return _sources(nbformat.reads(text, as_version=4))


def copy_sources(file: Path) -> list[CellSource]:
    """Cells of a copy, without the note at its beginning."""
    import nbformat

    return _sources(nbformat.read(file, as_version=4))


def _sources(notebook: Any) -> list[CellSource]:
    return [(cell.cell_type, cell.source.strip()) for cell in notebook.cells if cell.id != NOTE_ID]
