"""docs/safety.md has the policy that flies."""

import dataclasses
from pathlib import Path

from ibvs_qp.config import SafetySettings
from ibvs_qp.supervision.faults import POLICY, Fault
from sim.report.assurance_page import policy_table, put_into

PAGE = Path(__file__).parents[3] / "docs" / "safety.md"


def test_the_page_has_the_table_of_the_policy():
    text = PAGE.read_text(encoding="utf-8")
    assert put_into(text) == text, "python -m sim.report.assurance_page docs/safety.md"
    assert all(f"\n| {fault} | " in policy_table() for fault in Fault)


def test_every_fault_has_a_rule_and_every_bound_is_a_setting():
    assert set(POLICY) == set(Fault)
    names = {field.name for field in dataclasses.fields(SafetySettings)}
    assert {name for rule in POLICY.values() for name in rule.bounds} <= names
