"""Linkages from files of other programs: every point where the file has it, driven as there, or refused with the cause.

The files are made here, in the formats that the programs write.
"""

import math
import xml.etree.ElementTree as ET

import numpy as np
import pytest
from import_files import DIGITS, digits, drawn, linkage_of

from hpcclear.base.errors import InputError
from hpcclear.dynamics.planar.problem import poses_at_start
from hpcclear.report.figures.placed import Placed
from hpcclear.scene import load_scene
from hpcclear.scene.importers import drawing_of

FOUR_BAR = {"A": (-12.25, -3.0), "B": (-9.5, 4.75), "C": (11.0, 9.125), "D": (13.5, -6.25)}
SIZE = 25.4e-3 / 96
SHOWN = 24.5e-3 / 96
"""m of a unit of the program Linkage, of which it shows millimetres."""


def joint(name, place, flags=0, angle=0.0, slot=()):
    numbers = [digits(round(1000 * value)) for value in (*place, angle)]
    return ",".join([DIGITS[flags] + name, name, *numbers, *slot])


def link(kind, name, joints, title=""):
    numbers = ["Fe", "Fe", "0", "0"]
    return ",".join([f"Y{kind}{name}", title or name, *numbers, "c5cae9", *joints, "", ""])


def project(joints, links, forces=(), flags="2P", units="1011"):
    """A project of PMKS+."""
    rows = [*joints, "", *links, "", *forces, "", "N_"]
    text = ".".join([flags, "Ay,1E8", "K,0", units, *rows])
    return text + DIGITS[len(text) % 62]


def four_bar(**options):
    places = FOUR_BAR
    joints = [
        joint("A", places["A"], 6),
        joint("B", places["B"]),
        joint("C", places["C"]),
        joint("D", places["D"], 4),
    ]
    links = [link("R", "AB", "AB", "Motor crank"), link("R", "BC", "BC"), link("R", "CD", "CD")]
    return project(joints, links, **options)


def whitworth():
    """A block on the crank pin in the slot of a lever, and a yoke welded to its block."""
    joints = [
        joint("A", (0, 0), 6), joint("B", (0, 3)), joint("C", (1, 0), 4), joint("D", (-0.6, 4.8)),
        joint("P", (0, 3), 1, 0.0, ("CD", "C", "D")), joint("E", (2, -1), 8), joint("F", (2, 0.5)),
        joint("Q", (2, -1), 5, math.pi / 2),
        joint("R", (0, 3), 1, 0.0, ("EF", "E", "F")),
    ]  # fmt: skip
    return joints, [link("R", "AB", "AB"), link("R", "CD", "CD"), link("P", "BP", "BP")]


def document(connectors, links, units="Millimeters", extra=""):
    """A document of Linkage: connectors as (id, x, y, attributes, limits), links as lists of ids or (ids, attributes)."""
    root = ET.Element("linkage2")
    ET.SubElement(
        root, "program", zoom="1", xoffset="10", yoffset="20", scalefactor="1", units=units
    )
    for key, x, y, attributes, *limits in connectors:
        row = ET.SubElement(
            root, "connector", id=str(key), x=str(x), y=str(y), layer="16", **attributes
        )
        for limit in limits:
            ET.SubElement(row, "slidelimit", id=str(limit))
    for key, own in enumerate(links):
        ids, attributes = own if isinstance(own, tuple) else (own, {})
        row = ET.SubElement(root, "Link", id=str(key), **attributes)
        for one in ids:
            ET.SubElement(row, "connector", id=str(one))
    return ET.tostring(root, encoding="unicode").replace("</linkage2>", extra + "</linkage2>")


ANCHOR = {"anchor": "true"}
INPUT = {"anchor": "true", "input": "true", "rpm": "30.000000"}
SLIDER = {"slider": "true"}
LINKAGE = [
    (0, 200, -100, INPUT),
    (1, 200, -65, {"name": "crank pin"}),
    (2, 300, -100, {}),
    (3, 300, -300, ANCHOR),
]
BARS = [[0, 1], [1, 2], [2, 3]]
SLOT = [
    (0, -71, -362, INPUT), (1, -90, -346, {}), (2, -8, -275, ANCHOR), (3, 206, -342, {}), (4, 251, -275, ANCHOR),
    (5, 116.196429, -313.883929, SLIDER, 2, 3), (6, -60, -260, {}),
]  # fmt: skip
SLOT_BARS = [[0, 1], [2, 3, 6], [4, 5], [1, 6]]
RAM = [
    (0, 238, -237, {}), (1, 340, -192, {}), (2, 430, -237, {}), (3, 298, -237, ANCHOR | SLIDER, 0, 2),
    (4, 374.5, -237, ANCHOR | SLIDER, 0, 2), (5, 534, -187, INPUT), (6, 534, -150, {}),
]  # fmt: skip
RAM_BARS = [[0, 1, 2], [3], [4], [5, 6], [1, 6]]


