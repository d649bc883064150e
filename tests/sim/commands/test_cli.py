"""The console script: output, files and exit codes, with a synthetic flight in place of the simulation."""

from __future__ import annotations

import dataclasses
import json
import os
import signal
import subprocess
import sys
import time
from pathlib import Path

import numpy as np
import pytest
from contract_schema import check_summary, refusal
from made_up_flights import draw_one_figure, fake_fly

import ibvs_qp
import sim.flight.side_by_side
from ibvs_qp.config.errors import ConfigError
from ibvs_qp.pilot.presets import FILES
from sim.commands.cli import main
from sim.commands.options import preset_file
from sim.flight.flight_log import load_run
from sim.flight.options import FlightOptions
from sim.world.scene import PaintScene, Scene
from sim.world.worlds import DEFAULT_WORLD, in_world


@pytest.fixture
def flown(monkeypatch, tmp_path):
    """Flights are synthetic, one after the other; run folders lie in a temporary directory."""
    monkeypatch.setattr(sim.flight.side_by_side, "fly", fake_fly)
    monkeypatch.setattr(os, "sched_getaffinity", lambda _: {0}, raising=False)
    monkeypatch.chdir(tmp_path)
    return tmp_path


@pytest.fixture
def one_figure(monkeypatch):
    draw_one_figure(monkeypatch)


def test_paint_writes_the_run_folder_and_prints_a_table(flown, capsys):
    assert main(["paint", "--out", "run"]) == 0
    out, _ = capsys.readouterr()
    assert "QP law" in out and "analytic law" in out and "report.html" in out
    names = {path.name for path in (flown / "run").iterdir()}
    files = {"report.html", "summary.json", "video.mp4", "log.npz", "scene.toml", "README.txt", "figures"}
    assert names == files | {"preset_qp.toml", "preset_paper.toml"}
    figures = {path.stem for path in (flown / "run" / "figures").iterdir()}
    assert {"force", "image_error", "path", "velocity", "attitude", "thrusts", "board"} <= figures
    assert (flown / "run" / "video.mp4").stat().st_size > 10_000


def test_json_is_one_line_and_equals_the_file(flown, one_figure, capsys):
    assert main(["paint", "--json", "--no-video", "--seed", "3", "--image-size", "424x240"]) == 0
    out, err = capsys.readouterr()
    assert err == ""
    assert out.count("\n") == 1
    summary = json.loads(out)
    check_summary(summary, {"qp", "paper"})
    assert summary["command"] == "ibvs-qp paint --json --no-video --seed 3 --image-size 424x240"
    assert (summary["seed"], summary["image_size"]) == (3, [424, 240])
    run = Path(summary["run_dir"])
    assert run.parent == Path("runs") and run.name.endswith("Z")
    assert json.loads((run / "summary.json").read_text()) == summary
    assert not (run / "video.mp4").exists()
    assert summary["command"] in (run / "README.txt").read_text(), "with all options that change the flight"


def test_log_reads_back_equal(flown, one_figure, capsys):
    assert main(["paint", "--law", "qp", "--out", "run", "--no-video"]) == 0
    trace = fake_fly(in_world(Scene(), DEFAULT_WORLD), FlightOptions())
    back = load_run(flown / "run")["qp"]
    assert (back.scene, back.seed, back.phases, back.reason) == (trace.scene, 0, trace.phases, trace.reason)
    assert set(back.arrays) == set(trace.arrays)
    assert all(np.array_equal(back.arrays[name], trace.arrays[name], equal_nan=True) for name in trace.arrays)
    assert [event.text for event in back.events] == [event.text for event in trace.events]


def test_second_run_leaves_nothing_stale(flown, one_figure, capsys):
    assert main(["paint", "--out", "run", "--no-video"]) == 0
    (flown / "run" / "video.mp4").touch()
    (flown / "run" / "notes.txt").write_text("mine")
    assert main(["paint", "--law", "qp", "--out", "run", "--no-video", "--overwrite"]) == 0
    assert not (flown / "run" / "video.mp4").exists() and not (flown / "run" / "preset_paper.toml").exists()
    assert set(load_run("run")) == {"qp"} and (flown / "run" / "notes.txt").read_text() == "mine"
    assert not [file for file in (flown / "run").rglob("*") if file.name.startswith((".", "partial"))]


def test_law_that_does_not_complete_is_still_reported(flown, one_figure, capsys, monkeypatch):
    def crash(scene, options, progress=None, job=None):
        return dataclasses.replace(fake_fly(scene, options), claimed=False, reason="propeller touched the wall")

    monkeypatch.setattr(sim.flight.side_by_side, "fly", crash)
    assert main(["paint", "--json", "--no-video"]) == 0
    assert json.loads(capsys.readouterr().out)["laws"]["qp"]["reason"] == "propeller touched the wall"


