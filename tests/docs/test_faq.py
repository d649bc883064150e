"""docs/faq.md quotes messages of the source, and has every reason of the supervisor and every exit code."""

from __future__ import annotations

import re
from pathlib import Path

import pytest

import sim.commands.exit_codes as exit_codes
from ibvs_qp.supervision.faults import Fault

ROOT = Path(__file__).parents[2]
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
