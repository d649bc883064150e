"""docs/faq.md has every text of a refusal in the source, and every reason of the supervisor."""

from __future__ import annotations

import re
from pathlib import Path

import pytest

import sim.commands.exit_codes as exit_codes
import sim.report.refusals as refusals
from ibvs_qp.supervision.faults import Fault

PAGE = Path(__file__).parents[2] / "docs" / "faq.md"


def test_the_page_has_the_texts_of_the_code() -> None:
    page = PAGE.read_text(encoding="utf-8")
    assert refusals.put_into(page) == page, "python -m sim.report.refusals docs/faq.md"


def test_every_reason_of_the_supervisor_has_advice() -> None:
    page = PAGE.read_text(encoding="utf-8")
    table = page[page.index("| reason | look at |") :].split("\n\n")[0]
    told = {reason.strip() for row in table.splitlines()[2:] for reason in row.split("|")[1].split(",")}
    joined = {str(fault) for fault in Fault if "," in fault}  # a reason that has a comma of its own
    assert {str(fault) for fault in Fault} - joined <= told
    assert all(reason in table for reason in joined)


def test_every_exit_code_is_told() -> None:
    page = PAGE.read_text(encoding="utf-8")
    codes = {value for name, value in vars(exit_codes).items() if name.startswith("EXIT_")}
    assert codes | {0} == {int(code) for code in re.findall(r"^\| (\d+) \|", page, re.MULTILINE)}


@pytest.mark.parametrize(
    ("source", "in_flight", "found"),
    [
        ('rejected.append("lines: too many of them")', True, ["lines: too many of them"]),
        ('raise ConfigError(f"mass_kg = {mass} kg is refused")', False, ["mass_kg = … kg is refused"]),
        ('allowed = "one number per rotor"', False, ["one number per rotor"]),
        ('raise out_of_range("mass", 1, "kg", "must lie above zero")', False, ["must lie above zero"]),
        ('"""A docstring of words."""\nx: float = setting(1.0, "a doc of words")', True, []),
        ('logger.warning("CC = %r: [bold]no command[/]", name)', True, ["CC = …: no command"]),
        ('raise RuntimeError("a fault of our own")', False, []),
    ],
)
def test_texts_of_a_module(source: str, in_flight: bool, found: list[str]) -> None:
    assert refusals.texts_of(source, in_flight) == found


def test_the_reasons_of_the_bridge_are_found() -> None:
    bridge, gate = (refusals.refusals()[f"ibvs_qp/interfaces/px4/{name}.py"] for name in ("bridge", "gate"))
    assert {"rest of the vehicle for the self-check", "flight ended: …"} <= set(bridge) and "link lost: …" in gate


def test_a_new_refusal_is_missed_on_the_page(monkeypatch: pytest.MonkeyPatch) -> None:
    page, known = PAGE.read_text(encoding="utf-8"), refusals.refusals()
    place = "ibvs_qp/validation/clock.py"
    monkeypatch.setattr(refusals, "refusals", lambda: known | {place: [*known[place], "the clock runs backwards"]})
    assert "the clock runs backwards" in refusals.put_into(page) != page
    monkeypatch.setattr(refusals, "refusals", lambda: known | {"ibvs_qp/new_room.py": ["no room for it"]})
    with pytest.raises(ValueError, match=r"ibvs_qp/new_room\.py"):
        refusals.put_into(page)
