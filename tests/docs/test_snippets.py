"""Every snippet of the documentation runs: Python page by page, commands through the parser, TOML as its kind."""

from __future__ import annotations

import importlib.util
import re
import shlex
import tomllib
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import pytest

from ibvs_qp.config.settings import from_dict
from ibvs_qp.config.vehicle import VehicleParams
from ibvs_qp.interfaces.px4.config import BridgeConfig
from ibvs_qp.interfaces.ros.topics import Topics
from ibvs_qp.pilot import PilotConfig
from sim.commands import cli
from sim.experiments.spec import Experiment
from sim.faults.scenario import scenario
from sim.sweep.spec import parse_spec
from sim.world.errors import WorldErrors
from sim.world.scene import Scene

ROOT = Path(__file__).parents[2]
DOCS = ROOT / "docs"
#: Pages of the experiments are generated and hold no snippet.
GENERATED = ("_build", "experiments")
PAGES = [page for page in sorted(DOCS.rglob("*.md")) if page.relative_to(DOCS).parts[0] not in GENERATED]
PAGES.append(ROOT / "README.md")
_FENCE = re.compile(r"(?:^<!-- (?P<mark>[^\n]+) -->\n)?^```(?P<kind>\w+)\n(?P<text>.*?)^```", re.MULTILINE | re.DOTALL)
_COMMAND = re.compile(r"(?:^|[\s/])ibvs-qp (.*)")
_MODULE = re.compile(r"python[\d.]* -m ([\w.]+)")
_SCRIPT = re.compile(r"python[\d.]* ([\w/]+\.py)")
#: Commands that fly nothing and write nothing run, too.
QUICK = ("--plan", "octorotor_qp")
KINDS: dict[str, Callable[[dict[str, Any]], object]] = {
    "vehicle": lambda table: from_dict(VehicleParams, table["vehicle"]),
    "pilot": lambda table: from_dict(PilotConfig, table),
    "scene": lambda table: from_dict(Scene, table),
    "world": lambda table: from_dict(WorldErrors, table),
    "sweep": lambda table: parse_spec(table, ROOT),
    "experiment": lambda table: from_dict(Experiment, table),
    "bridge": lambda table: from_dict(BridgeConfig, table),
    "topics": lambda table: from_dict(Topics, table),
    "fault rows": lambda table: [scenario(row) for row in table["row"]],
}


@dataclass(frozen=True)
class Snippet:
    """A fenced block: the comment above it, its language and its text."""

    page: Path
    mark: str
    kind: str
    text: str


def snippets(page: Path, kind: str) -> list[Snippet]:
    """Blocks of a language on a page, without those that state why they cannot run."""
    found = [
        Snippet(page, match["mark"] or "", match["kind"], match["text"])
        for match in _FENCE.finditer(page.read_text(encoding="utf-8"))
    ]
    runnable = []
    for snippet in found:
        if snippet.mark.startswith("not run:"):
            assert len(snippet.mark.split()) > 3, f"{page.name}: a reason is needed"
        elif snippet.kind == kind:
            runnable.append(snippet)
    return runnable


def commands(text: str) -> Iterator[list[str]]:
    """Arguments of every call of ibvs-qp in a shell snippet."""
    for line in text.replace("\\\n", " ").splitlines():
        for part in line.split("&&"):
            if found := _COMMAND.search(part.split(" #")[0]):
                yield shlex.split(found[1])


def with_(kind: str) -> list[Path]:
    """Pages that have snippets of a language."""
    return [page for page in PAGES if snippets(page, kind)]


def name(page: Path) -> str:
    """Of a page in the list of tests."""
    return page.relative_to(ROOT).as_posix()


@pytest.mark.parametrize("page", with_("python"), ids=name)
def test_python_runs_in_one_namespace(page: Path, monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    monkeypatch.chdir(tmp_path)
    names: dict[str, Any] = {"__name__": "snippet"}
    for number, snippet in enumerate(snippets(page, "python")):
        exec(compile(snippet.text, f"{page.name}, block {number}", "exec"), names)


@pytest.mark.slow
@pytest.mark.parametrize("page", with_("sh"), ids=name)
def test_commands_are_those_of_the_command_line(page: Path, capsys: pytest.CaptureFixture[str]) -> None:
    for snippet in snippets(page, "sh"):
        for words in commands(snippet.text):
            try:
                cli._parse(words)
            except SystemExit as stop:
                assert not stop.code, f"{words}: {capsys.readouterr().err}"
            if any(word in words for word in QUICK) and "all" not in words:
                assert cli.main(words) == 0, words
        for module in _MODULE.findall(snippet.text):
            assert importlib.util.find_spec(module), f"{page.name}: no module {module}"
        for script in _SCRIPT.findall(snippet.text):
            assert (ROOT / script).is_file(), f"{page.name}: no file {script}"


@pytest.mark.parametrize("page", with_("toml"), ids=name)
def test_toml_is_accepted(page: Path) -> None:
    for snippet in snippets(page, "toml"):
        kind = snippet.mark.removeprefix("toml: ")
        assert kind in KINDS, f"{page.name}: say above a TOML snippet what it is, for example <!-- toml: scene -->"
        KINDS[kind](tomllib.loads(snippet.text))


def test_snippets_are_found_and_wrong_ones_are_seen(tmp_path: Path) -> None:
    assert len(with_("python")) >= 6 and len(with_("sh")) >= 8 and len(with_("toml")) >= 5
    page = tmp_path / "page.md"
    page.write_text(
        "<!-- not run: needs a robot -->\n```python\nboom\n```\n```sh\nx/ibvs-qp paint --no-such  # y\n```\n"
    )
    assert snippets(page, "python") == []
    assert list(commands(snippets(page, "sh")[0].text)) == [["paint", "--no-such"]]
    with pytest.raises(SystemExit, match="2"):
        cli._parse(["paint", "--no-such"])
