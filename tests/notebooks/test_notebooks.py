"""Every notebook runs, its test cells pass, it is well formed, and its copy for reading is current."""

import ast
import functools
import re
import runpy
import subprocess
import sys
from pathlib import Path

import nbformat
import pytest
from marimo._ast import load
from marimo._ast.app import InternalApp
from marimo._convert.ipynb.from_ir import convert_from_ir_to_ipynb

from sim.notebook.common import SHORT_VARIABLE
from sim.notebook.render import (
    LARGEST_COPY,
    NOTE_ID,
    NOTEBOOKS,
    chosen,
    notebook_files,
    rendered_file,
)

FILES = notebook_files()
#: What a copy must not need: marimo's elements, scripts, anything from elsewhere.
LIVE = ("<marimo-", "&lt;marimo-", "<script", "<iframe", 'src="http', "src='http", "application/javascript")


def test_functions(file: Path) -> list[str]:
    """Names of the test functions in a notebook's cells."""
    tree = ast.parse(file.read_text(encoding="utf-8"))
    return [node.name for node in ast.walk(tree) if isinstance(node, ast.FunctionDef) and node.name.startswith("test_")]


test_functions.__test__ = False  # type: ignore[attr-defined]
#: Files that run; all but the first are slow.
RUN = [pytest.param(file, id=file.stem, marks=[pytest.mark.slow] * (file != FILES[0])) for file in FILES]
CASES = [
    pytest.param(file, name, id=f"{file.stem}-{name}", marks=[pytest.mark.slow] * (file != FILES[0]))
    for file in FILES
    for name in test_functions(file)
]
each = pytest.mark.parametrize("file", FILES, ids=[file.stem for file in FILES])


@pytest.fixture(autouse=True)
def short_form(monkeypatch):
    monkeypatch.setenv(SHORT_VARIABLE, "1")


@functools.cache
def run(file: Path) -> dict:
    """Run a notebook; what its cells define."""
    return runpy.run_path(str(file))["app"].run()[1]


@pytest.mark.parametrize("file", RUN)
def test_notebook_runs_and_has_test_cells(file):
    run(file)
    assert test_functions(file)


@pytest.mark.parametrize(("file", "name"), CASES)
def test_cell(file, name, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    run(file)[name]()
    assert not list(tmp_path.iterdir()), "marimo's editor runs these tests when the notebook is opened"


def sources(notebook) -> list[tuple[str, str]]:
    """Kind and text of every cell, without the note of a copy."""
    return [(cell.cell_type, cell.source.strip()) for cell in notebook.cells if cell.id != NOTE_ID]


def notebook_sources(file: Path) -> list[tuple[str, str]]:
    """Cells that an export of a notebook would have, without running it; the command line takes 2 s longer."""
    app = load.load_app(file)
    assert app is not None
    return sources(nbformat.reads(convert_from_ir_to_ipynb(InternalApp(app), sort_mode="top-down"), as_version=4))


@each
def test_copy_has_the_same_cells(file):
    assert sources(nbformat.read(rendered_file(file), as_version=4)) == notebook_sources(file), (
        "python -m sim.notebook.render"
    )


@each
def test_copy_shows_pictures_without_network(file):
    copy, outputs = rendered_file(file), []
    assert copy.stat().st_size <= LARGEST_COPY
    for cell in nbformat.read(copy, as_version=4).cells:
        outputs += cell.get("outputs", [])
    assert not [output for output in outputs if output.output_type in ("error", "stream")]
    assert not [word for word in LIVE for output in outputs if word in str(output.get("data", ""))]
    assert any("image/png" in output.get("data", {}) for output in outputs)


def test_copies_belong_to_notebooks():
    copies = {file.stem for file in (NOTEBOOKS / "rendered").glob("*.ipynb")}
    assert copies == {file.stem for file in FILES}


def test_notebooks_are_well_formed():
    words = [sys.executable, "-m", "marimo", "-q", "check", "--strict", *map(str, FILES)]
    done = subprocess.run(words, capture_output=True, text=True)
    assert done.returncode == 0, done.stdout + done.stderr


@each
def test_no_line_of_a_formula_reads_as_a_list(file):
    """A browser takes a line that begins with a sign and a space for a list, and shows the formula as it is typed."""
    formulas = re.findall(r"\$\$(.*?)\$\$", file.read_text(encoding="utf-8"), re.DOTALL)
    assert not [line for formula in formulas for line in formula.split("\n") if re.match(r"\s*[-+*] ", line)]


def test_unknown_notebook_is_named():
    with pytest.raises(Exception, match="no notebook '07_none'; known: 01_first_flight"):
        chosen(["07_none"])