def test_interrupt_writes_the_partial_run(flown, one_figure, capsys, monkeypatch):
    def cut_short(scene, options, progress=None, job=None):
        return dataclasses.replace(fake_fly(scene, options), claimed=False, reason="interrupted")

    monkeypatch.setattr(sim.flight.side_by_side, "fly", cut_short)
    assert main(["paint", "--json", "--out", "run", "--no-video"]) == 130
    out, err = capsys.readouterr()
    summary = json.loads(out)
    check_summary(summary, {"qp"})  # the analytic law never began
    assert summary["interrupted"] is True
    assert (flown / "run" / "log.npz").exists() and (flown / "run" / "report.html").exists()
    assert err.strip() == "ibvs-qp: interrupted; the partial run is in run"


def test_interrupt_while_drawing_keeps_the_log(flown, capsys, monkeypatch):
    def interrupted(*_, **__):
        raise KeyboardInterrupt

    monkeypatch.setattr("sim.figures.draw_all", interrupted)
    assert main(["paint", "--json", "--out", "run"]) == 130
    assert json.loads((flown / "run" / "summary.json").read_text())["interrupted"] is True
    assert (flown / "run" / "log.npz").exists()


@pytest.mark.parametrize(
    ("words", "needles"),
    [
        (["paint", "--scene", "missing.toml"], ["missing.toml", "--scene"]),
        (["paint", "--scene", "unknown.toml"], ["unknown.toml", "friktion", "friction"]),
        (["paint", "--scene", "range.toml"], ["range.toml", "wall.friction", "[0, 1.5]"]),
        (["paint", "--scene", "kind.toml"], ["kind.toml", "paint.rows"]),
        (["paint", "--scene", "broken.toml"], ["broken.toml", "not valid TOML"]),
        (["paint", "--scene", "."], ["--scene"]),
        (["paint", "--preset", "missing.toml"], ["missing.toml", "--preset"]),
        (["paint", "--preset", "broken.toml"], ["broken.toml", "not valid TOML"]),
        (["paint", "--preset", "key.toml"], ["key.toml: unknown key 'controller.gains.line_pk'", "line_kp"]),
        (["paint", "--preset", "value.toml"], ["value.toml: controller.tick_s = 9.0 s", "[0.0005, 0.02] s"]),
        (["paint", "--preset", "rings.toml"], ["rings.toml: controller.gains.force_ksp = 4000.0 N/m", "] N/m for a"]),
        (["paint", "--out", "file"], ["file", "--out"]),
        (["paint", "--out", "file/below"], ["file/below", "--out"]),
        (["paint", "--seed", "-1"], ["--seed", "-1"]),
        (["paint", "--seed", "one"], ["--seed", "one", "paint --help"]),
        (["paint", "--law", "pid"], ["--law", "pid", "both"]),
        (["paint", "--image-size", "3x3"], ["--image-size", "3x3", "640x480"]),
        (["paint", "--camera", "filament"], ["--camera", "filament", "plane", "gl"]),
        (["paint", "--vision", "new"], ["--vision", "new", "own", "paper"]),
        (["paint", "--sead", "3"], ["--sead", "--seed"]),
        (["paint", "--scene", "dark"], ["dark", "--scene", "dark_board"]),
        (["paint", "--preset", "scene.toml"], ["--preset scene.toml: this is a scene, not a preset"]),
        (["paint", "--scene", "key.toml"], ["--scene key.toml: this is a preset, not a scene"]),
        (["paint", "--preset", "dark_board"], ["--preset dark_board: this is a scene, not a preset"]),
        (["paint", "--scene", "octorotor_qp"], ["--scene octorotor_qp: this is a preset, not a scene"]),
        (["compare"], ["compare", "paint"]),
        (["paint", "--scene", "long.toml"], ["paint.stroke_m = 1.5 m", "at most 1.3 m", "board.width_m = 1.4 m"]),
        (["paint", "--scene", "slow.toml", "--law", "paper"], ["imu.rate_hz = 100.0 Hz", "at least 250 Hz"]),
        (["pain"], ["unknown command pain; did you mean paint?"]),
        (["fly"], ["unknown command fly; commands are paint, "]),
        ([], ["paint", "--help"]),
    ],
)
def test_user_errors_are_one_line(flown, capsys, words, needles):
    (flown / "unknown.toml").write_text("[wall]\nfriktion = 0.3\n")
    (flown / "range.toml").write_text("[wall]\nfriction = 7.0\n")
    (flown / "kind.toml").write_text('[paint]\nrows = "two"\n')
    (flown / "broken.toml").write_text("[wall\n")
    (flown / "key.toml").write_text("[controller.gains]\nline_pk = 1.0\n")
    (flown / "value.toml").write_text("[controller]\ntick_s = 9.0\n")
    (flown / "rings.toml").write_text("[controller.gains]\nforce_ksp = 4000.0\n")
    (flown / "scene.toml").write_text("[wall]\nfriction = 0.3\n")
    (flown / "file").write_text("")
    (flown / "long.toml").write_text("[paint]\nstroke_m = 1.5\n")
    (flown / "slow.toml").write_text("[imu]\nrate_hz = 100.0\n")
    before = sorted(flown.rglob("*"))
    err = refusal(words, capsys)
    for needle in needles:
        assert needle in err
    assert "Traceback" not in err
    assert sorted(flown.rglob("*")) == before, "a rejected command writes nothing"