def dxf(entities, unit=4, end="\n"):
    """A drawing: entities as (kind, layer, pairs of code and value)."""
    pairs = [pair for kind, layer, own in entities for pair in ((0, kind), (8, layer), *own)]
    return drawn(pairs, unit, end)


def at(*places):
    """Pairs of places: 10, 20 for the first, 11, 21 for the second."""
    return [
        (10 * (axis + 1) + k, v) for k, place in enumerate(places) for axis, v in enumerate(place)
    ]


def along(*places, closed=0):
    return [(90, len(places)), (70, closed), *(pair for place in places for pair in at(place))]


P = {"A0": (0, 0), "A": (15, 26), "B": (120, 60), "B0": (100, 0), "K": (70, 80)}
LAYERS = [
    ("POINT", "Ground", at(P["A0"])), ("CIRCLE", "GROUND", [*at(P["B0"]), (40, 3.0)]), ("LINE", "crank", at(P["A0"], P["A"])),
    ("LWPOLYLINE", "coupler", along(P["A"], P["B"], P["K"], closed=1)), ("LINE", "rocker arm", at(P["B"], P["B0"])),
    ("TEXT", "notes", [*at((0, 0)), (1, "crank")]), ("ARC", "crank", [*at((0, 0)), (40, 2.0)]),
]  # fmt: skip
OLD = [
    *LAYERS[:3], ("POLYLINE", "coupler", [(66, 1), *at((0, 0)), (70, 1)]),
    *(("VERTEX", "coupler", at(P[name])) for name in "ABK"), ("SEQEND", "coupler", []), LAYERS[4],
]  # fmt: skip
DRAWN = [("LINE", "0", at(P[a], P[b])) for a, b in (("A0", "A"), ("A", "B"), ("B", "B0"))]
PINS = [("POINT", "0", at(P[name])) for name in ("A0", "B0")]
GUIDED = [
    ("CIRCLE", "ground", at((0, 10))), ("LINE", "ground", at((60, 10), (180, 10))), ("LINE", "crank", at((0, 10), (0, 60))),
    ("LINE", "rod", at((0, 60), (109.0871211, 10))), ("POINT", "piston", at((109.0871211, 10))),
]  # fmt: skip


def written(tmp_path, text, name="source"):
    path = tmp_path / name
    path.write_text(text, encoding="utf-8", newline="")
    return path


def check(path, expected, unit=""):
    """Every body has the points of the file where they are; returns the scene's tables."""
    drawing, content = drawing_of(path, unit), linkage_of(path, unit)
    scene = load_scene(content)
    where = Placed(scene.mechanism, poses_at_start(scene))
    places = {one.name: (one.x, one.y) for one in drawing.points}
    np.testing.assert_allclose(sorted(places.values()), sorted(expected), atol=1e-11)
    for one in drawing.points:
        for body in one.bodies:
            if body in where.bodies:
                np.testing.assert_allclose(
                    where.bodies[body][one.name], places[one.name], atol=2e-8
                )
    return content["mechanism"]


@pytest.mark.parametrize("before", ["", "https://app.pmksplus.com/?"])
@pytest.mark.parametrize(("flags", "turned"), [("2P", -20), ("3u", 20)])
def test_a_project_of_pmks(before, flags, turned, tmp_path):
    text = before + four_bar(flags=flags).replace(" ", "%20" if before else " ")
    made = check(written(tmp_path, text), [(x / 100, y / 100) for x, y in FOUR_BAR.values()])
    assert list(made["bodies"]) == ["Motor_crank", "BC", "CD"]
    assert made["drives"]["motor"] == {
        "kind": "constant-speed", "body": "Motor_crank", "speed": f"{turned} rpm",
    }  # fmt: skip
    assert list(made["joints"]) == ["A", "B", "C", "D"]


