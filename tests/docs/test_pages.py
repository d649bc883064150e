"""The documentation keeps its promises: public names import, links lead somewhere, generated pictures are all used."""

from __future__ import annotations

import ast
import importlib
import re
import runpy
import sys
from pathlib import Path

import pytest

import sim.commands.exit_codes as exit_codes
from ibvs_qp.supervision.faults import Fault

ROOT = Path(__file__).parents[2]
DOCS = ROOT / "docs"
PAGES = [
    ROOT / "README.md",
    ROOT / "CHANGELOG.md",
    *(page for page in DOCS.rglob("*.md") if "_build" not in page.parts),
]
STABLE = (DOCS / "api-stability.md").read_text(encoding="utf-8")
_LINK = re.compile(r"\]\((?!https?://|#)([^)#\s]+)(?:#[^)]*)?\)")
_MENTION = re.compile(r"\bdocs/[\w/-]+\.md")


def public() -> list[tuple[str, tuple[str, ...]]]:
    """Modules and names of the table; no names stand for all of the module's ``__all__``."""
    rows = [row.split("|")[1:3] for row in STABLE[STABLE.index("| module |") :].split("\n\n")[0].splitlines()[2:]]
    return [(module.strip(" `"), tuple(re.findall(r"`(\w+)`", names))) for module, names in rows]


@pytest.mark.parametrize(("module", "names"), public(), ids=lambda value: value if isinstance(value, str) else "")
def test_public_names_import(module: str, names: tuple[str, ...]) -> None:
    home = importlib.import_module(module)
    for name in names or home.__all__:
        assert getattr(home, name) is not None
        if name[0].isupper() and isinstance(getattr(home, name), type):
            assert getattr(home, name).__doc__, name


def test_what_examples_and_snippets_import_is_public() -> None:
    listed = {module: set(names) for module, names in public()}
    texts = [file.read_text(encoding="utf-8") for file in sorted((ROOT / "examples").glob("*.py"))]
    for page in PAGES:
        texts += re.findall(r"^```python\n(.*?)^```", page.read_text(encoding="utf-8"), re.MULTILINE | re.DOTALL)
    for text in texts:
        for node in ast.walk(ast.parse(text)):
            if not isinstance(node, ast.ImportFrom) or not (node.module or "").startswith(
                ("allocation", "ibvs_qp", "sim")
            ):
                continue
            home = importlib.import_module(str(node.module))
            names = listed.get(str(node.module)) or set(getattr(home, "__all__", ())) & {*ibvs_qp_names()}
            wrong = {alias.name for alias in node.names} - names
            assert not wrong, f"{node.module}: {wrong} is not in docs/api-stability.md"


def ibvs_qp_names() -> set[str]:
    """Public names of the packages, which modules may export again."""
    return {name for module in ("ibvs_qp", "allocation") for name in importlib.import_module(module).__all__}


@pytest.mark.parametrize("page", PAGES, ids=lambda page: page.relative_to(ROOT).as_posix())
def test_links_lead_to_files(page: Path) -> None:
    text = re.sub(r"^```.*?^```", "", page.read_text(encoding="utf-8"), flags=re.MULTILINE | re.DOTALL)
    for link in _LINK.findall(text):
        assert (page.parent / link).exists(), link


def test_pages_that_the_code_names_exist() -> None:
    for folder in ("allocation", "ibvs_qp", "sim", "examples", "notebooks", "tests"):
        for file in (ROOT / folder).rglob("*"):
            if file.suffix in (".py", ".toml"):
                for mention in _MENTION.findall(file.read_text(encoding="utf-8")):
                    known = (ROOT / mention).is_file() or mention == "docs/faults.md"
                    assert known, f"{file.relative_to(ROOT)} names {mention}"


def test_every_page_is_reached_from_the_front_page() -> None:
    listed = (DOCS / "index.md").read_text(encoding="utf-8") + (DOCS / "api" / "index.md").read_text(encoding="utf-8")
    for page in PAGES[2:]:
        name = page.relative_to(DOCS).with_suffix("").as_posix()
        assert name == "index" or re.search(rf"^{name.removeprefix('api/')}$|^{name}$", listed, re.MULTILINE), name


def test_pictures_are_used_and_small() -> None:
    text = "".join(page.read_text(encoding="utf-8") for page in PAGES)
    for picture in (DOCS / "pictures").iterdir():
        assert f"pictures/{picture.name})" in text, picture.name
        assert picture.stat().st_size <= 150_000, picture.name


def test_the_programs_that_draw_the_pictures_import(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.syspath_prepend(DOCS / "draw")
    monkeypatch.setattr(sys, "argv", ["draw", "none of them"])
    assert runpy.run_path(str(DOCS / "draw" / "__main__.py"))["PICTURES"]


PAGE = (ROOT / "docs" / "faq.md").read_text(encoding="utf-8")
#: Messages in the first column of the tables.
MESSAGES = re.findall(r"^\| `([^`]*)`", PAGE.replace("reduced to", ""), re.MULTILINE)


@pytest.fixture(scope="module")
def texts() -> str:
    """All string text of the packages, without the joints of split literals."""
    files = (file for package in ("allocation", "ibvs_qp", "sim") for file in (ROOT / package).rglob("*.py"))
    joined = "\n".join(file.read_text(encoding="utf-8") for file in files)
    return re.sub(r'"\s*\n\s*f?"', "", joined)


@pytest.mark.parametrize("message", MESSAGES)
def test_a_quoted_message_is_in_the_source(message: str, texts: str) -> None:
    pieces = [piece.strip(" ;:,.()[]") for piece in message.split("…")]
    assert max(pieces, key=len) in texts


def test_the_page_has_thirty_messages() -> None:
    assert len(MESSAGES) == 30


def test_every_reason_of_the_supervisor_has_advice() -> None:
    table = PAGE[PAGE.index("| reason | look at |") :].split("\n\n")[0]
    told = {reason.strip() for row in table.splitlines()[2:] for reason in row.split("|")[1].split(",")}
    joined = {str(fault) for fault in Fault if "," in fault}  # a reason that has a comma of its own
    assert {str(fault) for fault in Fault} - joined <= told
    assert all(reason in table for reason in joined)


def test_every_exit_code_is_listed() -> None:
    codes = {value for name, value in vars(exit_codes).items() if name.startswith("EXIT_")}
    assert codes | {0} == {int(code) for code in re.findall(r"^\| (\d+) \|", PAGE, re.MULTILINE)}
