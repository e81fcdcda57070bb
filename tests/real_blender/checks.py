# SPDX-License-Identifier: GPL-3.0-or-later
"""The extension as a user has it: the zip, installed into a real Blender, rendering by every road.

Not part of ``make test``, which has Blender as a Python module only. Run by ``make test-real`` with the commands in
BLENDER and XVFB_BLENDER.
"""

from __future__ import annotations

import contextlib
import json
import os
import re
import shlex
import shutil
import signal
import subprocess
import sys
import tempfile
import warnings
from pathlib import Path

import numpy as np
import OpenImageIO as oiio
import pytest

HERE = Path(__file__).resolve().parent
ROOT = HERE.parent.parent
BLENDER = shlex.split(os.environ.get("BLENDER", "blender"))
XVFB_BLENDER = shlex.split(os.environ.get("XVFB_BLENDER", "xvfb-blender"))
STEP = 1 / 255  # of an 8 bit picture
START = 60  # seconds in which Blender prints its first line; xvfb-run, which may wait for its screen for ever, does not
PATIENCE = 200  # seconds for one run of Blender


class Blender:
    """A Blender with user resources of its own, in which the extension is installed."""

    def __init__(self, resources: Path) -> None:
        self.environment = {**os.environ, "BLENDER_USER_RESOURCES": str(resources)}
        # Mesa maps the index of its cache; programs of another version cut it to their own size under it: SIGBUS.
        self.environment["MESA_SHADER_CACHE_DIR"] = str(resources.parent / "shaders")

    def __call__(self, *arguments: str | Path, command: list[str] = BLENDER, code: int = 0) -> str:
        """Run it, in the checkout's folder; its whole output."""
        for _ in range(3):
            returned, printed = self._run([*command, *map(str, arguments)])
            if returned == -signal.SIGKILL and not printed:
                warnings.warn(f"{command[0]} did not start in {START} s: once more", stacklevel=2)
            else:
                break
        assert returned == code, printed
        assert "Traceback" not in printed, printed
        return printed

    def _run(self, command: list[str]) -> tuple[int, str]:
        """Exit code and output; killed, with the screen that it draws on, if it does not start or does not end."""
        with tempfile.TemporaryFile("w+", errors="replace") as output:
            process = subprocess.Popen(command, cwd=ROOT, env=self.environment, start_new_session=True,
                                       stdout=output, stderr=subprocess.STDOUT)  # fmt: skip
            for patience in (START, PATIENCE):
                with contextlib.suppress(subprocess.TimeoutExpired):
                    process.wait(patience)
                if process.returncode is not None or not os.fstat(output.fileno()).st_size:
                    break
            if process.returncode is None:
                os.killpg(process.pid, signal.SIGKILL)
            returned = process.wait()
            output.seek(0)
            return returned, output.read()

    def script(self, expression: str) -> str:
        """Run one line of Python in the background; its output."""
        return self("-b", "--python-exit-code", "1", "--python-expr", expression)


@pytest.fixture(scope="session")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return tmp_path_factory.mktemp("real")


@pytest.fixture(scope="session")
def archive(folder: Path) -> Path:
    """The zip with the Embree that this Blender's Python can load."""
    printed = Blender(folder / "bare").script("import sys; print('PYTHON', '%d.%d' % sys.version_info[:2])")
    (version,) = re.findall(r"^PYTHON (.+)$", printed, re.M)
    command = [sys.executable, ROOT / "tools" / "build_extension.py", "--python", version, "--output-dir", folder]
    subprocess.run(command, check=True)
    (built,) = folder.glob("*.zip")
    return built


@pytest.fixture(scope="session")
def blender(folder: Path, archive: Path) -> Blender:
    (folder / "user").mkdir()
    blender = Blender(folder / "user")
    blender("--command", "extension", "install-file", "-r", "user_default", "-e", archive)
    return blender


@pytest.fixture(scope="session")
def scene(blender: Blender, folder: Path) -> Path:
    path = folder / "scene.blend"
    blender("-b", "--python-exit-code", "1", "--python", HERE / "make_scene.py", "--", path)
    return path