@pytest.mark.parametrize(
    ("units", "size"), [("0011", 0.0254), ("1011", 0.01), ("2112", 1.0), ("101", 0.01)]
)
def test_units_of_a_project(units, size, tmp_path):
    check(
        written(tmp_path, four_bar(units=units)),
        [(x * size, y * size) for x, y in FOUR_BAR.values()],
    )


def test_sliders_of_pmks(tmp_path):
    joints, links = whitworth()
    made = check(
        written(tmp_path, project(joints[:5], links)),
        [(0, 0), (0, 0.03), (0.01, 0), (-0.006, 0.048)],
    )
    assert made["joints"]["B_guide"] == {
        "kind": "slide", "point": "slider_B.B", "line": "CD.B", "angle": "0.0 deg",
    }  # fmt: skip
    # a yoke on the crank pin, welded to a block that slides up and down on the ground
    yoke = [
        link("R", "AB", "AB"),
        link("R", "EF", "EF"),
        link("P", "BR", "BR"),
        link("P", "EQ", "EQ"),
    ]
    joints[1] = joint("B", (2, 0.2))
    joints[-1] = joint("R", (2, 0.2), 1, 0.0, ("EF", "E", "F"))
    own = [one for one in joints if one.split(",")[1] in "ABEFQR"]
    made = check(
        written(tmp_path, project(own, yoke)), [(0, 0), (0.02, 0.002), (0.02, -0.01), (0.02, 0.005)]
    )
    assert made["joints"]["E_guide"]["point"] == "EF.E"
    assert made["joints"]["E_guide"]["angle"].startswith("90.0")


@pytest.mark.parametrize(("units", "size"), [("Millimeters", SHOWN), ("Inches", SIZE)])
def test_a_document_of_linkage(units, size, tmp_path):
    made = check(
        written(tmp_path, document(LINKAGE, BARS, units)),
        [(size * x, size * y) for _, x, y, _ in LINKAGE],
    )
    assert made["drives"]["motor"]["speed"] == "-30 rpm"
    assert list(made["joints"]) == ["P0", "crank_pin", "P2", "P3"]


@pytest.mark.parametrize(
    ("connectors", "links", "guides"),
    [
        (SLOT, SLOT_BARS, {"P5_guide": "link1.P5"}),
        (RAM, RAM_BARS, {"P3_guide": "link0.P3", "P4_guide": "link0.P4"}),
        (
            [(0, 71, -72, INPUT), (1, 72, -48.5, SLIDER, 4, 5), (4, -59, -71, ANCHOR), (5, 203, -26, {})],
            [[0, 1], [4, 5]], {"P1_guide": "link1.P1"},
        ),
        (
            [(0, 0, 0, INPUT), (1, 0, 50, {}), (2, 120, 0, SLIDER, 3, 4), (3, 60, 0, ANCHOR), (4, 180, 0, ANCHOR)],
            [[0, 1], [1, 2], [3, 4]], {"P2_guide": "ground.P2"},
        ),
    ],
)  # fmt: skip
def test_sliders_of_linkage(connectors, links, guides, tmp_path):
    path = written(tmp_path, document(connectors, links))
    places = {one.name: (one.x, one.y) for one in drawing_of(path).points}
    made = check(path, places.values())
    assert {
        name: row["line"] for name, row in made["joints"].items() if row["kind"] == "slide"
    } == guides
    for key, x, y, *_ in connectors:
        if f"P{key}" in places:
            np.testing.assert_allclose(places[f"P{key}"], (SHOWN * x, SHOWN * y), atol=1e-11)


@pytest.mark.parametrize("end", ["\n", "\r\n"])
@pytest.mark.parametrize(
    ("entities", "names"), [(LAYERS, "AKB"), (OLD, "AKB"), (DRAWN + PINS, "AB")]
)
def test_a_drawing(entities, names, end, tmp_path):
    where = [P[name] for name in ("A0", "B0", *names)]
    made = check(
        written(tmp_path, dxf(entities, end=end)), [(x / 1000, y / 1000) for x, y in where]
    )
    assert len(made["joints"]) == 4
    if entities is LAYERS:
        assert set(made["bodies"]) == {"crank", "coupler", "rocker_arm"}
    check(written(tmp_path, dxf(entities, unit=1)), [(x * 0.0254, y * 0.0254) for x, y in where])


