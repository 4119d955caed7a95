"""Films of a response: the mechanism in motion above its contact forces, as GIF or MP4."""

import io
import shutil
import subprocess
import tempfile
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np

from hpcclear.base.arrays import Array
from hpcclear.base.errors import InputError
from hpcclear.report.figures import labels, motion, moving, style
from hpcclear.results import files
from hpcclear.results.content import Results, texts_in

RATE = 25
"""Frames a second: a frame takes 40 ms, which a GIF can say."""

LONGEST = 120.0  # s

_DPI = 150


def animate(
    response: Results, path: str | Path, seconds: float = 6.0, revolutions: int = 2
) -> Path:
    """Write a film of the last revolutions of a response (kind ``response``; fewer if it has fewer), slowed down or sped up to
    a length in seconds.

    `path`: ends in ``.gif``, or in ``.mp4`` where the program ffmpeg is installed. Raises InputError: another ending, no
    ffmpeg, no length, or another file in the way. Raises StorageError: the disk is full or fails.
    """
    place = Path(path)
    if place.suffix.lower() not in (".gif", ".mp4"):
        reason = "an animation is a gif or an mp4"
        raise InputError("animation", str(place), reason, "End the name in .gif or .mp4")
    if not 1.0 / RATE <= seconds <= LONGEST:
        reason = f"must be from {1 / RATE:g} to {LONGEST:g} s"
        raise InputError("seconds", seconds, reason, "Give another length")
    program = _ffmpeg(place) if place.suffix.lower() == ".mp4" else ""
    pictures = _pictures(motion.latest(response, revolutions), round(seconds * RATE))
    content = _mp4(pictures, program) if program else _gif(pictures)
    files.write_bytes(place, content, b"hpcclear")
    return place


def _pictures(shown: Results, count: int) -> Iterator[Array]:
    """Frames (height, width, 3), bytes, evenly spaced in time."""
    time = shown["time"].values
    at = np.linspace(time[0], time[-1], count, endpoint=False)
    nearest = np.clip(np.searchsorted(time, at), 0, len(time) - 1)
    figure, movable = _scene(shown)
    canvas: Any = figure.canvas
    canvas.draw()
    still = canvas.copy_from_bbox(figure.bbox)
    for k in nearest:
        canvas.restore_region(still)
        for artist in movable(int(k)):
            artist.axes.draw_artist(artist)
        yield np.asarray(canvas.buffer_rgba())[..., :3].copy()


def _scene(shown: Results) -> "tuple[style.Figure, Any]":
    """The figure without what moves, and a function that gives these artists at an instant."""
    with style.matplotlib().rc_context({**style.RC, "backend": "agg"}):
        from matplotlib.backends.backend_agg import FigureCanvasAgg

        forces = shown["contact_force"].values
        pressed = forces.shape[1] > 0 and bool((forces > 0.0).any())
        ratio = [2.2, 1.0] if pressed else [1.0]
        figure, axes = style.grid(len(ratio), 1, 100.0 if pressed else 70.0, height_ratios=ratio)
        FigureCanvasAgg(figure)
        figure.set_dpi(_DPI)
        mechanism = _Mechanism(axes[0, 0], shown)
        cursor = _forces(axes[1, 0], shown) if pressed else None
        style.settle(axes)
    turn = motion.turns(shown)

    def movable(k: int) -> list[Any]:
        if cursor is None:
            return mechanism.at(k)
        cursor.set_xdata([turn[k], turn[k]])
        return [*mechanism.at(k), cursor]

    return figure, movable


