"""Known mechanisms in every format: bodies, joints, lengths and speeds survive `import`; damaged files get one message."""

import math
from pathlib import Path

import import_files as files
import numpy as np
import pytest
from commands import run

from hpcclear.base.errors import InputError
from hpcclear.dynamics.planar.problem import poses_at_start
from hpcclear.scene import load_scene
from hpcclear.scene.importers import drawing_of, scene_of, summary, text_of

NIGHTLY = pytest.mark.nightly
STATED = dict.fromkeys(files.KINDS, "") | {"successor.csv": "mm"}


def imported(path, unit=""):
    """Everything that the command does with a file before it writes."""
    drawing = drawing_of(path, unit)
    content = scene_of(drawing, path.name)
    scene = load_scene(content)
    return (
        content,
        scene,
        dict(summary(content, drawing)),
        text_of(content, path.name, drawing.notes),
    )


@pytest.mark.parametrize(
    "seed", [*range(3), *(pytest.param(k, marks=NIGHTLY) for k in range(3, 40))]
)
@pytest.mark.parametrize("name", files.KINDS)
def test_a_known_mechanism_is_imported_whole(name, seed, tmp_path):
    random = np.random.default_rng(seed)
    made = files.machine(random)
    (tmp_path / name).write_bytes(files.KINDS[name](made, random))
    content, scene, said, text = imported(tmp_path / name, STATED[name])
    mechanism = content["mechanism"]
    kept = list(mechanism["bodies"].values())
    by_length = sorted(tuple(files.lengths(body["points"].values())) for body in kept)
    right = sorted(
        tuple(1e-3 * one for one in files.lengths([made.points[p] for p in own]))
        for own in made.bodies.values()
    )
    for found, wanted in zip(by_length, right, strict=True):
        np.testing.assert_allclose(found, wanted, atol=2e-9)
    pins = [
        sum(p in own for own in made.bodies.values()) + (p in made.ground) - 1 for p in made.points
    ]
    assert len(mechanism["joints"]) == sum(pins)
    assert len(mechanism["ground"]["points"]) == len(made.ground)
    speeds = sorted(float(row["speed"].split()[0]) for row in mechanism["drives"].values())
    if name.split(".")[-1] in ("linkage2", "pmks") or name == "successor.csv":
        np.testing.assert_allclose(speeds, sorted(made.speeds.values()), atol=1e-9)
        assert "placeholder" not in said["drives"]
    else:
        assert speeds == [60.0]
        assert "placeholder" in said["drives"]
    longest = max(
        max(files.lengths([made.points[p] for p in own]))
        for own in [*made.bodies.values(), made.ground]
    )
    assert f"at most {longest:.4g}"[:10] in said["length"]
    if len(made.speeds) == len(mechanism["drives"]) and "refuses" not in said["drives"]:
        assert poses_at_start(scene)  # it assembles where it is drawn
    assert load_scene(content) == scene
    assert all(f"# {note}." in text for label, note in said.items() if label == "note")


@pytest.mark.parametrize("kind", [*"YAMG0123"])
def test_each_row_of_a_link_of_pmks_is_one(kind, tmp_path):
    made = files.machine(np.random.default_rng(1), 1, 2)
    (tmp_path / "p.pmks").write_bytes(files.project(made, kinds=kind))
    assert len(files.linkage_of(tmp_path / "p.pmks")["mechanism"]["bodies"]) == len(made.bodies)
    other = files.project(made, kinds=kind).replace(f"{kind}R".encode(), b"ZR", 1)
    (tmp_path / "p.pmks").write_bytes(other)
    with pytest.raises(InputError, match="no kind of link that is known"):
        files.linkage_of(tmp_path / "p.pmks")


def _project(*rows):
    text = ".".join(["2P", "Ay,1E8", "K,0", "1011", *rows, "", "", "N_"])
    return (text + files.DIGITS[len(text) % 62]).encode()