def test_a_point_on_a_line_of_the_ground_slides(tmp_path):
    made = check(written(tmp_path, dxf(GUIDED)), [(0, 0.01), (0, 0.06), (0.1090871211, 0.01)])
    guide = next(row for row in made["joints"].values() if row["kind"] == "slide")
    assert guide["point"].startswith("piston.")
    assert guide["line"].startswith("ground.")


def _changed(rows, number, **changes):
    made = list(rows)
    made[number] = (*made[number][:3], made[number][3] | changes, *made[number][4:])
    return made


CYLINDER = project(
    [
        joint("A", (0, 0), 4),
        joint("B", (0, 3)),
        joint("C", (1, 0), 4),
        joint("S", (0, 3), 3, 0.0, ("AB", "A", "B")),
    ],
    [link("R", "AB", "AB"), link("R", "BC", "BC"), link("P", "BS", "BS")],
)
REFUSED = [
    (four_bar()[:-9], "is no complete project"),
    (four_bar().replace("1011", "3011"), "states no unit of lengths"),
    (four_bar().replace("6A", "4A").replace("0B", "2B", 1), "the input is not on the ground"),
    ("https://app.pmksplus.com/?data=N4IgVi", "is a compressed link"),
    (CYLINDER, "is driven along a line"),
    (project([joint("A", (0, 0), 6)], [link("R", "AB", "AB")]), "is a joint of a link, but not in the file"),
    (document(LINKAGE, [*BARS[:2], ([2, 3], {"actuator": "true"})]), "the document has an actuator"),
    (document(LINKAGE, [*BARS[:2], ([2, 3], {"gear": "true"})]), "the document has a gear"),
    (document(LINKAGE, BARS, extra="<ratios><ratio/></ratios>"), "the document has a gear"),
    (document(_changed(SLOT, 5, slideradius="40"), SLOT_BARS), "slides along an arc"),
    (document(SLOT, [SLOT_BARS[0], [2, 6], *SLOT_BARS[2:]]), "belong to no body together"),
    (document(_changed(LINKAGE, 1, input="true"), BARS), "turns no link about an anchor"),
    (document(LINKAGE, BARS, "Furlongs"), "is no unit of this program"),
    (document(LINKAGE, BARS).replace("linkage2", "linkage"), "an old version"),
    (document(LINKAGE, BARS)[:-20], "is no XML that can be read"),
    ('<linkage2><!ENTITY a "b"></linkage2>', "has a declaration"),
    (dxf(LAYERS, unit=0), "states no unit of lengths"),
    (dxf(DRAWN), "nothing says what stands still"),
    (dxf(PINS[:0]), "nothing says what stands still"),
    (dxf([*LAYERS, ("INSERT", "0", [(2, "BOLT"), *at((0, 0))])]), "the drawing has a block"),
    (dxf([*LAYERS, ("CIRCLE", "crank", [*at((0, 0)), (230, "-1.0")])]), "is seen from behind"),
    (dxf([*DRAWN[:2], ("LINE", "0", at((120.01, 60), P["B0"])), *PINS]), "neither one pin nor two points"),
    (dxf([*LAYERS[:4], ("LINE", "rocker", at((67.5, 43), P["B0"]))]), "may be a pin or in a slot"),
    (dxf(LAYERS).replace(" 10\n", "ten\n", 1), "is no group code"),
    (dxf([("LINE", "ground", [(10, "x"), (20, 0)])]), "a place of LINE is no finite number"),
]  # fmt: skip


@pytest.mark.parametrize(("text", "words"), REFUSED)
def test_what_no_scene_can_have_is_refused(text, words, tmp_path):
    with pytest.raises(InputError) as error:
        linkage_of(written(tmp_path, text))
    assert words in str(error.value)


def test_binary_drawings_and_odd_bytes_are_refused(tmp_path):
    (tmp_path / "b.dxf").write_bytes(b"AutoCAD Binary DXF\r\n\x1a\x00" + bytes(50))
    with pytest.raises(InputError, match="binary DXF"):
        drawing_of(tmp_path / "b.dxf")
    with pytest.raises(InputError, match="--unit"):
        drawing_of(written(tmp_path, dxf(LAYERS, unit=0)), "kg")
    with pytest.raises(InputError, match="no such regular file"):
        drawing_of(tmp_path / "none.dxf")
