"""Words that people look for and that stand for something of another name here: one sentence each says how it is done."""

import re

HERE = {
    ("torsionspring", "torsionalspring", "rotaryspring", "rotationalspring"):
        'A torsion spring is a load of kind "torsion-spring", with a body, stiffness and angle.',
    ("offset", "eccentricslider"):
        'Write offset in [mechanism] of a slider-crank; in a linkage the guide has line = "ground.NAME".',
    ("diametral", "diametric", "bearingdiameter", "journaldiameter", "borediameter", "pindiameter"):
        "Write diametral_clearance for the difference of both diameters, or half of it as clearance; halve the bore, too.",
    ("journalradius", "pinradius", "shaftradius"):
        "The radius of the journal is bearing_radius minus clearance: give these two.",
    ("tolerance", "capability"):
        'Tolerances of bore and pin are a random input, distribution = "fit"; those of the integrator numerics.rtol, atol.',
    ("gaspressure", "gasforce", "cylinder", "piston", "pressure", "indicated"):
        'A gas force is effects.slider_load, or the size of a force: { file = "p.csv", bore = "42 mm", ambient = "1 bar" }.',
    ("clockwise", "reverse", "rotationdirection", "senseofrotation"):
        "Angles and speeds count counter-clockwise: a drive turns clockwise with a negative speed.",
    ("backlash", "play", "slop", "looseness", "gap"):
        'The play of a joint is its radial clearance: kind = "clearance", clearance = "0.1 mm".',
    ("stroke",): "The stroke of a slider-crank is twice crank.length.",
    ("rpm", "revolutionsperminute"): 'Write the speed with its unit: speed = "600 rpm".',
    ("damper", "dashpot"): 'A damper is a load of kind "spring" with stiffness = 0 and a damping.',
    ("motor",): 'A motor is a drive of kind "torque", whose torque falls to 0 at no_load_speed.',
    ("flywheel",): 'A flywheel is flywheel_inertia of a drive of kind "torque".',
    ("camprofile", "cam"): 'The motion that a cam gives is a drive of kind "table".',
    ("gear",): "There are no gears: two drives of given speeds turn two bodies.",
    ("lubric", "oil"): "Oil is the table film of a joint with clearance.",
    ("weight",): "Write mass, in kg.",
    ("elasticmodulus", "emodulus", "modulus"):
        "Write bearing and journal = { youngs_modulus = ..., poisson_ratio = ... } of a joint.",
}  # fmt: skip
"""By what a word contains, without signs and in small letters."""


def hint(word: object) -> str:
    """A sentence that says how it is done here, and a space behind it; "" for a word that is not known."""
    plain = re.sub(r"[^a-z]", "", str(word).lower())
    for words, sentence in HERE.items():
        if any(one in plain if len(one) > 4 else one == plain for one in words):
            return f"{sentence} "
    return ""