def test_shipped_files_have_names(flown, one_figure):
    assert main(["paint", "--scene", "dark_board", "--law", "qp", "--no-video", "--out", "run"]) == 0
    assert "width_m = 1.35" in (flown / "run" / "scene.toml").read_text()
    assert preset_file(Path("octorotor_qp")) == FILES["octorotor_qp"]
    (flown / "octorotor_qp").write_text("law = 'qp'\n")
    assert preset_file(Path("octorotor_qp")) == Path("octorotor_qp"), "a file in the way is meant"


def test_the_version_is_that_of_the_package(capsys):
    assert main(["--version"]) == 0
    assert capsys.readouterr().out == f"ibvs-qp {ibvs_qp.__version__}\n"


def test_unwritable_folder(flown, capsys, monkeypatch):
    """Rejected also if the tests run as root, which can write anywhere."""

    def refuse(self, _data):
        raise PermissionError(13, "Permission denied", str(self))

    monkeypatch.setattr(Path, "write_bytes", refuse)
    err = refusal(["paint", "--out", "locked"], capsys)
    assert "locked" in err and "Permission denied" in err and "--out" in err


def test_config_error_during_the_flight_is_a_user_error(flown, capsys, monkeypatch):
    def refuse(*_, **__):
        raise ConfigError("preset x.toml: unknown key 'gain'")

    monkeypatch.setattr(sim.flight.side_by_side, "fly", refuse)
    assert main(["paint", "--out", "run"]) == 2
    assert not (flown / "run").exists()


def test_internal_error_keeps_its_traceback(flown, capsys, monkeypatch):
    def fail(*_, **__):
        raise ZeroDivisionError("seven")

    monkeypatch.setattr(sim.flight.side_by_side, "fly", fail)
    assert main(["paint", "--json"]) == 1
    assert "ZeroDivisionError: seven" in capsys.readouterr().err


#: Runs the command line where the packages of studies are not installed.
WITHOUT_STUDIES = """
import sys

class Missing:
    def find_spec(self, name, path=None, target=None):
        if name.split(".")[0] in ("polars", "optuna", "dask", "distributed"):
            raise ModuleNotFoundError(f"No module named {name!r}", name=name.split(".")[0])

sys.meta_path.insert(0, Missing())
from sim.commands.cli import main
sys.exit(main(sys.argv[1:]))
"""


@pytest.mark.slow
@pytest.mark.parametrize(
    "words", ["experiment gust --plan", "sweep x.toml", "compare a b", "faults --plan", "tune --trials 1"]
)
def test_a_study_without_its_packages_names_the_extra(tmp_path: Path, words: str) -> None:
    (tmp_path / "x.toml").write_text("")
    done = subprocess.run(
        [sys.executable, "-c", WITHOUT_STUDIES, *words.split()],
        capture_output=True,
        text=True,
        timeout=60,
        cwd=tmp_path,
    )
    assert done.returncode == 2 and done.stdout == ""
    name = words.split()[0]
    assert done.stderr == (
        f"ibvs-qp: error: {name} needs the extra studies: pip install -c constraints.txt -e '.[studies]'\n"
    )


@pytest.mark.slow
def test_paint_needs_no_package_of_the_studies(tmp_path: Path) -> None:
    (tmp_path / "short.toml").write_text("[paint]\nrows = 1\nstroke_m = 0.2\n")
    words = "paint --law qp --scene short.toml --features geometric --no-video --out run".split()
    done = subprocess.run(
        [sys.executable, "-c", WITHOUT_STUDIES, *words], capture_output=True, text=True, timeout=300, cwd=tmp_path
    )
    assert done.returncode == 0 and (tmp_path / "run" / "report.html").exists(), done.stderr