def test_a_slider_of_pmks_may_be_one_joint(tmp_path):
    d = files.digits
    crank, pin = "6A,A,0,0,0", f"0B,B,0,{d(2000)},0"
    bars = ["", "YRAB,AB,Fe,Fe,0,0,c,A,B,,", "YRBC,BC,Fe,Fe,0,0,c,B,C,,"]
    for flags, slot, guide in ((5, "", "ground.C"), (13, "", "ground.C")):
        (tmp_path / "p").write_bytes(
            _project(crank, pin, f"{flags}C,C,{d(6000)},0,0{slot}".replace("13C", "DC"), *bars)
        )
        made = files.linkage_of(tmp_path / "p")["mechanism"]
        row = made["joints"]["C_guide"]
        assert (row["line"], row["angle"]) == (guide, "0.0 deg")
        # a welded one does not turn
        assert row["point"] == ("BC.C" if flags == 13 else "slider_C.C")
    (tmp_path / "p").write_bytes(_project(crank, pin, f"7C,C,{d(6000)},0,0,,,,{d(500)}", *bars))
    with pytest.raises(InputError, match="driven along a line"):
        files.linkage_of(tmp_path / "p")


SIZES = {
    1: 0.0254,
    2: 0.3048,
    4: 1e-3,
    5: 1e-2,
    6: 1.0,
    10: 0.9144,
    13: 1e-6,
    14: 0.1,
    21: 0.30480061,
}
"""Of the units of a drawing, in m, by $INSUNITS."""


def drawn_in(code: int, place: Path) -> Path:
    """A drawing with its unit of lengths by number."""
    data = files.drawing(files.machine(np.random.default_rng(2), 0, 1))
    place.write_bytes(data.replace(b"\n4\n", f"\n{code}\n".encode(), 1))
    return place


@pytest.mark.parametrize("code", SIZES)
def test_units_of_drawings(code, tmp_path):
    place, unit = drawn_in(code, tmp_path / "d.dxf"), "m" if code == 6 else "mm"
    stated, made = drawing_of(place), drawing_of(place, unit)
    ratio = SIZES[code] / (1 if code == 6 else 1e-3)
    far = max(one.x for one in stated.points)
    assert far == pytest.approx(ratio * max(one.x for one in made.points), rel=1e-6)
    assert any("--unit" in note for note in made.notes) == (code not in (4, 6))


@pytest.mark.parametrize("code", [0, 25])
def test_a_drawing_without_a_unit_is_refused(code, tmp_path):
    with pytest.raises(InputError, match="states no unit of lengths"):
        drawing_of(drawn_in(code, tmp_path / "d.dxf"))


@pytest.mark.parametrize("name", ["table.csv", "document.linkage2", "project.pmks"])
def test_a_unit_that_contradicts_the_file_is_refused(name, tmp_path):
    made = files.machine(np.random.default_rng(2), 0, 1)
    (tmp_path / name).write_bytes(files.KINDS[name](made))
    stated = "cm" if name == "project.pmks" else "mm"
    assert drawing_of(tmp_path / name, stated).points == drawing_of(tmp_path / name).points
    with pytest.raises(InputError, match="the file states"):
        drawing_of(tmp_path / name, "inch")


NAMES = ("rocker-arm", "1", "Träger", "ground ", "center", "a" * 80, "x y", "=1+1")


@pytest.mark.parametrize("name", ["layers.dxf", "document.linkage2", "successor.csv"])
def test_names_that_a_scene_cannot_have_are_replaced_and_listed(name, tmp_path):
    made = files.machine(np.random.default_rng(5), 2, 1)
    renamed = {
        old: NAMES[k % len(NAMES)] if name != "layers.dxf" or k != 3 else old
        for k, old in enumerate(made.bodies)
    }
    made = made._replace(
        bodies={renamed[old]: own for old, own in made.bodies.items()},
        speeds={renamed[old]: speed for old, speed in made.speeds.items()},
    )
    (tmp_path / name).write_bytes(files.KINDS[name](made))
    words = ["--unit", "mm"] if name == "successor.csv" else []
    code, output = run(
        ["init", "--import", str(tmp_path / name), str(tmp_path / "o.toml"), *words], 0
    )
    assert code == 0, output
    assert f"{len(made.bodies)} bodies" in output
    assert "'rocker-arm' is rocker_arm" in output
    code, output = run(["check", str(tmp_path / "o.toml"), "--no-cost"], 0)
    assert code == 0, output


