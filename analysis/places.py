"""How many files of the package each kind of addition touches: each is made in a worktree of its own, tried and counted.

    python analysis/places.py                  # some minutes: new motions are compiled

Every example is made of new files and of lines in others. Its check has to pass: a scene is accepted and its simulation gives
finite results, a command is listed, or a column is in the result. Afterwards the files that differ from the commit are counted.
"""

import csv
import subprocess
import sys
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import NamedTuple

ROOT = Path(__file__).resolve().parent.parent
RESULT = ROOT / "analysis" / "results" / "places.csv"


class Addition(NamedTuple):
    """An example: new files by their paths, text that is put before other text of files, a check, and the most files."""

    new: dict[str, str]
    put: tuple[tuple[str, str, str], ...]
    check: str
    most: int


SIMULATE = """
import numpy as np
from hpcclear import load_scene, simulate
scene = load_scene({file!r}).with_({changes})
found = simulate(scene)
assert np.isfinite(found["objective"].to_numpy()).all()
"""


def _simulated(file: str, changes: str) -> str:
    return SIMULATE.format(file=file, changes=changes)


SAIL = '''"""Drag of a point, such as that of a sail."""

from typing import Annotated, Literal

import numpy as np

from hpcclear.base.terms import Acting, Term
from hpcclear.scene.fields import Quantity
from hpcclear.scene.loads.declared import Load


def resistance(coefficient: float, vx: float, vy: float) -> tuple[float, float]:
    """Force against a velocity, N."""
    size = coefficient * np.sqrt(vx * vx + vy * vy)
    return -size * vx, -size * vy


class SailLoad(Load):
    """A force that resists the motion of a point."""

    kind: Literal["sail"]
    place: str
    """``body.point`` whose motion is resisted."""
    coefficient: Annotated[float, Quantity("N*s**2/m**2", least=0)]
    """Force per square of the speed, N s2/m2."""

    def act(self, on: Acting) -> Term:
        """The force at its place."""
        terms = (on.parameter("coefficient"), *on.velocity(self.place))
        force = on.vector(self.name, *on.call(resistance, *terms, results=("fx", "fy")))
        on.push(self.place, force)
        return on.power(self.place, force)
'''

TAPERED = '''"""A pin in a slot whose walls are inclined to its line."""

from typing import Literal

import numpy as np

from hpcclear.base.terms import Term, Touching
from hpcclear.scene.contacts.pin_in_slot import PlanarSlot
from hpcclear.scene.fields import Angle


def before_inclined(
    ex: float, ey: float, ax: float, ay: float, slope: float, half: float, radius: float
) -> tuple[float, float, float]:
    """Unit vector into a wall that is inclined to a line, and the gap before it; (ax, ay): across the line to the wall."""
    inverse = 1.0 / np.sqrt(1.0 + slope * slope)
    nx = (ax - slope * ay) * inverse
    ny = (ay + slope * ax) * inverse
    return nx, ny, ex * nx + ey * ny - (half - radius)


class TaperedSlot(PlanarSlot):
    """A pin in a slot whose walls are inclined to its line."""

    kind: Literal["tapered-slot"]  # type: ignore[assignment]
    taper: Angle
    """Slope of either wall against the line."""

    def touch(self, on: Touching, word: str) -> tuple[Term, ...]:
        """The pin before an inclined wall."""
        left = self.sides[word] > 0.0
        across = on.across if left else -on.across
        slope = on.parameter("taper") if left else -on.parameter("taper")
        terms = *on.apart, *across, slope, on.bearing_radius, on.journal_radius
        return *on.call(before_inclined, *terms, results=("nx", "ny", "gap")), on.bearing_radius
'''

LINEAR = '''"""Friction in proportion to the sliding speed."""

from hpcclear.laws.declared import FrictionLaw, Parameter


def ratio(speed, slope):
    """Without a limit."""
    return slope * speed


LAW = FrictionLaw(
    words="in proportion to the speed",
    parameters=(Parameter("slope", "s/m", "ratio of forces over the speed", least=0),),
    ratio=ratio,
)
'''

DRAG = '''"""Drag of a pin, such as that of a seal."""

from typing import Annotated, Any, ClassVar

from hpcclear.base.terms import Acting, Term
from hpcclear.scene.fields import Quantity
from hpcclear.scene.loads.declared import JointEffect


class SealDrag(JointEffect):
    """Torque against the rotation of a pin."""

    words: ClassVar[str] = "drag of the seal"

    coefficient: Annotated[float, Quantity("N*m*s/rad", least=0)]
    """Torque per angular speed, N m s/rad."""

    def act(self, on: Acting, joint: Any) -> Term:
        """Opposite torques on both bodies."""
        bodies = [place.partition(".")[0] for place in (joint.journal, joint.bearing)]
        one, two = (on.zero if body == "ground" else on.spin(body) for body in bodies)
        torque = on.let("seal", on.parameter("coefficient") * (two - one))
        for body, acting in zip(bodies, (torque, -torque), strict=True):
            if body != "ground":
                on.twist(body, acting)
        return torque * (one - two)
'''

KIND = '''"""Readings of an instrument."""

from hpcclear.results.rows import ResultKind, count, number

KIND = ResultKind(
    900, "Readings of an instrument", ("reading",),
    table={
        "reading": count("reading", "number of the reading"),
        "force": number("reading", "N", "force that was read", required=True),
    },
)
'''

