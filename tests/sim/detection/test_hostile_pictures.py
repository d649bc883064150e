"""Manifests and pictures of unknown origin: `detect` ends with detections, a refused frame, or one line."""

from __future__ import annotations

import csv
import io
import json
import subprocess
import sys
import zlib
from collections.abc import Callable
from pathlib import Path

import cv2
import numpy as np
import pytest
from hostile_files import BYTES, NPY, npz, special_files
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from sim.commands.cli import main
from sim.detection import manifest, pictures
from sim.detection.manifest import COLUMNS
from sim.detection.pictures import PictureError, read_color, read_depth
from tests.support.truth import FAMILIES, render_frame, sample_scene

pytestmark = pytest.mark.timeout(120)
EXTREMES = "nan inf -inf 1e308 -1e308 1e160 1e5 -1e10 1.0001 1e-320 0 -0 1_000 ٣ 1e400 0x10 9" + "9" * 400
#: One pixel in four of a rendered picture: small, and its surface is found.
TRUTH, STEP = render_frame(sample_scene(FAMILIES["near wall"], 1)), 4
UNITS = 5000.0
_NUMBERS = (*(value / STEP for value in TRUTH.frame.intrinsics), UNITS, *(value / STEP for value in TRUTH.seed))
ROW = dict(zip(COLUMNS, ("color.png", "depth.png", *map(str, _NUMBERS)), strict=True))


def png(width: int, height: int, rows: bytes) -> bytes:
    """A grey PNG with such a header, whatever the data."""

    def chunk(kind: bytes, data: bytes) -> bytes:
        return len(data).to_bytes(4, "big") + kind + data + zlib.crc32(kind + data).to_bytes(4, "big")

    size = width.to_bytes(4, "big") + height.to_bytes(4, "big")
    body = chunk(b"IHDR", size + bytes((8, 0, 0, 0, 0))) + chunk(b"IDAT", zlib.compress(rows)) + chunk(b"IEND", b"")
    return b"\x89PNG\r\n\x1a\n" + body


def pictures_in(folder: Path) -> None:
    frame = TRUTH.frame
    cv2.imwrite(str(folder / "color.png"), cv2.cvtColor(frame.rgb[::STEP, ::STEP], cv2.COLOR_RGB2BGR))
    cv2.imwrite(str(folder / "depth.png"), np.rint(frame.depth[::STEP, ::STEP] * UNITS).astype(np.uint16))


def table(rows: list[dict[str, str]]) -> bytes:
    stream = io.StringIO(newline="")
    writer = csv.DictWriter(stream, COLUMNS)
    writer.writeheader()
    writer.writerows(rows)
    return stream.getvalue().encode("utf-8", "surrogatepass")


def detect(folder: Path, capfd: pytest.CaptureFixture[str], code: tuple[int, ...] = (0, 2)) -> dict | str:
    """The JSON, or the one line; nothing else is printed."""
    found = main(["detect", "--sequence", str(folder), "--json", "--all"])
    out, err = capfd.readouterr()
    assert found in code, err
    if found == 2:
        assert out == "" and err.startswith("ibvs-qp: error: ") and err.count("\n") == 1 and len(err) < 2000
        return err
    assert err == ""
    return json.loads(out)


@pytest.mark.parametrize(
    "content",
    [
        b"",
        *BYTES.values(),
        b"color\n",
        ",".join(COLUMNS).encode(),
        ",".join(COLUMNS).encode() + b"\n" + b"\0" * 100,
        (",".join(COLUMNS) + "\n" + '"' * 200_001).encode(),
        (",".join(COLUMNS) + "\n" + "x" * 200_000).encode(),
        ",".join(COLUMNS).encode() + b"\ncolor.png,depth.png,1,2,3\n",
        ",".join(COLUMNS).encode() + b"\n\xff\xfe,depth.png,60,60,32,24,1000,32,24\n",
    ],
)
def test_manifests_that_are_none(tmp_path: Path, capfd: pytest.CaptureFixture[str], content: bytes) -> None:
    pictures_in(tmp_path)
    (tmp_path / "manifest.csv").write_bytes(content)
    assert "manifest.csv" in str(detect(tmp_path, capfd, (2,)))


