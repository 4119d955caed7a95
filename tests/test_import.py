"""A linkage from a table of its points: every point where the file has it, and what makes none is refused."""

import numpy as np
import pytest
from import_files import linkage_of

from hpcclear.base.errors import InputError
from hpcclear.dynamics.planar.problem import poses_at_start
from hpcclear.report.figures.placed import Placed
from hpcclear.scene import load_scene
from hpcclear.scene.importers import text_of

FOUR_BAR = """name;x [mm];y [mm];bodies
A0;0;0;ground crank
A;15,5;26,85;crank coupler
B;120,5;60;coupler rocker
B0;100;0;ground rocker
K;70;80;coupler
"""
SLIDER = """point,x [mm],y [mm],links,slide [deg]
O,0,10,frame/crank,
A,0,60,crank+rod,
P,109.08712,10,rod piston,0
"""
CHAIN = "name\tx [cm]\ty [cm]\nA0\t0\t0\nA\t1.5\t2.5\nB\t12\t6\nB0\t10\t0\n"


def placed(scene):
    return Placed(scene.mechanism, poses_at_start(scene))


def made(tmp_path, text, name="points.csv"):
    path = tmp_path / name
    path.write_text(text, encoding="utf-8")
    return linkage_of(path)


@pytest.mark.parametrize("text", [FOUR_BAR, SLIDER, SLIDER.replace("rod piston", "rod"), CHAIN])
def test_points_are_where_the_file_has_them(text, tmp_path):
    content = made(tmp_path, text)
    scene = load_scene(content)
    (tmp_path / "made.toml").write_text(text_of(content, "points.csv"))
    assert load_scene(tmp_path / "made.toml") == scene
    where = placed(scene)
    unit = 1e-2 if "[cm]" in text else 1e-3
    for line in text.splitlines()[1:]:
        name, x, y, *_ = (
            line.replace(",", "." if ";" in line else ";").replace("\t", ";").split(";")
        )
        for body, points in where.bodies.items():
            if name in points:
                np.testing.assert_allclose(
                    points[name], [unit * float(x), unit * float(y)], atol=2e-8, err_msg=body
                )
    assert scene.clearance_joints() == ()


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("name,x [mm]\nA,1\nB,2\n", "has no column y"),
        ("name,x,y\nA,1,2\nB,2,3\n", "nothing says its unit"),
        ("name,x [kg],y [mm]\nA,1,2\nB,2,3\n", "does not fit"),
        ("name,x [mm],y [mm]\nA,1,2\nB,2,3\nC,3,4\n", "at least 4 points"),
        (FOUR_BAR.replace("A;15", "A0;15"), "a point of this name stands above"),
        (FOUR_BAR.replace("A;15", " ;15"), "the point has no name"),
        (FOUR_BAR.replace("bodies", "Koerper"), "is no column of a table of points"),
        (FOUR_BAR.replace(";bodies", ";bodies;z"), "is no column of a table of points"),
        (
            FOUR_BAR.replace(";bodies", ";bodies;links").replace("crank\n", "crank;a\n"),
            "which is the same",
        ),
        (FOUR_BAR.replace("ground ", ""), "no body is pinned to the ground"),
        (FOUR_BAR.replace("coupler rocker", ""), "belongs to no body"),
        (FOUR_BAR.replace("15,5;26,85", "0;0"), "at one place"),
        (
            "name,x [mm],y [mm],bodies\nA,0,0,ground crank\nB,1,many,crank rod\n",
            "is not a finite decimal number",
        ),
    ],
)
def test_tables_that_make_no_linkage(text, words, tmp_path):
    with pytest.raises(InputError) as error:
        made(tmp_path, text)
    assert words in str(error.value)


@pytest.mark.parametrize("body", ["crank", "coupler", "rocker", "ground"])
@pytest.mark.parametrize("sign", " -/+")
def test_a_name_of_two_words_is_no_pair_of_bodies(body, sign, tmp_path):
    """Signs between bodies may stand within a name: "rocker-arm" at each of its points would be two bodies in one place."""
    with pytest.raises(InputError, match="neither moves against the other"):
        made(tmp_path, FOUR_BAR.replace(body, f"{body}{sign}arm"))