@pytest.fixture(scope="session")
def still(blender: Blender, folder: Path, scene: Path) -> Path:
    """Frame 1, by plain `blender -b FILE -f 1`."""
    blender("-b", scene, "-o", folder / "still_####", "-F", "PNG", "-f", "1")
    return folder / "still_0001.png"


@pytest.fixture(scope="session")
def command_line(blender: Blender, folder: Path, scene: Path) -> Path:
    """The folder in which `blender -c hybrid render` left picture.png, report.json and the passes."""
    output = folder / "command line"
    output.mkdir()
    blender("-c", "hybrid", "render", scene, "--output", output / "picture.png", "--frame", "1",
            "--report", output / "report.json", "--passes", output)  # fmt: skip
    return output


def read(path: Path) -> np.ndarray:
    """(height, width, channels) float32 as stored."""
    pixels = oiio.ImageInput.open(str(path)).read_image("float")
    assert pixels is not None and np.isfinite(pixels).all()
    return pixels


def worst(a: np.ndarray, b: np.ndarray) -> float:
    return float(np.abs(a[..., :3] - b[..., :3]).max())


def far_from(mask: np.ndarray) -> np.ndarray:
    """Pixels with no coverage in themselves or beside them: the tail of the pixel filter ends there."""
    around = np.pad(mask, 1)
    shifts = [np.roll(around, (y, x), (0, 1)) for y in (-1, 0, 1) for x in (-1, 0, 1)]
    return np.max(shifts, axis=0)[1:-1, 1:-1] == 0


def test_blender_itself_calls_the_zip_valid(blender: Blender, archive: Path) -> None:
    assert "Success" in blender("--command", "extension", "validate", archive)


def test_it_is_enabled_and_breaks_no_policy(blender: Blender) -> None:
    printed = blender.script(
        "import bpy, addon_utils, embreex; print('ENABLED', addon_utils.check('bl_ext.user_default.hybrid_addon')[1]);"
        "print('WARNINGS', addon_utils._extensions_warnings_get()); print('EMBREE', embreex.__file__)"
    )
    assert "ENABLED True" in printed
    assert "WARNINGS {}" in printed
    assert f"EMBREE {blender.environment['BLENDER_USER_RESOURCES']}" in printed, printed


def test_kernels_compile_into_the_folder_of_the_extension(blender: Blender) -> None:
    """One of them: all take half a minute. A Python for which there is no numba goes without."""
    printed = blender.script(
        "import os; del os.environ['HYBRID_KERNELS']; import bl_ext.user_default.hybrid_addon as door, importlib;"
        "loading = importlib.import_module('.hybrid_addon.tracer.kernels.loading', door.__name__);"
        "now = loading.load({'tracer.geometry.aggregate.refine'}); print('STATE', now['ready'], now['failed']);"
        "print('KEPT', len(list(loading.cache_folder().iterdir())), loading.cache_folder())"
    )
    kept = f"{blender.environment['BLENDER_USER_RESOURCES']}/extensions/.user/user_default/hybrid_addon/kernels"
    assert "STATE 1 {}" in printed and re.search(rf"^KEPT [2-9] {re.escape(kept)}$", printed, re.M), printed


def test_one_frame_holds_both_halves(blender: Blender, folder: Path, scene: Path, still: Path,
                                     command_line: Path) -> None:  # fmt: skip
    """Away from the ball the picture is EEVEE's own, and on it another one: a mirror, not a grey ball."""
    blender("-c", "hybrid", "render", scene, "--output", folder / "raster.png", "--frame", "1", "--mode", "raster")
    picture, raster, mask = read(still), read(folder / "raster.png"), read(command_line / "mask.exr")[..., 0]
    assert picture.shape[:2] == mask.shape == (64, 96)
    assert 0.02 < mask.mean() < 0.5
    outside = far_from(mask)
    assert worst(picture[outside], raster[outside]) <= STEP
    assert worst(picture[mask > 0.99], raster[mask > 0.99]) > 50 * STEP


def test_the_command_renders_the_same_picture(still: Path, command_line: Path) -> None:
    assert worst(read(still), read(command_line / "picture.png")) <= STEP