def test_help_shows_an_example_and_imports_nothing_heavy():
    code = (
        "import sys; from sim.commands.cli import main; code = main(['paint', '--help']);"
        "heavy = {'mujoco', 'cv2', 'matplotlib', 'scipy', 'casadi', 'osqp'} & set(sys.modules);"
        "print('HEAVY', sorted(heavy)); sys.exit(code)"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, timeout=60)
    assert done.returncode == 0
    assert "Example: ibvs-qp paint" in done.stdout
    assert "HEAVY []" in done.stdout


def _paint(out: Path, *words: str) -> list[str]:
    program = "import sys; from sim.commands.cli import main; sys.exit(main())"
    return [sys.executable, "-c", program, "paint", "--features", "geometric", "--json", "--out", str(out), *words]


@pytest.mark.slow
@pytest.mark.parametrize(
    "group",
    [
        pytest.param(False, id="parent alone"),
        pytest.param(True, id="whole group, as a terminal does"),
    ],
)
def test_ctrl_c_ends_both_processes_with_a_partial_run(tmp_path, group):
    """Eight rows, for a flight that no machine has finished before the signal."""
    (tmp_path / "long.toml").write_text("[paint]\nrows = 8\n")
    words = _paint(tmp_path / "run", "--no-video", "--scene", str(tmp_path / "long.toml"))
    process = subprocess.Popen(words, stdout=subprocess.PIPE, stderr=subprocess.PIPE, start_new_session=True)
    while not (tmp_path / "run").exists() and process.poll() is None:
        time.sleep(0.1)
    time.sleep(4.0)
    (os.killpg if group else os.kill)(process.pid, signal.SIGINT)
    out, err = process.communicate(timeout=120)
    assert process.returncode == 130, err.decode()
    summary = json.loads(out)
    assert summary["interrupted"] is True and set(summary["laws"]) == {"qp", "paper"}
    assert b"Traceback" not in err
    assert (tmp_path / "run" / "summary.json").exists()


@pytest.mark.slow
def test_error_found_by_a_worker_is_one_line(tmp_path):
    """The number of rotors is compared with the scene where the plant is built, in the process that flies."""
    (tmp_path / "scene.toml").write_text("[plant]\nthrust_min_n = [1.0, 2.0]\n")
    words = _paint(tmp_path / "run", "--no-video", "--scene", str(tmp_path / "scene.toml"))
    done = subprocess.run(words, capture_output=True, text=True, timeout=120)
    assert done.returncode == 2
    assert done.stderr.startswith("ibvs-qp: error: plant.thrust_min_n") and done.stderr.count("\n") == 1
    assert not (tmp_path / "run").exists()


@pytest.mark.slow
def test_one_process_or_two_fly_the_same(tmp_path):
    """Same seed, same thrusts to the bit, whether the laws share a process or not."""
    from sim.flight.side_by_side import fly_laws

    scene = Scene(paint=PaintScene(rows=1, stroke_m=0.4))
    options = FlightOptions(features="geometric", seed=4, video=False)

    def quiet(*_):
        pass

    together = fly_laws(scene, options, ("qp", "paper"), quiet, workers=1)
    apart = fly_laws(scene, options, ("qp", "paper"), quiet, workers=2)
    timing = {"step_us", "vision_ms"}
    for law in ("qp", "paper"):
        one, two = together[law].trace.arrays, apart[law].trace.arrays
        assert set(one) == set(two)
        assert len(one["t"]) > 1000
        for name in set(one) - timing:
            assert np.array_equal(one[name], two[name], equal_nan=one[name].dtype.kind == "f"), (law, name)


@pytest.mark.slow
def test_paint_on_geometric_features_end_to_end(tmp_path):
    done = subprocess.run(_paint(tmp_path / "run"), capture_output=True, text=True, timeout=900)
    assert done.returncode == 0, done.stderr
    summary = json.loads(done.stdout)
    check_summary(summary, {"qp", "paper"})
    assert summary["laws"]["qp"]["completed"], summary["laws"]["qp"]["reason"]


def test_with_json_c_libraries_do_not_write_to_standard_output():
    code = (
        "import os\nfrom sim.commands.cli import own_output\n"
        "with own_output():\n    os.write(1, b'Solver interrupted\\n')\n    print('{}')\nprint('after')\n"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, timeout=60)
    assert (done.returncode, done.stdout, done.stderr) == (0, "{}\nafter\n", "Solver interrupted\n")
