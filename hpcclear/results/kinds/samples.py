"""Designs and the outcomes of their simulations."""

from hpcclear.results.rows import ResultKind, count, number, outcome, text

KIND = ResultKind(
    20, "Samples of a mechanism with clearance joints", ("sample",),
    design_dims=("sample",), whole=True, optional=("wave", "band"), absent="no design was sampled (`hpcclear sample` or `run`)",
    table={
        "sample": count("sample", "number of the sample in the design"),
        "label": text("sample", "name of the design in the table that it comes from"),
        "joint": text("joint", "joint with clearance, O12 and O23"),
        "wave": count("wave", "number of a wave around a surface, by joint: cosine and sine of each order"),
        "band": number("band", "Hz", "middle of the third-octave band"),
        **outcome("sample"),
    },
)
