"""Rendered copies of the notebooks: Jupyter files with outputs, which a code host displays.

Usage: ``python -m sim.notebook.render`` for all notebooks, or with the stems of some. Every notebook runs in full.
"""

from __future__ import annotations

import importlib.util
import os
import subprocess
import sys
import tempfile
from pathlib import Path
from typing import Any

from ibvs_qp.config.errors import ConfigError
from sim.notebook.common import SHORT_VARIABLE

#: Folder of the notebooks in a source tree; an installed wheel has none.
NOTEBOOKS = Path(__file__).parents[2] / "notebooks"
#: Largest size of a copy [bytes]; a code host displays a few megabytes at most.
LARGEST_COPY = 1_500_000
#: Identifier of the cell that only the copy has.
NOTE_ID = "note"
#: Beginning of marimo's own elements, in HTML and escaped. They need its server, so the copy leaves them out.
_LIVE = ("<marimo-", "&lt;marimo-")


def notebook_files(folder: Path = NOTEBOOKS) -> list[Path]:
    """All notebooks, by number."""
    return sorted(folder.glob("[0-9][0-9]_*.py"))


def rendered_file(notebook: Path) -> Path:
    """File of a notebook's copy."""
    return notebook.parent / "rendered" / f"{notebook.stem}.ipynb"


def render(notebook: Path) -> Path:
    """Run a notebook in its own process and write its copy.

    Raises:
        RuntimeError: When a cell fails or the copy is too large; the old copy remains.
    """
    import nbformat

    with tempfile.TemporaryDirectory() as folder:
        exported = Path(folder) / "copy.ipynb"
        export = ["export", "ipynb", str(notebook), "--sort", "top-down", "--include-outputs", "-o", str(exported)]
        # This interpreter on the project's own notebooks, without a shell.
        done = subprocess.run(  # nosec B603
            [sys.executable, "-m", "marimo", "-q", "-y", *export],
            env={name: value for name, value in os.environ.items() if name != SHORT_VARIABLE},
            cwd=notebook.parents[1],
            capture_output=True,
            text=True,
        )
        if done.returncode:
            raise RuntimeError(f"{notebook.name} does not run:\n{done.stderr or done.stdout}")
        copy = nbformat.read(exported, as_version=4)
    for cell in copy.cells:
        if cell.cell_type == "code":
            cell.outputs = [output for output in cell.outputs if _is_static(output)]
    place = f"notebooks/{notebook.name}"
    note = f"*A copy of [`{place}`](../{notebook.name}) for reading. Sliders and switches need* `marimo edit {place}`"
    copy.cells.insert(0, nbformat.v4.new_markdown_cell(note, id=NOTE_ID))
    text = nbformat.writes(copy) + "\n"
    if len(text) > LARGEST_COPY:
        raise RuntimeError(f"the copy of {notebook.name} has {len(text)} bytes, allowed are {LARGEST_COPY}")
    file = rendered_file(notebook)
    file.parent.mkdir(exist_ok=True)
    file.write_text(text, encoding="utf-8")
    return file


def _is_static(output: Any) -> bool:
    """Whether an output needs no running notebook: no widget, no printed text."""
    if output.output_type == "error":
        raise RuntimeError(f"a cell fails: {output.ename}: {output.evalue}")
    if output.output_type == "stream":  # warnings of libraries, and marimo's own run of the test cells
        return False
    return not any(live in str(content) for content in output.get("data", {}).values() for live in _LIVE)


def chosen(names: list[str]) -> list[Path]:
    """Notebooks with these stems, or all.

    Raises:
        ConfigError: When there is no such notebook.
    """
    files = {file.stem: file for file in notebook_files()}
    for name in names:
        if name not in files:
            raise ConfigError(f"no notebook {name!r}; known: {', '.join(files) or 'none (run in a source tree)'}")
    return [files[name] for name in names] if names else list(files.values())


def main(names: list[str]) -> int:
    """Render the notebooks with these stems, or all."""
    try:
        if importlib.util.find_spec("marimo") is None:
            raise ConfigError("notebooks need marimo; install it with pip install -c constraints.txt -e '.[notebooks]'")
        for notebook in chosen(names):
            file = render(notebook)
            print(f"{file.relative_to(NOTEBOOKS.parent)}: {file.stat().st_size / 1e3:.0f} kB")
    except ConfigError as error:
        print(f"ibvs-qp: error: {error}", file=sys.stderr)
        return 2
    return 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