def test_the_report_says_that_rays_were_traced(command_line: Path) -> None:
    report = json.loads((command_line / "report.json").read_text(encoding="utf-8"))
    assert report["rays"]["camera"] > 0
    assert report["rays"]["reflected"] > 0
    assert all(count == 0 for count in report["invariants"].values())


def test_bad_input_is_named_in_one_line(blender: Blender, folder: Path) -> None:
    printed = blender("-c", "hybrid", "render", "no such file.blend", "--output", folder / "none.png", code=2)
    assert len([line for line in printed.splitlines() if "no such file.blend" in line]) == 1
    assert not (folder / "none.png").exists()


@pytest.mark.parametrize("how", [["-f", "1"], ["-s", "1", "-e", "3", "-a"]])
def test_a_failure_leaves_no_picture_and_an_exit_code(
    blender: Blender, folder: Path, scene: Path, how: list[str]
) -> None:
    """EEVEE's half with a hole in it, and exit code 0, is what a farm would take for a picture."""
    output = folder / "failed"
    output.mkdir(exist_ok=True)
    lamp = "next(o for o in bpy.data.objects if o.type == 'LIGHT')"
    spoil = f"import bpy; bpy.context.scene.camera = {lamp}; print('TEMPORARY', bpy.app.tempdir)"
    printed = blender("-b", scene, "--python-expr", spoil, "-o", output / "f_####", "-F", "PNG", *how, code=1)
    assert printed.count("Hybrid: ") == 1, printed
    assert not list(output.iterdir())
    (temporary,) = re.findall(r"^TEMPORARY (.+)$", printed, re.M)
    assert not Path(temporary).exists()


def test_an_animation_moves_in_both_halves(blender: Blender, folder: Path, scene: Path, still: Path,
                                           command_line: Path) -> None:  # fmt: skip
    """`-a` over three frames: the cube moves in EEVEE's half, and its reflection moves in the ball, which stands."""
    blender("-b", scene, "-o", folder / "motion_####", "-F", "PNG", "-s", "1", "-e", "3", "-a")
    frames = [read(folder / f"motion_{number:04d}.png") for number in (1, 2, 3)]
    assert worst(frames[0], read(still)) <= STEP
    mask = read(command_line / "mask.exr")[..., 0]
    for a, b in ((0, 1), (1, 2), (0, 2)):
        assert worst(frames[a][mask == 0], frames[b][mask == 0]) > 20 * STEP, "EEVEE's half stands still"
        assert worst(frames[a][mask > 0.99], frames[b][mask > 0.99]) > 20 * STEP, "the reflection stands still"


def test_open_job_description_installs_the_zip_and_renders(archive: Path, folder: Path, scene: Path, still: Path,
                                                           ) -> None:  # fmt: skip
    """farm/openjd as the manual says it, on a Blender that has nothing installed: frame 1 is the picture of `-f 1`."""
    job = {"BlenderFile": scene, "Frames": "1", "OutputFolder": folder / "farm",
           "OutputName": "job_####.png", "HybridExtension": archive, "Blender": shutil.which(BLENDER[0]),
           "HybridBlender": shutil.which(BLENDER[0])}  # fmt: skip
    words = [word for name, value in job.items() for word in ("--job-param", f"{name}={value}")]
    templates = ROOT / "farm" / "openjd"
    process = subprocess.run(
        [sys.executable, "-c", "from openjd.cli import main; main()", "run", templates / "render.yaml",
         "--environment", templates / "environment.yaml", *words],
        env={**os.environ, "BLENDER_USER_RESOURCES": str(folder / "nothing here")}, text=True, timeout=400,
        stdout=subprocess.PIPE, stderr=subprocess.STDOUT,
    )  # fmt: skip
    assert process.returncode == 0, process.stdout
    assert sorted(path.name for path in (folder / "farm").iterdir()) == ["job_0001.png"]
    assert worst(read(folder / "farm" / "job_0001.png"), read(still)) <= STEP


def test_f12_in_a_window_gives_the_same_picture(blender: Blender, folder: Path, scene: Path, still: Path) -> None:
    picture = folder / "window.png"
    blender(scene, "--python", HERE / "f12.py", "--", picture, command=XVFB_BLENDER)
    assert worst(read(picture), read(still)) <= STEP