def test_layers_of_one_name_are_one_body_and_heights_are_said(tmp_path):
    """Drawing programs do not tell layers apart by capital letters; a linkage has no height."""
    made = files.machine(np.random.default_rng(5), 2, 1)
    text = files.drawing(made).decode()
    plain, mixed, high = (tmp_path / f"{name}.dxf" for name in ("plain", "mixed", "high"))
    plain.write_text(text)
    parts = text.split("  8\n")
    mixed.write_text(
        "  8\n".join(
            one.replace(one.partition("\n")[0], one.partition("\n")[0].upper(), 1) if k % 2 else one
            for k, one in enumerate(parts)
        )
    )
    high.write_text(text.replace(" 20\n", " 30\n5.5\n 20\n", 1))
    assert mixed.read_text() != text
    expected = [(one[1:3], len(one.bodies)) for one in drawing_of(plain).points]
    assert [(one[1:3], len(one.bodies)) for one in drawing_of(mixed).points] == expected
    assert drawing_of(plain).notes == []
    assert "heights of 0 to 5.5 along z" in drawing_of(high).notes[0]


@pytest.mark.parametrize(
    ("speeds", "turns", "words"),
    [
        ((20.0, 40.0), None, "after 1 turns"),
        ((20.0, -30.0), 2, "after 2 turns"),
        ((57.0, 60.0), 19, "after 19 turns"),
        ((20.001, 30.0), None, "check refuses them"),
    ],
)
def test_drives_of_several_speeds_repeat_together_or_it_is_said(speeds, turns, words, tmp_path):
    made = files.machine(np.random.default_rng(7), 0, 2)
    made = made._replace(speeds=dict(zip(made.speeds, speeds, strict=True)))
    (tmp_path / "p.pmks").write_bytes(files.project(made))
    content, scene, said, _ = imported(tmp_path / "p.pmks")
    assert words in said["drives"]
    assert content["mechanism"]["drives"]["motor_crank0"].get("turns") == turns
    if "refuses" in words:
        with pytest.raises(InputError, match="does not repeat"):
            poses_at_start(scene)
    else:
        assert poses_at_start(scene)


def test_what_has_no_counterpart_is_said(tmp_path):
    made = files.machine(np.random.default_rng(6), 0, 1)
    table = (
        files.table(made)
        .replace(b";bodies", b";bodies;remark")
        .replace(b"crank0\n", b"crank0;bronze\n")
    )
    (tmp_path / "t.csv").write_bytes(
        table.replace(b"coupler0\n", b"coupler0;\n").replace(b"rocker0\n", b"rocker0;\n")
    )
    assert "remark" in imported(tmp_path / "t.csv")[2]["note"]
    drawn = files.drawing(made).replace(
        b"  0\nENDSEC\n  0\nEOF", b"  0\nSPLINE\n  8\nx\n  0\nMTEXT\n  8\nx\n  0\nENDSEC\n  0\nEOF"
    )
    (tmp_path / "d.dxf").write_bytes(drawn)
    assert "Not read: 1 SPLINE" in drawing_of(tmp_path / "d.dxf").notes
    assert "Left out: 1 MTEXT" in drawing_of(tmp_path / "d.dxf").notes
    document = files.document(made).replace(
        b"</linkage2>", b'<connector id="99" x="0" y="0"/><camera/></linkage2>'
    )
    (tmp_path / "l").write_bytes(document)
    assert any(
        "1 connectors without a link, 1 elements 'camera'" in note
        for note in drawing_of(tmp_path / "l").notes
    )
    fastened = files.document(made).replace(
        b'<connector id="2"', b'<connector fastenlink="0" id="2"', 1
    )
    (tmp_path / "l").write_bytes(fastened)
    with pytest.raises(InputError, match="fastened"):
        drawing_of(tmp_path / "l")


