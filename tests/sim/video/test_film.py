"""The video: H.264 that a browser plays, every law for the whole flight, and what happens where it cannot be made."""

from __future__ import annotations

from pathlib import Path

import av
import cv2
import numpy as np
import pytest
from PIL import Image
from synthetic_trace import synthetic_trace

from sim.flight.pictures import pack_pictures, unpack_picture
from sim.video import film
from sim.video.animation import LAST_MS, RATE_HZ, WIDTH, write_webp
from sim.video.film import FRAME_RATE_HZ, OUTSIDE_SIZE, TITLE_HEIGHT, encode, film_frames, write_video
from sim.world.scene import PaintScene, Scene

SCENE = Scene(paint=PaintScene(stroke_m=0.2, rows=1))


@pytest.fixture(scope="module")
def traces():
    return {law: synthetic_trace(scene=SCENE, law=law) for law in ("qp", "paper")}


@pytest.mark.slow
def test_video_shows_both_laws_for_the_whole_flight_in_a_form_that_browsers_play(traces, tmp_path):
    write_video(traces, tmp_path / "video.mp4")
    with av.open(str(tmp_path / "video.mp4")) as container:
        (stream,) = container.streams
        codec = stream.codec_context
        assert (codec.name, codec.pix_fmt, codec.width) == ("h264", "yuv420p", 2 * OUTSIDE_SIZE[0])
        decoded = [frame.to_ndarray(format="rgb24") for frame in container.decode(stream)]
    assert len(decoded) == int(float(traces["qp"].t[-1]) * FRAME_RATE_HZ) + 1
    head = (tmp_path / "video.mp4").read_bytes()
    assert head.index(b"moov") < head.index(b"mdat"), "a player can begin before it has all"
    last = decoded[-1][TITLE_HEIGHT : TITLE_HEIGHT + OUTSIDE_SIZE[1], : OUTSIDE_SIZE[0]]
    blue = (last[..., 2].astype(int) - last[..., 0]) > 80
    assert blue.sum() > 300, "the painted row"


def test_every_picture_arrives_in_order(tmp_path):
    pictures = [np.full((64, 96, 3), 8 * number, np.uint8) for number in range(30)]
    encode(pictures, tmp_path / "grey.mp4", 10)
    with av.open(str(tmp_path / "grey.mp4")) as container:
        grey = [frame.to_ndarray(format="rgb24").mean() for frame in container.decode(video=0)]
    assert np.abs(np.array(grey) - 8 * np.arange(30)).max() < 3.0


@pytest.mark.parametrize("laws", [("qp",), ("qp", "paper")])
@pytest.mark.parametrize("pictures", [0, 12])
def test_any_set_of_parts_makes_pictures_of_one_even_size(traces, laws, pictures):
    chosen = {law: synthetic_trace(scene=SCENE, law=law, pictures=pictures) for law in laws}
    sizes = {frame.shape for frame in film_frames(chosen, rate_hz=0.3)}
    ((height, width, _),) = sizes
    assert height % 2 == 0 and width % 2 == 0


@pytest.mark.parametrize("laws", [("qp",), ("qp", "paper")])
def test_a_portrait_camera_and_a_law_without_a_picture_yet_make_one_even_size(laws):
    chosen = {law: synthetic_trace(scene=SCENE, law=law, pictures=0) for law in laws}
    chosen["qp"].pictures = [(0.0, np.full((640, 480, 3), 7, np.uint8), "paint")]
    frames = list(film_frames(chosen, rate_hz=0.3))
    ((height, width, _),) = {frame.shape for frame in frames}
    assert height % 2 == 0 and width % 2 == 0
    rows, columns = np.nonzero((frames[0] == 7).all(axis=2))
    assert np.ptp(rows) + 1 == pytest.approx(4 / 3 * (np.ptp(columns) + 1), abs=2.0), "not stretched"


def test_an_opencv_without_triangles_leaves_the_view_from_outside_out(traces, monkeypatch):
    whole = next(iter(film_frames(traces)))
    monkeypatch.delattr(cv2, "triangleRasterize")
    frame = next(iter(film_frames(traces)))
    assert frame.shape[1] == whole.shape[1] and frame.shape[0] < whole.shape[0]


def test_a_missing_encoder_is_named(monkeypatch):
    assert film.missing_encoder() is None
    monkeypatch.setattr(film.importlib.util, "find_spec", lambda name: None)
    assert "pip install av" in (film.missing_encoder() or "")


def test_packed_pictures_look_the_same():
    trace = synthetic_trace(scene=SCENE)
    smooth = np.tile(np.linspace(0, 255, 160).astype(np.uint8)[None, :, None], (120, 1, 3))
    smooth[..., 2] = 10
    trace.pictures = [(0.0, smooth, "paint")]
    packed = pack_pictures(trace).pictures[0][1]
    assert packed.ndim == 1
    assert np.abs(unpack_picture(packed).astype(int) - smooth).mean() < 3.0


README = Path(__file__).parents[3] / "README.md"


def test_every_picture_is_kept_at_its_time(tmp_path):
    frames = [np.full((200, 2 * WIDTH, 3), 20 * number, np.uint8) for number in range(10)]
    write_webp(frames, tmp_path / "grey.webp")
    with Image.open(tmp_path / "grey.webp") as image:
        assert (image.size, image.n_frames, image.info["loop"]) == ((WIDTH, 100), 10, 0)
        grey, times = [], []
        for number in range(10):
            image.seek(number)
            grey.append(np.asarray(image.convert("RGB")).mean())
            times.append(image.info["duration"])
    assert np.abs(np.array(grey) - 20 * np.arange(10)).max() < 3.0
    assert times == [1e3 / RATE_HZ] * 9 + [LAST_MS]


def test_the_readme_shows_a_whole_flight_in_less_than_3_mb():
    file = README.parent / "docs/images/flight.webp"
    assert "(docs/images/flight.webp)" in README.read_text(encoding="utf-8")
    assert file.stat().st_size < 3e6
    with Image.open(file) as image:
        assert image.size[0] == WIDTH and image.n_frames > 80