AWKWARD = "Müllers Küche, d'été 100% [x] & 東京 #1"
AS_A_USER = ["setpriv", "--bounding-set=-dac_override,-dac_read_search"]  # root asks no permission otherwise


def test_read_only_home_and_scene_folder_of_an_awkward_name(blender: Blender, folder: Path, scene: Path, still: Path,
                                                            ) -> None:  # fmt: skip
    """Nothing may be written but where the user asked; the same picture comes out by both roads."""
    own, output = folder / AWKWARD, folder / f"out {AWKWARD}"
    own.mkdir()
    output.mkdir()
    file = Path(shutil.copy(scene, own / f"{AWKWARD}.blend"))
    resources = Path(shutil.copytree(blender.environment["BLENDER_USER_RESOURCES"], folder / f"user {AWKWARD}"))
    closed = [own, *(path for path in [resources, *resources.rglob("*")] if path.is_dir())]
    limited = Blender(resources)
    limited.environment["HOME"] = "/proc/none"  # there is none and none can be made
    command = [*AS_A_USER, *BLENDER] if os.geteuid() == 0 else BLENDER
    for path in closed:
        path.chmod(0o555)
    try:
        places = (str(own), str(resources))
        look = f"import os; print('WRITABLE', [os.access(p, os.W_OK) for p in {(*places, '/proc/none')!r}])"
        written = limited("-b", "--python-expr", look, command=command)
        assert "WRITABLE [False, False, False]" in written, "these folders can be written: the check shows nothing"
        limited("-c", "hybrid", "render", file, "--output", output / "{blend_name}.png", "--frame", "1",
                "--report", output / "report.json", "--passes", output / "passes é", command=command)  # fmt: skip
        limited("-b", file, "-o", output / "plain_##", "-F", "PNG", "-f", "1", command=command)
    finally:
        for path in closed:
            path.chmod(0o755)
    assert sorted(path.name for path in output.iterdir())[1:] == ["passes é", "plain_01.png", "report.json"]
    for picture in output.glob("*.png"):
        assert worst(read(picture), read(still)) <= STEP
    assert [path.name for path in own.iterdir()] == [file.name]


def test_handlers_of_other_add_ons(blender: Blender, folder: Path, scene: Path, still: Path) -> None:
    """With handlers of every kind that edit the scene: the same picture, and theirs stand when ours are gone."""
    leave = "import bpy; bpy.app.driver_namespace['left_alone']()"
    printed = blender("-b", scene, "--python", HERE / "neighbours.py", "-o", folder / "among_##", "-F", "PNG",
                      "-f", "1", "--python-expr", leave)  # fmt: skip
    assert "NEIGHBOURS: True []" in printed, printed
    (called,) = re.findall(r"^CALLED: (.*)$", printed, re.M)
    assert {"render_init", "render_pre", "render_post", "render_write", "frame_change_post"} <= set(called.split())
    assert worst(read(folder / "among_01.png"), read(still)) <= STEP
    picture = folder / "among, window.png"
    blender(scene, "--python", HERE / "neighbours.py", "--python", HERE / "f12.py", "--", picture, command=XVFB_BLENDER)
    assert worst(read(picture), read(still)) <= STEP


def test_escape_cancels_at_once_and_leaves_nothing(blender: Blender, folder: Path, scene: Path) -> None:
    """The picture grows; Esc: the job ends and keeps it, no temporary file stays, the pipeline still stands. And the
    window says why a render failed."""
    printed = blender(scene, "--python", HERE / "escape.py", command=XVFB_BLENDER)
    (seconds,) = re.findall(r"^ESCAPE: ([\d.]+) s$", printed, re.M)
    assert float(seconds) < 2.0, printed  # a second, and as much again for xdotool and a busy machine
    assert "KEPT: True" in printed and "LEFT: [] PIPELINE: True" in printed, printed
    told = dict(re.findall(r"^REASON (\w+) [\d.]+ (.*)$", printed, re.M))  # after so many seconds: read, not tested
    for name, said in (("camera", "ERROR Hybrid: Scene 'Scene' looks through"),
                       ("embree", "ERROR Hybrid: Embree does not load"),
                       ("memory", "ERROR Hybrid: Not enough memory: film"),
                       ("warning", "WARNING Hybrid: 1 warning: see Report")):  # fmt: skip
        assert told[name].startswith(said), told


