"""The scene files that come with the package."""

from pathlib import Path

#: Their files by name.
FILES = {file.stem: file for file in sorted(Path(__file__).parent.glob("*.toml"))}