def test_a_manifest_of_too_many_frames(
    tmp_path: Path, capfd: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    (tmp_path / "manifest.csv").write_bytes(table([ROW] * 5))
    monkeypatch.setattr(manifest, "MOST_FRAMES", 5)
    assert "5 frames" in str(detect(tmp_path, capfd, (2,)))
    monkeypatch.setattr(manifest, "LARGEST_MANIFEST", 100)
    assert "at most 100" in str(detect(tmp_path, capfd, (2,)))


@pytest.mark.parametrize("special", ["manifest", "color", "depth"])
@pytest.mark.parametrize("kind", ["device", "terminal", "pipe", "socket", "folder", "loop", "missing", "huge"])
def test_special_files(tmp_path: Path, capfd: pytest.CaptureFixture[str], special: str, kind: str) -> None:
    pictures_in(tmp_path)
    file = special_files(tmp_path, ".png")[kind]
    if special == "manifest":
        if kind != "missing":
            file.rename(tmp_path / "manifest.csv")
        assert "manifest.csv" in str(detect(tmp_path, capfd, (2,)))
        return
    (tmp_path / "manifest.csv").write_bytes(table([ROW | {special: file.name}]))
    [frame] = detect(tmp_path, capfd, (0,))["frames"]  # type: ignore[index]
    assert kind in frame["refused"] and frame["plane"] is None


@pytest.mark.parametrize("column", COLUMNS)
@pytest.mark.parametrize("value", [*EXTREMES.split(), "", "a\0b", "../color.png", "x" * 5000])
def test_extreme_values(tmp_path: Path, capfd: pytest.CaptureFixture[str], column: str, value: str) -> None:
    pictures_in(tmp_path)
    (tmp_path / "manifest.csv").write_bytes(table([ROW | {column: value}]))
    detect(tmp_path, capfd)


@settings(max_examples=40, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(
    st.lists(
        st.fixed_dictionaries(
            {name: st.sampled_from([ROW[name], ROW[name], *EXTREMES.split()]) | st.text(max_size=6) for name in COLUMNS}
        ),
        max_size=3,
    )
)
def test_any_manifest(tmp_path: Path, capfd: pytest.CaptureFixture[str], rows: list[dict[str, str]]) -> None:
    pictures_in(tmp_path)
    (tmp_path / "manifest.csv").write_bytes(table(rows))
    detect(tmp_path, capfd)


#: Pictures that lie, by name and suffix.
PICTURES = {
    "cut.png": png(64, 48, bytes(65 * 48))[:-30],
    "short.png": png(64, 48, bytes(65)),
    "large.png": png(20_000, 20_000, bytes(20_000)),
    "gigantic.png": png(2**31 - 1, 2**31 - 1, b""),
    "flat.png": png(64, 0, b""),
    "cut.jpg": cv2.imencode(".jpg", np.zeros((48, 64, 3), np.uint8))[1].tobytes()[:300],
    "text.jpg": b"no picture",
    "empty.tiff": b"",
    "cut.tiff": cv2.imencode(".tiff", np.zeros((48, 64), np.float32))[1].tobytes()[:100],
    "two.npz": npz({"a.npy": b"", "b.npy": b""}),
    "flat.npz": npz({"a.npy": b""}),
    **{f"{name}.npy".replace(" ", "_"): content for name, content in NPY.items()},
    **{f"{name}.png": content for name, content in BYTES.items()},
}


@pytest.mark.parametrize("name", PICTURES)
@pytest.mark.parametrize("read", [read_color, lambda file: read_depth(file, 1000.0)])
def test_pictures_that_are_none(
    tmp_path: Path, capfd: pytest.CaptureFixture[str], name: str, read: Callable[[Path], np.ndarray]
) -> None:
    (tmp_path / name).write_bytes(PICTURES[name])
    try:
        read(tmp_path / name)
        assert name.startswith(("cut", "short"))  # a decoder may show what is there
    except PictureError as error:
        assert name in str(error)
    assert capfd.readouterr().err == ""


@pytest.mark.parametrize("shape", [(), (4,), (0, 4), (4, 4, 0), (2, 2, 2, 2), (9000, 2)])
@pytest.mark.parametrize("kind", [np.uint8, np.bool_, np.str_, np.float64])
def test_arrays_that_are_no_pictures(tmp_path: Path, shape: tuple[int, ...], kind: type) -> None:
    np.save(tmp_path / "x.npy", np.zeros(shape, kind))
    for read in (read_color, lambda file: read_depth(file, 1.0)):
        with pytest.raises(PictureError):
            read(tmp_path / "x.npy")


@settings(max_examples=100, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(st.sampled_from([".png", ".jpg", ".tiff", ".bmp"]), st.lists(st.tuples(st.integers(0), st.integers(0, 255))))
def test_any_damaged_picture(tmp_path: Path, suffix: str, damage: list[tuple[int, int]]) -> None:
    content = bytearray(cv2.imencode(suffix, np.arange(48 * 64, dtype=np.uint8).reshape(48, 64))[1].tobytes())
    for place, value in damage:
        content[place % len(content)] = value
    (tmp_path / f"x{suffix}").write_bytes(content)
    for read in (read_color, lambda file: read_depth(file, 1000.0)):
        try:
            assert read(tmp_path / f"x{suffix}").ndim in (2, 3)
        except PictureError as error:
            assert "\n" not in str(error)


def test_a_small_file_of_many_pixels_is_not_decoded(tmp_path: Path) -> None:
    """Decoded, its size would be named."""
    (tmp_path / "x.png").write_bytes(png(9000, 9000, bytes(9000 * 9001)))
    program = "import sys; from sim.commands.cli import main; sys.exit(main(sys.argv[1:]))"
    words = "detect --rgb x.png --fx 60 --fy 60 --cx 30 --cy 30".split()
    done = subprocess.run([sys.executable, "-c", program, *words], capture_output=True, text=True, cwd=tmp_path)
    assert done.returncode == 2 and done.stderr.count("\n") == 1 and "it is no picture" in done.stderr


def test_every_picture_reader_has_the_limit_of_the_size(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(pictures, "LARGEST_PICTURE", 10)
    for name in ("x.png", "x.npy", "x.npz"):
        (tmp_path / name).write_bytes(bytes(11))
        with pytest.raises(PictureError, match="at most 10"):
            read_color(tmp_path / name)


def test_a_manifest_as_it_should_be(tmp_path: Path, capfd: pytest.CaptureFixture[str]) -> None:
    pictures_in(tmp_path)
    (tmp_path / "manifest.csv").write_bytes(table([ROW]))
    [frame] = detect(tmp_path, capfd, (0,))["frames"]  # type: ignore[index]
    assert frame["refused"] is None and len(frame["candidates"]) > 20


@pytest.mark.parametrize("value", ["nan", "inf", "1e300", "-1e300", "1e7"])
@pytest.mark.parametrize("name", ["fx", "fy", "cx", "cy", "distortion"])
def test_extreme_options_of_one_frame(tmp_path: Path, capfd: pytest.CaptureFixture[str], name: str, value: str) -> None:
    pictures_in(tmp_path)
    camera = {key: [ROW[key]] for key in ("fx", "fy", "cx", "cy")} | {"distortion": ["0"] * 5}
    camera[name] = [value] * len(camera[name])
    words = [word for key, values in camera.items() for word in (f"--{key}", *values)]
    files = ["--rgb", str(tmp_path / "color.png"), "--depth", str(tmp_path / "depth.png")]
    seed = ["--seed-pixel", ROW["seed_u"], ROW["seed_v"], "--depth-units-per-metre", str(UNITS)]
    assert main(["detect", *files, *words, *seed, "--json"]) == 2
    assert capfd.readouterr().err.count("\n") == 1


def test_a_frame_number_of_too_many_digits(tmp_path: Path, capfd: pytest.CaptureFixture[str]) -> None:
    (tmp_path / "manifest.csv").write_bytes(table([ROW | {"color": f"a_{'1' * 5000}_color.png"}]))
    err = str(detect(tmp_path, capfd, (2,)))
    assert "manifest.csv, line 2: color = " in err and "20 digits" in err


def test_names_have_no_effect_on_the_terminal(tmp_path: Path, capfd: pytest.CaptureFixture[str]) -> None:
    (tmp_path / "manifest.csv").write_bytes(table([ROW | {"color": "[/red]\x1b[31m.png"}]))
    assert main(["detect", "--sequence", str(tmp_path)]) == 0
    out = capfd.readouterr().out
    assert "red]" in out and "\x1b" not in out
