"""Docstrings, comments, messages, names and documentation avoid the words of language.toml; it has the replacements."""

from __future__ import annotations

import io
import re
import token
import tokenize
import tomllib
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import NamedTuple

import pytest

ROOT = Path(__file__).parents[2]
LIST = tomllib.loads(Path(__file__).with_name("language.toml").read_text(encoding="utf-8"))
_NAME = r"(?P<name>[A-Za-z_]\w*)"
_C = re.compile(r'/\*.*?\*/|//[^\n]*|"(?:\\.|[^"\\\n])*"|' + _NAME, re.DOTALL)
_TOML = re.compile(r'#[^\n]*|""".*?"""|"(?:\\.|[^"\\\n])*"|' + _NAME, re.DOTALL)
#: Comments and strings, or names, of the languages that no module of Python reads word by word.
_PATTERNS = {".c": _C, ".h": _C, ".toml": _TOML}
_SUFFIXES = {".py", ".pyi", ".md", *_PATTERNS}
_PARTS_OF_NAMES = re.compile(r"[A-Z]?[a-z]+|[A-Z]+(?![a-z])|\d+")
_TEXTS = {token.COMMENT, token.STRING, getattr(token, "FSTRING_MIDDLE", token.STRING)}


@dataclass(frozen=True)
class Rule:
    """A pattern to avoid, its replacement, and the rooms in which it holds."""

    pattern: re.Pattern[str]
    instead: str
    rooms: tuple[str, ...]
    names: bool


class Piece(NamedTuple):
    """A line of prose, or the words of a name."""

    line: int
    text: str
    is_name: bool = False


RULES = [
    Rule(
        re.compile(rule["pattern"], re.IGNORECASE),
        rule["instead"],
        tuple(rule.get("rooms", LIST["rooms"])),
        rule.get("names", True),
    )
    for rule in LIST["rule"]
]


def files(room: str) -> list[Path]:
    """Modules, C files, settings and pages of a room, without recordings and files of other projects."""
    start = ROOT / room
    found = [start] if start.is_file() else sorted(start.rglob("*"))
    texts = [path for path in found if path.suffix in _SUFFIXES and "_build" not in path.parts]
    return [path for path in texts if not path.relative_to(ROOT).as_posix().startswith(tuple(LIST["skipped"]))]


def pieces(path: Path) -> Iterator[Piece]:
    """Lines of a page; comments, strings and names of a program or of settings, each name once, and its own name."""
    text = path.read_text(encoding="utf-8")
    if path.suffix == ".md":
        yield from _lines(1, text)
        return
    yield Piece(1, words(path.stem), is_name=True)
    names = set[str]()
    if pattern := _PATTERNS.get(path.suffix):
        for piece in pattern.finditer(text):
            line = text.count("\n", 0, piece.start()) + 1
            if piece["name"] is None:
                yield from _lines(line, piece[0])
            elif piece[0] not in names:
                names.add(piece[0])
                yield Piece(line, words(piece[0]), is_name=True)
        return
    for found in tokenize.generate_tokens(io.StringIO(text).readline):
        if found.type in _TEXTS:
            yield from _lines(found.start[0], found.string)
        elif found.type == token.NAME and found.string not in names:
            names.add(found.string)
            yield Piece(found.start[0], words(found.string), is_name=True)


def _lines(first: int, text: str) -> Iterator[Piece]:
    return (Piece(number, line) for number, line in enumerate(text.splitlines(), first))


def words(name: str) -> str:
    """A name as words: `_is_news` is "is news", `ClockLeap` "clock leap"."""
    return " ".join(_PARTS_OF_NAMES.findall(name)).lower()


def hits(path: Path, room: str) -> list[str]:
    """Places of a file that use a word of the list, with the replacement."""
    rules = [rule for rule in RULES if room in rule.rooms]
    suspect = re.compile("|".join(rule.pattern.pattern for rule in rules), re.IGNORECASE)
    found = dict.fromkeys(
        f"{path.relative_to(ROOT).as_posix()}:{piece.line}: {match[0]!r}, write: {rule.instead}"
        for piece in pieces(path)
        if suspect.search(piece.text)
        for rule in rules
        if (rule.names or not piece.is_name) and (match := rule.pattern.search(without_kept(path, piece.text)))
    )
    return list(found)


def without_kept(path: Path, text: str) -> str:
    """The text without the phrases that the list keeps in this file."""
    for kept in LIST["keep"]:
        if path == ROOT / kept["file"]:
            text = text.replace(kept["text"], "")
    return text


@pytest.mark.parametrize("room", LIST["rooms"])
def test_words_of_a_room(room: str) -> None:
    found = [hit for path in files(room) for hit in hits(path, room)]
    assert not found, f"{len(found)} places\n" + "\n".join(found)


def test_every_rule_has_an_example() -> None:
    for rule in RULES:
        assert any(rule.pattern.search(example) for example in LIST["examples"]), rule.pattern.pattern


def test_every_kept_phrase_is_in_its_file() -> None:
    for kept in LIST["keep"]:
        assert kept["text"] in (ROOT / kept["file"]).read_text(encoding="utf-8") and kept["reason"], kept


def test_names_are_read_as_words() -> None:
    assert words("_is_news") == "is news" and words("ClockLeap") == "clock leap"


def test_c_and_settings_are_read(tmp_path: Path) -> None:
    program, settings = tmp_path / "loop.c", tmp_path / "scene.toml"
    program.write_text('/* one\n * two */ int is_new = 3; // three\nputs("four");\n')
    settings.write_text('# one\ntold = true\nabout = """\\\n  two\n"""\nkind = "three" # four\n')
    prose = [[(piece.line, piece.text) for piece in pieces(path) if not piece.is_name] for path in (program, settings)]
    assert prose[0] == [(1, "/* one"), (2, " * two */"), (2, "// three"), (3, '"four"')]
    assert prose[1] == [(1, "# one"), (3, '"""\\'), (4, "  two"), (5, '"""'), (6, '"three"'), (6, "# four")]
    names = [[piece.text for piece in pieces(path) if piece.is_name] for path in (program, settings)]
    assert names == [["loop", "int", "is new", "puts"], ["scene", "told", "true", "about", "kind"]]
