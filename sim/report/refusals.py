"""Texts of all refusals in docs/faq.md, from the source code.

``python -m sim.report.refusals docs/faq.md`` renews them; a test compares the page with the code. A block of the page
names the modules whose texts it holds, so that a refusal of a module that no block names is found as well.
"""

from __future__ import annotations

import ast
import re
import sys
from collections.abc import Iterator
from pathlib import Path

ROOT = Path(__file__).parents[2]
#: A block of the page: modules or folders, then their texts.
_BLOCK = re.compile(r"<!-- (?P<places>[\w/. ]+): generated -->\n.*?<!-- end of texts -->", re.DOTALL)
#: Folders and modules that step in flight or give the reason of its end: every sentence in them is a message.
_IN_FLIGHT = (
    "ibvs_qp/interfaces/px4/bridge.py ibvs_qp/interfaces/px4/gate.py ibvs_qp/checked_law.py ibvs_qp/controller.py "
    "ibvs_qp/estimation ibvs_qp/symbolic/machine_code.py ibvs_qp/model/reporting.py ibvs_qp/qp/compiled.py "
    "ibvs_qp/pilot/painting ibvs_qp/pilot ibvs_qp/qp/infeasible.py ibvs_qp/supervision "
    "ibvs_qp/validation ibvs_qp/vision"
).split()
#: Elsewhere messages are the texts of errors: raised, or prepared in a variable of such a name.
_PREPARED = re.compile(r"advice|allowed|checks|instead|kind|message|most|need|problem|reason|remedy|words|REMEDY|KINDS")
#: Notebooks, experiments and renderings of the project itself refuse nothing that a user gives.
_INTERNAL = ("sim/notebook", "sim/report/refusals.py", "sim/rivals/solver.py")
#: Calls whose texts document settings.
_DOCUMENTS = {"setting", "choice", "_weight", "_poles", "_slack_weight", "_vector", "split", "kernel"}
#: Placeholders of a logger, and marks of a console.
_FILLED_IN, _MARKUP = re.compile(r"%[rs]"), re.compile(r"\[(bold|/)\]")
#: Errors that only a fault of the project's own code raises.
_OWN_FAULTS = {"AttributeError", "KeyError", "MemoryError", "RuntimeError", "LookupError", "TypeError"}


def texts_of(source: str, in_flight: bool) -> list[str]:
    """Sentences of a module that a user may read, without repetition; an ellipsis stands for a value.

    Args:
        source: Text of the module.
        in_flight: Whether all sentences count, or only those of errors.
    """
    tree = ast.parse(source)
    places = [tree] if in_flight else [node for node in ast.walk(tree) if _is_refusal(node)]
    return list(dict.fromkeys(text for place in places for text in _sentences(place)))


def _is_refusal(node: ast.AST) -> bool:
    if isinstance(node, ast.Raise):
        return _called(node.exc) not in _OWN_FAULTS
    if isinstance(node, ast.Call):
        return _called(node) in ("out_of_range", "_user_error")
    targets = getattr(node, "targets", [getattr(node, "target", None)]) if isinstance(node, ast.Assign) else []
    names = [name.id for target in targets for name in ast.walk(target) if isinstance(name, ast.Name)]
    return any(_PREPARED.search(name) for name in names)


def _called(node: ast.AST | None) -> str:
    function = node.func if isinstance(node, ast.Call) else None
    return str(getattr(function, "attr", getattr(function, "id", "")))


def _sentences(node: ast.AST) -> Iterator[str]:
    if isinstance(node, ast.Expr) and isinstance(node.value, ast.Constant):
        return  # a docstring
    if _called(node) in _DOCUMENTS:
        return
    if (text := _text(node)) is not None:
        if " " in text.strip() and re.search(r"[a-z]{2}", text):
            yield _FILLED_IN.sub("…", " ".join(_MARKUP.sub("", text).split()))
        return
    for child in ast.iter_child_nodes(node):
        yield from _sentences(child)


def _text(node: ast.AST) -> str | None:
    if isinstance(node, ast.Constant):
        return node.value if isinstance(node.value, str) else None
    if isinstance(node, ast.JoinedStr):
        return "".join(str(part.value) if isinstance(part, ast.Constant) else "…" for part in node.values)
    return None


def refusals() -> dict[str, list[str]]:
    """Texts by module, as a path from the root."""
    found: dict[str, list[str]] = {}
    for package in ("allocation", "ibvs_qp", "sim"):
        for file in sorted((ROOT / package).rglob("*.py")):
            place = file.relative_to(ROOT).as_posix()
            if not place.startswith(_INTERNAL):
                found[place] = texts_of(file.read_text(encoding="utf-8"), place.startswith(tuple(_IN_FLIGHT)))
    return {place: texts for place, texts in found.items() if texts}


def put_into(page: str) -> str:
    """A page with the texts in its blocks.

    Raises:
        ValueError: Naming the modules with texts that no block holds.
    """
    left = refusals()

    def filled(block: re.Match[str]) -> str:
        places = tuple(block["places"].split())
        held = [place for place in left if place.startswith(places)]
        lines = dict.fromkeys(text for place in held for text in left.pop(place))
        return f"<!-- {block['places']}: generated -->\n```text\n" + "\n".join(lines) + "\n```\n<!-- end of texts -->"

    page = _BLOCK.sub(filled, page)
    if left:
        raise ValueError(f"no block of the page holds the texts of {', '.join(left)}")
    return page


if __name__ == "__main__":
    faq = Path(sys.argv[1])
    faq.write_text(put_into(faq.read_text(encoding="utf-8")), encoding="utf-8")