class _Mechanism:
    """Bodies as lines, sliders as squares, and clearances larger than they are: bearings about journals."""

    def __init__(self, axes: "style.Axes", shown: Results) -> None:
        from matplotlib.patches import Circle

        self._bodies, points, _ = moving.bodies(shown)
        pins = shown.sel(joint=motion.pins(shown))
        e = moving.eccentricities(pins)
        self._pairs = moving.pairs(points, e)
        unit, size = labels.scale("m", points), float(np.ptp(points, axis=(0, 1)).max())
        known = motion.clearances(pins) if self._pairs and "penetration" in pins else np.zeros(0)
        widest = float(np.nanmax(known, initial=0.0))
        gain = max(1.0, float(f"{0.025 * size / widest:.0e}")) if widest else 1.0
        for j, (journal, bearing) in enumerate(self._pairs):
            points[:, bearing] = points[:, journal] - gain * e[:, j]
        self._points = unit(points)
        low, high = self._points.min(axis=(0, 1)), self._points.max(axis=(0, 1))
        margin = 0.08 * float((high - low).max())
        (left, bottom), (right, top) = low - margin, high + margin
        axes.set(xlim=(left, right), ylim=(bottom, top), aspect="equal")
        axes.set(xlabel=unit.label("x"), ylabel=unit.label("y"))
        axes.set_title(f"clearances enlarged {gain:g} times" if widest else "")
        look: style.Look = {"lw": 3.0, "ms": 4.0, "solid_capstyle": "round", "animated": True}
        self._lines = []
        for k, places in enumerate(self._bodies):
            self._lines += axes.plot([], [], "o-", color=style.colour(k), **look)
            if len(places) == 1:
                self._lines[-1].set(marker="s", markersize=11.0, alpha=0.5)
        radii = unit(np.nan_to_num(gain * known)) + 0.012 * size * unit.factor
        edge: style.Look = {"fill": False, "lw": 1.2, "ec": style.colour("ink"), "animated": True}
        self._rings = [Circle((0.0, 0.0), radius, **edge) for radius in radii]
        for ring in self._rings:
            axes.add_patch(ring)

    def at(self, k: int) -> list[Any]:
        """Artists at an instant; more than two points are a closed outline."""
        for line, places in zip(self._lines, self._bodies, strict=True):
            ends = [*places, places[0]] if len(places) > 2 else places
            line.set_data(*self._points[k, ends].T)
        for ring, (_, bearing) in zip(self._rings, self._pairs, strict=False):
            ring.set_center(self._points[k, bearing])
        return [*self._lines, *self._rings]


def _forces(axes: "style.Axes", shown: Results) -> Any:
    """Contact forces over the revolutions, and the line that marks the instant."""
    unit, turn = labels.of(shown["contact_force"]), motion.turns(shown)
    for row, joint in enumerate(texts_in(shown, "joint")):
        force = unit(shown["contact_force"].sel(joint=joint))
        axes.plot(turn, force, color=style.colour(row), lw=0.8, label=labels.literal(joint))
    style.key(axes, "above")
    axes.set(xlabel=motion.turns_label(shown), ylabel=unit.label("contact force"))
    return axes.axvline(turn[0], color=style.colour("ink"), lw=1.0, animated=True)


def _gif(pictures: Iterator[Array]) -> bytes:
    from PIL import Image  # comes with matplotlib

    fast = Image.Quantize.FASTOCTREE
    first, *others = [Image.fromarray(one).quantize(64, fast) for one in pictures]
    buffer = io.BytesIO()
    first.save(
        buffer, "GIF", save_all=True, append_images=others, duration=1000 // RATE, loop=0,
        comment=b"hpcclear",
    )  # fmt: skip
    return buffer.getvalue()


def _ffmpeg(place: Path) -> str:
    program = shutil.which("ffmpeg")
    if program is None:
        reason = "MP4 needs the program ffmpeg, which is not installed"
        remedy = f"Install ffmpeg, or name the file {str(place.with_suffix('.gif'))!r}"
        raise InputError("animation", str(place), reason, remedy)
    return program


def _mp4(pictures: Iterator[Array], program: str) -> bytes:
    """An MP4 that every player reads (H.264, 4:2:0, even sides); the same bytes for the same pictures and ffmpeg."""
    first = next(pictures)
    height, width = first.shape[0] // 2 * 2, first.shape[1] // 2 * 2
    raw = ["-f", "rawvideo", "-pix_fmt", "rgb24", "-s", f"{width}x{height}", "-r", str(RATE)]
    coded = ["-c:v", "libx264", "-pix_fmt", "yuv420p", "-threads", "1", "-fflags", "+bitexact"]
    with tempfile.TemporaryDirectory() as folder:
        target = Path(folder) / "film.mp4"
        words = [program, "-v", "error", *raw, "-i", "-", *coded]
        words += ["-flags:v", "+bitexact", "-metadata", "comment=hpcclear", str(target)]
        content = b"".join(one[:height, :width].tobytes() for one in (first, *pictures))
        done = subprocess.run(words, input=content, capture_output=True, check=False)
        if done.returncode != 0:
            said = done.stderr.decode(errors="replace")[-200:].strip()
            reason = f"ffmpeg cannot write it ({said})"
            raise InputError("animation", ".mp4", reason, "Write a .gif, or install another ffmpeg")
        return target.read_bytes()
