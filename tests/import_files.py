"""Files of linkages in every format that `hpcclear import` reads, made of one mechanism that is known.

`machine` draws a mechanism at random, `KINDS` writes it in each format; `mutated` damages a file.
"""

import io
import math
import xml.etree.ElementTree as ET
from typing import NamedTuple

import numpy as np

from hpcclear.scene.importers import drawing_of, scene_of

DIGITS = "0123456789ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz_-"
SHOWN = 24.5 / 96
"""mm of a unit of the program Linkage."""


def linkage_of(path, unit=""):
    """The tables of a scene whose linkage has its points where a file has them."""
    return scene_of(drawing_of(path, unit), str(path))


class Machine(NamedTuple):
    """A mechanism."""

    points: dict[str, tuple[float, float]]
    """Places in mm, by name."""
    bodies: dict[str, list[str]]
    """Points of each body."""
    ground: list[str]
    speeds: dict[str, float]
    """rpm by body."""


def machine(random, dyads=None, machines=None):
    """One or two four-bars with a point on the coupler, and dyads between it and new pins of the ground."""
    points, bodies, ground, speeds = {}, {}, [], {}
    letters = iter("ABCDEFGHIJKLMNOPQRSTUVWXYZ")
    for number in range(machines or random.integers(1, 3)):
        a, b, c, d, k = (next(letters) for _ in range(5))
        base = 400.0 * number
        for name, x, y in ((a, 0, 0), (b, 15, 25), (c, 120, 60), (d, 100, 0), (k, 70, 90)):
            moved = random.uniform(-4, 4, 2).tolist()
            points[name] = (round(base + x + moved[0], 2), round(y + moved[1], 2))
        ground += [a, d]
        bodies |= {
            f"crank{number}": [a, b],
            f"coupler{number}": [b, c, k],
            f"rocker{number}": [c, d],
        }
        speeds[f"crank{number}"] = float(random.integers(1, 90) * random.choice([-1, 1]))
        for more in range(random.integers(0, 2) if dyads is None else dyads):
            e, f = next(letters), next(letters)
            points[e] = (round(base + 150.0 + 20 * more + float(random.uniform(-4, 4)), 2), 140.0)
            points[f] = (round(base + 220.0 + 20 * more + float(random.uniform(-4, 4)), 2), 20.0)
            ground.append(f)
            bodies |= {f"link{number}{more}": [k, e], f"arm{number}{more}": [e, f]}
    return Machine(points, bodies, ground, speeds)


def _of(made, point):
    return [name for name, own in made.bodies.items() if point in own]


def table(made, random=None):
    rows = [("name", "x [mm]", "y [mm]", "bodies")]
    for name, (x, y) in made.points.items():
        owners = ["ground"] * (name in made.ground) + _of(made, name)
        rows.append((name, repr(x), repr(y), " ".join(owners)))
    return ("\n".join(";".join(row) for row in rows) + "\n").encode()


def workbook(made, random=None):
    from openpyxl import Workbook

    book = Workbook()
    for line in table(made).decode().splitlines():
        name, *places, bodies = line.split(";")
        book.active.append(
            [name, *(float(p) if p[:1] in "-0123456789" else p for p in places), bodies]
        )
    stream = io.BytesIO()
    book.save(stream)
    return stream.getvalue()


def drawn(pairs, unit=4, end="\n"):
    """A drawing by its pairs of code and value."""
    head = [(0, "SECTION"), (2, "HEADER"), (9, "$INSUNITS"), (70, unit), (0, "ENDSEC")]
    head += [(0, "SECTION"), (2, "ENTITIES")]
    every = [*head, *pairs, (0, "ENDSEC"), (0, "EOF")]
    return "".join(f"{code:3d}{end}{value}{end}" for code, value in every)


def drawing(made, random=None):
    """Layers: each body a polyline, pins of the ground as points."""
    pairs = []
    for name in made.ground:
        x, y = made.points[name]
        pairs += [(0, "POINT"), (8, "Ground"), (10, x), (20, y)]
    for body, own in made.bodies.items():
        pairs += [(0, "LWPOLYLINE"), (8, body), (90, len(own)), (70, int(len(own) > 2))]
        pairs += [pair for p in own for pair in zip((10, 20), made.points[p], strict=True)]
    return drawn(pairs).encode()


def sketch(made, random=None):
    """No layers: a polyline a body."""
    return drawing(made).replace(b"\nGround\n", b"\n0\n")


def document(made, random=None):
    """Of Linkage, which turns clockwise with a positive speed."""
    root = ET.Element("linkage2")
    ET.SubElement(root, "program", units="Millimeters")
    ids = {name: str(k) for k, name in enumerate(made.points)}
    for name, (x, y) in made.points.items():
        row = {
            "id": ids[name],
            "name": name,
            "x": repr(x / SHOWN),
            "y": repr(y / SHOWN),
            "layer": "16",
        }
        if name in made.ground:
            row["anchor"] = "true"
        driven = [speed for body, speed in made.speeds.items() if made.bodies[body][0] == name]
        if driven:
            row |= {"input": "true", "rpm": repr(-driven[0])}
        ET.SubElement(root, "connector", row)
    for k, (body, own) in enumerate(made.bodies.items()):
        link = ET.SubElement(root, "Link", id=str(k), name=body)
        for name in own:
            ET.SubElement(link, "connector", id=ids[name])
    return ET.tostring(root)


