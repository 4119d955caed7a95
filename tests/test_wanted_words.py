"""Words that people look for: the message says how it is done here, beside the nearest name."""

import re

import pytest
from running import scene_with

from hpcclear.base.errors import InputError
from hpcclear.scene import load_scene

LINKAGE = "jobs/linkages/four_stroke.toml"


@pytest.mark.parametrize(
    ("key", "words"),
    [
        ("mechanism.sense_of_rotation", "negative speed"),
        ("mechanism.gas-pressure", "bore = "),
        ("mechanism.cylinder", "effects.slider_load"),
        ("effects.gas_pressure", "ambient = "),
        ("drive.clockwise", "counter-clockwise"),
        ("drive.rpm", 'speed = "600 rpm"'),
        ("joints.crank_rod.journal_radius", "bearing_radius minus clearance"),
        ("joints.crank_rod.diametral", "diametral_clearance"),
        ("joints.crank_rod.bearing_diameter", "diametral_clearance"),
        ("joints.crank_rod.backlash", "radial clearance"),
        ("joints.crank_rod.tolerance", 'distribution = "fit"'),
    ],
)
def test_wanted_keys_get_a_sentence(key, words):
    with pytest.raises(InputError, match="is not a known key") as error:
        scene_with({key: 1})
    assert words in error.value.remedy
    assert re.search(r"Did you mean|Use one of", error.value.remedy)


@pytest.mark.parametrize(
    ("row", "words"),
    [
        ({"kind": "rotary spring", "body": "crank"}, "torsion-spring"),
        ({"kind": "gas force", "place": "crank.a"}, "bore = "),
        ({"kind": "damper"}, "stiffness = 0"),
    ],
)
def test_wanted_kinds_get_a_sentence(row, words):
    with pytest.raises(InputError, match="is not one of the known values") as error:
        load_scene(LINKAGE).with_({"mechanism.loads.wanted": row})
    assert words in error.value.remedy
    assert re.search(r"Did you mean|Use one of: cylinder, drag, force", error.value.remedy)
