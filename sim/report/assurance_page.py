"""Table of faults, bounds and reactions in docs/safety.md, from the policy and the settings that it names.

``python -m sim.report.assurance_page docs/safety.md`` renews it; a test compares the page with the policy.
"""

from __future__ import annotations

import dataclasses
import sys
from pathlib import Path

from ibvs_qp.config import SafetySettings
from ibvs_qp.supervision.faults import POLICY, Rule
from sim.evaluate.table import markdown

#: Marks around the table.
BEGIN, END = "<!-- policy: generated -->", "<!-- end of policy -->"


def policy_table() -> str:
    """Markdown table of all faults: detection, and states by the time for which they have been present."""
    units = {field.name: field.metadata.get("unit", "") for field in dataclasses.fields(SafetySettings)}
    settings = SafetySettings()
    rows = []
    for fault, rule in POLICY.items():
        bounds = [f"`{name}` {getattr(settings, name)} {units[name]}".rstrip() for name in rule.bounds]
        rows.append([str(fault), ", ".join(bounds) or "–", _stages(rule), f"{rule.recovery_s:g} s"])
    return markdown(("fault", "bounds", "reaction", "present after its last detection for"), rows)


def _stages(rule: Rule) -> str:
    return ", ".join(f"{state} after {delay:g} s" if delay else f"{state} at once" for delay, state in rule.stages)


def put_into(text: str) -> str:
    """A page with a new table between `BEGIN` and `END`."""
    return f"{text[: text.index(BEGIN) + len(BEGIN)]}\n{policy_table()}{text[text.index(END) :]}"


if __name__ == "__main__":
    page = Path(sys.argv[1])
    page.write_text(put_into(page.read_text(encoding="utf-8")), encoding="utf-8")