def test_the_panels_draw(blender: Blender, folder: Path) -> None:
    """The pictures docs/panels*.png; no word is cut; a panel that raises leaves a traceback in the output."""
    printed = blender("--python", HERE / "panels.py", "--", folder / "panels.png", command=XVFB_BLENDER)
    measured = re.findall(r"^CUT (.+) \d+ (.+)$", printed, re.M)
    assert measured == [(language, "{}") for language in ("en_US", "en_US", "de_DE", "de_DE")], printed
    picture = read(folder / "panels.png")
    assert picture.shape[:2] == (800, 1280)
    assert picture.std() > 0.05
    light = read(folder / "panels_german.png")
    assert light.mean() > picture.mean() + 0.2  # its theme


def test_advice_flags_undoes_and_draws(blender: Blender, folder: Path) -> None:
    """What needs rays, in a window: asked, ray traced with one click, undone, redone; the list and the panels draw."""
    printed = blender("--python", HERE / "advice.py", "--", folder, command=XVFB_BLENDER)
    assert "ADVICE: ok" in printed, printed
    assert read(folder / "advice.png").std() > 0.05


def test_the_viewport_shows_the_preview(blender: Blender, folder: Path, scene: Path) -> None:
    """The ball of rendered shading turns into a mirror at rest, again after a movement; disabling takes it away."""
    printed = blender(scene, "--python", HERE / "preview.py", "--", folder / "preview", command=XVFB_BLENDER)
    assert "PREVIEW: held, local, not edited" in printed and "PREVIEW: done" in printed, printed
    assert "Traceback" not in printed, printed
    eevee, traced, without = (read(folder / f"preview_{name}.png") for name in ("eevee", "traced", "without"))
    ball = far(eevee, traced)
    assert 0.002 < ball.mean() < 0.2, ball.mean()
    assert far(eevee, without).mean() < 0.001


def test_a_retrace_in_a_window_is_the_whole_render(blender: Blender, folder: Path, scene: Path) -> None:
    """By the button's operator, as a job; into the Render Result, equal to F12 with the same settings."""
    printed = blender(scene, "--python", HERE / "retrace.py", "--", folder / "retrace", command=XVFB_BLENDER)
    assert "RETRACE: done" in printed, printed
    first, again, later, whole = (read(folder / f"retrace_{name}.exr") for name in ("first", "again", "later", "whole"))
    np.testing.assert_array_equal(again, whole)
    np.testing.assert_array_equal(later, whole)
    assert np.abs(first - again).max() > 0.01


def far(a: np.ndarray, b: np.ndarray) -> np.ndarray:
    """Pixels of the viewport's part of two screenshots that differ beyond doubt."""
    return np.abs(a[90:700, :1000, :3] - b[90:700, :1000, :3]).max(axis=-1) > 0.1


def test_a_first_hour_by_keys_and_clicks(blender: Blender, folder: Path) -> None:
    """Enable, tick, F12, insets, a pixel clicked, a slider, undo, save, reopen, F12, disable: as it was."""
    output = folder / "artist"
    output.mkdir()
    printed = blender("--enable-event-simulate", "--python", HERE / "artist.py", "--", output, command=XVFB_BLENDER)
    assert "ARTIST: done" in printed, printed
    lines = (output / "pixel.txt").read_text(encoding="utf-8").splitlines()
    assert lines[0].startswith("pixel 60, 45: radiance ") and "to 'Cube'" in lines[1]
    insets, disabled = read(output / "insets.png"), read(output / "disabled.png")
    assert far(insets, disabled).mean() > 0.02, "nothing was drawn, or it stayed"


def test_random_actions_leave_the_file_consistent(blender: Blender, folder: Path) -> None:
    """Flag, unflag, delete, rename, undo, redo, copy, render, append, save, reload ...: four of the walks."""
    (folder / "walk").mkdir()
    printed = blender("--python", HERE / "walk.py", "--", "12-15", 20, folder / "walk", command=XVFB_BLENDER)
    assert printed.count(": consistent") == 4 and "WALK: all consistent" in printed, printed
