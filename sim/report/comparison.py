"""Compare two runs: pair their flights and list the differences of their figures."""

from __future__ import annotations

import contextlib
import sys
from pathlib import Path
from typing import Any

import numpy as np
import polars as pl

from ibvs_qp.config.errors import ConfigError, shown
from ibvs_qp.config.files import INTEGERS, UnreadableFile, parse_toml, read_toml
from ibvs_qp.pilot import PilotConfig
from sim.storage.arrays import read_json
from sim.sweep.parts import HEAD, PARAM, frame, read_tables
from sim.sweep.statistics import difference, figure_names, median_interval

#: Facts of a run that change its figures, and their types; an older run may lack one.
FACTS = {
    "version": str,
    "seed": int,
    "world": str,
    "features": str,
    "vision": str,
    "camera": str,
    "image_size": list,
}
#: Keys of every law in addition to its figures.
_OUTCOME = {"completed": bool, "reason": str}


def read_facts(file: Path) -> dict[str, Any]:
    """Facts of a run, None for an absent one, and its laws if it has them.

    Args:
        file: The summary.json.

    Returns:
        The values of `FACTS`, and `laws` as in the file.

    Raises:
        UnreadableFile: When it cannot be read, or a fact has another type.
    """
    content = _typed(file, "the file", read_json(file), dict)
    facts = {name: _typed(file, name, content[name], kind) for name, kind in FACTS.items() if name in content}
    for entry in facts.get("image_size", ()):
        _typed(file, "image_size", entry, int)
    return {name: facts.get(name) for name in FACTS} | {"laws": content.get("laws")}


def read_laws(file: Path) -> tuple[dict[str, Any], dict[str, dict[str, Any]]]:
    """Facts of a run and, per law, its outcome and its figures [float].

    Raises:
        UnreadableFile: When it is not the summary of a run.
    """
    facts, laws = read_facts(file), {}
    for name in ("version", "seed"):
        _typed(file, name, facts[name], FACTS[name])
    for law, metrics in _typed(file, "laws", facts["laws"], dict).items():
        _typed(file, "a law's name", law, str)
        _typed(file, law, metrics, dict)
        own = {name: value for name, value in metrics.items() if name.isidentifier() and name not in HEAD}
        figures = {name: float(value) for name, value in own.items() if _is_figure(value)}
        outcome = {name: _typed(file, f"{law}.{name}", metrics.get(name), kind) for name, kind in _OUTCOME.items()}
        laws[law] = figures | outcome
    if not laws:
        raise UnreadableFile(file, "not the summary of a run: it has no law")
    return facts, laws


def _typed(file: Path, name: str, value: Any, kind: type) -> Any:
    """The value if it has exactly the type; text must print, and an integer fit a table."""
    fits = type(value) is kind and (kind is not int or value in INTEGERS) and (kind is not str or _prints(value))
    if not fits:
        raise UnreadableFile(
            file, f"not the summary of a run: {shown(name)} = {shown(value)}, expected {kind.__name__}"
        )
    return value


def _prints(text: str) -> bool:
    return text.replace("\n", " ").isprintable()


def _is_figure(value: Any) -> bool:
    return type(value) is float or (type(value) is int and abs(value) <= sys.float_info.max)


#: A key that one side lacks.
ABSENT = "–"


def run_world(folder: Path) -> str | None:
    """World of a run of `paint` or of an experiment, as its record names it; None where it names none."""
    files = [file] if (file := folder / "summary.json").is_file() else sorted(folder.glob("*.json"))
    for file in files:
        with contextlib.suppress(UnreadableFile):
            content = read_json(file)
            if isinstance(content, dict) and isinstance(content.get("world"), str):
                return content["world"]
    return None


def differing_runs(a: Path, b: Path) -> list[dict[str, Any]]:
    """Differing facts, scene and presets of two `paint` runs; runs of experiments name theirs in their tables.

    Args:
        a: Run folder.
        b: The other one.

    Returns:
        Per difference: name, and its value in a and b.

    Raises:
        ConfigError: When a file is none of a run.
    """
    if not all((path / "summary.json").is_file() for path in (a, b)):
        return []
    first, second = (read_facts(path / "summary.json") for path in (a, b))
    pairs: list[tuple[str, dict[str, Any], dict[str, Any]]] = [
        ("", {name: first[name] for name in FACTS}, {name: second[name] for name in FACTS})
    ]
    names = ["scene.toml", *sorted(file.name for file in a.glob("preset_*.toml"))]
    for name in names:
        if (a / name).is_file() and (b / name).is_file():
            pairs.append((f"{Path(name).stem}.", read_toml(a / name), read_toml(b / name)))
    found = [each for prefix, x, y in pairs for each in _differences(prefix, x, y)]
    if any(each["name"] == "world" for each in found):  # which is shorter than its numbers
        found = [each for each in found if not each["name"].startswith("scene.errors.")]
    return found