FIGURE = '''"""Figure of readings (kind ``instrument``)."""

from hpcclear.report.figures import style
from hpcclear.report.parts import FigureOf
from hpcclear.results.content import Results


@style.drawn
def instrument_figure(instrument: Results) -> "style.Figure":
    """Forces in the order in which they were read (kind ``instrument``)."""
    figure, axes = style.grid(1, 1, 60.0)
    axes[0, 0].plot(instrument["force"].to_numpy())
    return figure


PARTS = (FigureOf("instrument", "instrument", instrument_figure, "Forces that were read."),)
'''

COMMAND = '''"""`greet`: a word of welcome."""

import click

from hpcclear.cli import options as cli
from hpcclear.ranks.stopping import Exit


@cli.command("start", "Say a word of welcome.")
@click.argument("name")
def run(name: str) -> int:
    """Say a word of welcome."""
    cli.show(f"welcome, {name}")
    return Exit.DONE
'''

SLOT = "jobs/loose_slot.toml"
ADDITIONS = {
    "a load": Addition(
        {"scene/loads/sail.py": SAIL}, (),
        _simulated(SLOT, '{"mechanism.loads.sail": {"kind": "sail", "place": "crank.b", "coefficient": 0.1}}'), 1,
    ),
    "a geometry of contact": Addition(
        {"scene/contacts/tapered_slot.py": TAPERED}, (),
        _simulated(SLOT, '{"mechanism.joints.slot.kind": "tapered-slot", "mechanism.joints.slot.taper": 0.01}'), 1,
    ),
    "a friction law": Addition(
        {"laws/friction/linear.py": LINEAR}, (),
        _simulated(SLOT, '{"effects.friction": {"law": "linear", "slope": 0.1}}'), 1,
    ),
    "an output column": Addition(
        {},
        (("base/outcome.py", '    "rms_frame_force": Field(',
          '    "contact_share": Field("1", "share of a revolution in contact", per="joint", when="impact",\n'
          "        of=lambda o: 1.0 - o.flight),\n"),),
        _simulated(SLOT, '{"numerics.impacts": True}')
        + 'assert np.isfinite(found["contact_share"].to_numpy()).all()\n', 1,
    ),
    "a kind of result": Addition(
        {"results/kinds/instrument.py": KIND, "report/figures/instrument.py": FIGURE}, (),
        "from hpcclear.results.names import KINDS\n"
        "from hpcclear.report import parts\n"
        "assert 'instrument' in KINDS\n"
        "import hpcclear.report.figures.instrument\n", 2,
    ),
    "a command": Addition(
        {"cli/commands/greet.py": COMMAND}, (),
        "from hpcclear.cli import main\nimport sys\nassert main(['greet', 'reader']) in (0, None)\n", 1,
    ),
    "an effect of a joint": Addition(
        {"scene/seal.py": DRAG},
        (("scene/joints.py", '    friction: IdealPinFriction | None = None\n',
          '    seal: SealDrag | None = None\n    """Drag of a seal. Without it there is none."""\n'),
         ("scene/joints.py", "\n\nclass Material(Table)", "from hpcclear.scene.seal import SealDrag\n")),
        _simulated(SLOT, '{"mechanism.joints.o2.seal": {"coefficient": 0.01}}')
        + 'assert abs(found["energy_residual"].to_numpy()).max() < 1e-3\n'
        + "from hpcclear.scene.describing import effects_on\n"
        "assert 'drag of the seal in o2' in [*effects_on(scene)]\n", 4,
    ),
}  # fmt: skip


@contextmanager
def worktree() -> Iterator[Path]:
    """A checkout of the last commit that may be changed."""
    with tempfile.TemporaryDirectory() as folder:
        place = Path(folder) / "places"
        _git(ROOT, "worktree", "add", "--detach", str(place), "HEAD")
        try:
            yield place
        finally:
            _git(ROOT, "worktree", "remove", "--force", str(place))


def _git(place: Path, *words: str) -> str:
    done = subprocess.run(["git", *words], cwd=place, check=True, capture_output=True, text=True)
    return done.stdout


def touched(place: Path, addition: Addition) -> list[str]:
    """Files of the package that an addition needs, after its check has passed; the worktree is then as before."""
    for name, text in addition.new.items():
        (place / "hpcclear" / name).write_text(text, encoding="utf-8")
    for name, before, text in addition.put:
        path = place / "hpcclear" / name
        first, mark, rest = path.read_text(encoding="utf-8").partition(before)
        assert mark, (name, before)
        path.write_text(first + text + mark + rest, encoding="utf-8")
    subprocess.run(
        [sys.executable, "-c", f"import sys; sys.path.insert(0, {str(place)!r})\n{addition.check}"],
        cwd=place, check=True, env=None,
    )  # fmt: skip
    _git(place, "add", "--intent-to-add", "hpcclear")
    files = _git(place, "diff", "--name-only", "--", "hpcclear").split()
    _git(place, "reset", "--hard", "HEAD")
    return files


def main() -> None:
    """Make every addition, and write what each touched."""
    rows = []
    with worktree() as place:
        for thing, addition in ADDITIONS.items():
            files = touched(place, addition)
            rows.append((thing, len(files), addition.most, " ".join(files)))
            print(f"{thing:24s} {len(files)} of at most {addition.most}  {' '.join(files)}")
    with RESULT.open("w", encoding="utf-8", newline="") as file:
        writer = csv.writer(file, lineterminator="\n")
        writer.writerows([("thing", "files", "most", "names"), *rows])
    assert all(files <= most for _, files, most, _ in rows)


if __name__ == "__main__":
    main()