def _points(count, layer, place):
    points = (
        ((0, "POINT"), (8, layer(k)), (10, place(k)[0]), (20, place(k)[1])) for k in range(count)
    )
    return files.drawn([pair for one in points for pair in one]).encode()


def _lines(count):
    ends = ((10, 50), (20, 31), (11, 47), (21, 43))
    return files.drawn(
        [
            p
            for k in range(count)
            for p in ((0, "LINE"), (8, "ground"), *((code, k % base) for code, base in ends))
        ],
        4,
    ).encode()


def _chain(count):
    connectors = b"".join(b'<connector id="%d" x="%d" y="1"/>' % (k, k) for k in range(count))
    links = b"".join(
        b'<Link id="%d"><connector id="%d"/><connector id="%d"/></Link>' % (k, k, k + 1)
        for k in range(count - 1)
    )
    return b"<linkage2>" + connectors + links + b"</linkage2>"


def _welded(count):
    rows = ["--- j ---", "id", *(f"{k},a,{k},1,1,0,true,true,1,false" for k in range(count))]
    rows += ["--- l ---", "id", *(f"{k},x,1,c,0,0,{k}|{k + 1}," for k in range(count - 1))]
    rows += ["--- c ---", "id", *(f"{k},x,1,0,0,{k}|{k + 1}," for k in range(0, count - 9, 2))]
    return "\n".join(rows).encode()


DEEP = {
    "connectors.linkage2": _chain,
    "points.dxf": lambda n: _points(n, lambda k: "ground", lambda k: (90 * (k % 90), k // 90 * 90)),
    "layers.dxf": lambda n: _points(n, lambda k: f"l{k}" if k else "ground", lambda k: (k % 2, 0)),
    "lines.dxf": _lines,
    "points.csv": lambda n: (
        b"name;x [mm];y [mm];bodies\n"
        + b"".join(b"P%d;%d;1;ground a%d\n" % (k, k, k) for k in range(n))
    ),
    "welded.csv": _welded,
    "joints.pmks": lambda n: _project(
        *(f"4{k},{k},{files.digits(k)},0,0" for k in range(n)),
        "",
        *(f"YR{k}L,x,0,0,0,0,c,{k},{k + 1},," for k in range(n - 1)),
    ),
    "number.pmks": lambda n: _project(f"6A,A,{'z' * 100 * n},0,0", "", "YRA,A,0,0,0,0,c,A,A,,"),
    "number.dxf": lambda n: _points(1, lambda k: "ground", lambda k: ("9" * 100 * n, 0)),
}


@pytest.mark.timeout(120)  # what compares all pairs takes hours
@pytest.mark.parametrize("name", DEEP)
def test_files_that_are_too_large_are_refused_before_pairs_are_compared(name, tmp_path):
    (tmp_path / name).write_bytes(DEEP[name](20_000))
    with pytest.raises(InputError) as error:
        imported(tmp_path / name, "mm" if name == "welded.csv" else "")
    assert any(
        words in str(error.value)
        for words in ("has more", "is no finite number", "is no number of a project")
    )


@pytest.mark.parametrize("count", [60, pytest.param(10_000, marks=NIGHTLY)])
@pytest.mark.parametrize("name", files.KINDS)
def test_damaged_files_get_one_message_or_are_imported(name, count, tmp_path):
    random = np.random.default_rng(count)
    done = 0
    for _ in range(count):
        data = files.mutated(files.KINDS[name](files.machine(random), random), random)
        if name == "project.pmks" and random.integers(4):
            data = files.signed(data)
        (tmp_path / name).write_bytes(data)
        try:
            content, *_ = imported(tmp_path / name, STATED[name])
        except InputError:
            continue
        done += 1
        places = [
            p for body in content["mechanism"]["bodies"].values() for p in body["points"].values()
        ]
        assert all(math.isfinite(one) for place in places for one in place)
    assert 0 < done < count