def differing_presets(a: Path, b: Path) -> list[dict[str, Any]]:
    """Differing keys of two presets, defaults filled in."""
    first, second = (parse_toml(PilotConfig.from_toml(file).to_toml(derived=True), file) for file in (a, b))
    return _differences("preset.", first, second)


def _differences(prefix: str, a: dict[str, Any], b: dict[str, Any]) -> list[dict[str, Any]]:
    x, y = _flat(prefix, a), _flat(prefix, b)
    names = [*x, *(name for name in y if name not in x)]
    pairs = ((name, x.get(name, ABSENT), y.get(name, ABSENT)) for name in names)
    return [{"name": name, "a": first, "b": second} for name, first, second in pairs if first != second]


def _flat(prefix: str, table: dict[str, Any]) -> dict[str, Any]:
    flat: dict[str, Any] = {}
    for name, value in table.items():
        flat |= _flat(f"{prefix}{name}.", value) if isinstance(value, dict) else {prefix + name: value}
    return flat


#: Columns that identify a flight, besides the parameters.
_SAME = ("experiment", "law", "variant", "seed")
#: Variant of the flights of a `paint` run, which has no others.
PAINT_VARIANT = "run"


def read_run(path: Path) -> pl.DataFrame:
    """Rows of a run folder: of an experiment's tables, or one per law of a `paint` run.

    Raises:
        ConfigError: If it is neither.
    """
    if (path / "summary.json").is_file():
        return _paint_rows(path)
    names = [file.stem for file in sorted(path.glob("*.parquet"))]
    names = [name for name in names if name != "all"] or names
    if not names:
        advice = "give the folder of `ibvs-qp paint` or `ibvs-qp experiment`, or a preset (TOML)"
        raise ConfigError(f"{path} is no run: it has neither summary.json nor a table; {advice}")
    return read_tables((path / f"{name}.parquet" for name in names), (*_SAME, "completed"), foreign=True)


def _paint_rows(path: Path) -> pl.DataFrame:
    facts, laws = read_laws(path / "summary.json")
    same = {"experiment": "paint", "variant": PAINT_VARIANT, "seed": facts["seed"], "version": facts["version"]}
    return frame([metrics | same | {"law": law} for law, metrics in laws.items()])


def compare(a: pl.DataFrame, b: pl.DataFrame) -> list[dict[str, Any]]:
    """Pair the flights of two runs by experiment, law, variant, parameters and seed, and compare each cell.

    Two `paint` runs pair law by law, for any seeds.

    Returns:
        Per cell: experiment, law, variant, params, n, completed of both, and by figure the differences.

    Raises:
        ConfigError: If they share no flight.
    """
    if set(a["variant"]) == {PAINT_VARIANT} == set(b["variant"]):
        b = b.with_columns(pl.lit(a["seed"][0]).alias("seed"))
    params = [name for name in a.columns if name.startswith(PARAM) and name in b.columns]
    try:
        both = a.join(b, on=[*_SAME, *params], suffix=".b", nulls_equal=True, maintain_order="left")
    except pl.exceptions.PolarsError as error:  # a parameter of another type, a figure with the suffix
        raise ConfigError(f"the two runs do not fit together: {str(error).splitlines()[0]}") from None
    if not both.height:
        raise ConfigError("the two runs share no flight (same experiment, law, variant, parameters and seed)")
    shared = [name for name in figure_names(a) if name in b.columns]
    cells = []
    for key, rows in both.group_by(["experiment", "law", "variant", *params], maintain_order=True):
        values = dict(zip(["experiment", "law", "variant", *params], key, strict=True))
        cells.append(
            {
                **{name: values[name] for name in ("experiment", "law", "variant")},
                "params": {name.removeprefix(PARAM): values[name] for name in params if values[name] is not None},
                "n": rows.height,
                "completed": [int(rows["completed"].sum()), int(rows["completed.b"].sum())],
                "differences": {name: found for name in shared if (found := _difference(rows, name)) is not None},
            }
        )
    return cells


def _difference(rows: pl.DataFrame, name: str) -> dict[str, float] | None:
    """Medians of run A and B, and of B - A flight by flight with both intervals; number of pairs of flights."""
    first, second = (rows[column].cast(pl.Float64).to_numpy() for column in (name, f"{name}.b"))
    if not np.isfinite(second - first).any():
        return None
    medians = {"a": median_interval(first)["median"], "b": median_interval(second)["median"]}
    return medians | difference(second - first) | {"pairs": int(np.isfinite(second - first).sum())}