def digits(value):
    """An integer to the base 64, with a 0 in front of a negative one."""
    made, left = "", abs(value)
    while left or not made:
        made, left = DIGITS[left % 64] + made, left // 64
    return ("0" if value < 0 else "") + made


def project(made, random=None, kinds="YAMG0123"):
    """Of PMKS+, in cm: speeds of each input, links of any kind; some links are welded of two."""
    random = random or np.random.default_rng(1)
    rows = []
    for name, (x, y) in made.points.items():
        driven = [speed for body, speed in made.speeds.items() if made.bodies[body][0] == name]
        flags = 4 * (name in made.ground) + 2 * bool(driven) + 16 * int(random.integers(2))
        row = [DIGITS[flags] + name, name, *(digits(round(100 * p)) for p in (x, y)), "0"]
        rows.append(
            ",".join([*row, *(["", "", "", digits(round(1000 * driven[0]))] if driven else [])])
        )
    rows.append("")
    for body, own in made.bodies.items():
        kind = str(random.choice(list(kinds)))
        tail = ["Fe", "Fe", "0", "0", "c5cae9", *own, ""]
        rows.append(",".join([f"{kind}R{''.join(own)}", body, *tail, f"{''.join(own)}w"]))
        member = "N" if kind in "YAMG" else "5"
        rows.append(",".join([f"{member}R{''.join(own)}w", f"{body}w", *tail, ""]))
    text = ".".join(["2P", "Ay,1E8", "K,0", "1011", *rows, "", "", "N_"])
    return (text + DIGITS[len(text) % 62]).encode()


def successor(made, random=None):
    """The table of the successor of PMKS+, which states no unit."""
    ids = {name: k for k, name in enumerate(made.points)}
    rows = ["--- j ---", "Joint ID,..."]
    for name, (x, y) in made.points.items():
        driven = [speed for body, speed in made.speeds.items() if made.bodies[body][0] == name]
        words = [str(one).lower() for one in (name in made.ground, bool(driven))]
        rows.append(
            f'{ids[name]},"{name}",{x},{y},1,0,{",".join(words)},{driven[0] if driven else 0},false,false'
        )
    rows += ["", "--- l ---", "Link ID,..."]
    for k, (body, own) in enumerate(made.bodies.items()):
        rows.append(f"{k},{body},1,#aaa,0,0,{'|'.join(str(ids[p]) for p in own)},,false,1,0")
    return ("\n".join([*rows, "", "--- c ---", "ID", ""])).encode()


KINDS = {
    "table.csv": table, "book.xlsx": workbook, "layers.dxf": drawing, "sketch.dxf": sketch, "document.linkage2": document,
    "project.pmks": project, "successor.csv": successor,
}  # fmt: skip

EVIL = (
    b"",
    b"nan",
    b"inf",
    b"-1e300",
    b"1e-300",
    b"abc",
    b"9" * 400,
    b"0",
    b"-1",
    b"\xff\xfe",
    b"=1+1",
    b"\x00",
    b"true",
    b"center",
    b"ground",
)


def mutated(data, random):
    """A file with one to four damages: bytes, numbers, words, rows."""
    for _ in range(random.integers(1, 5)):
        size = max(len(data), 1)
        kind, place = random.integers(7), int(random.integers(size))
        if kind == 0:
            data = data[:place] + bytes([random.integers(256)]) + data[place + 1 :]
        elif kind == 1:
            data = data[:place] + data[place + int(random.integers(1, 30)) :]
        elif kind == 2:
            data = data[:place] + EVIL[random.integers(len(EVIL))] + data[place:]
        else:
            signs = b"\n" if kind == 3 else b"\n,;. \"'<>|=&"
            cuts = [k for k, one in enumerate(data) if one in signs]
            if len(cuts) < 3:
                continue
            first = int(random.integers(len(cuts) - 1))
            begin, end = cuts[first] + 1, cuts[first + 1]
            word = data[begin:end]
            if kind == 4:
                word = EVIL[random.integers(len(EVIL))]
            elif kind == 5:
                other = int(random.integers(len(cuts) - 1))
                word = data[cuts[other] + 1 : cuts[other + 1]]
            elif kind == 6 or random.integers(2):
                word = word + data[begin - 1 : begin] + word
            else:
                begin, word = max(begin - 1, 0), b""
            data = data[:begin] + word + data[end:]
    return data


def signed(data):
    """A damaged project with the last character that its new length takes, so that what is behind it is read."""
    text = data[:-1]
    return text + DIGITS[len(text) % 62].encode()


def lengths(points):
    """Distances between all points of a body, m, sorted."""
    places = list(points)
    return sorted(math.dist(a, b) for k, a in enumerate(places) for b in places[:k])
