"""Unknowns of a machine from measured signals."""

from hpcclear.results.rows import ResultKind, count, flag, number, text

KIND = ResultKind(
    160, "Unknowns of a machine from measured signals", ("unknown",),
    optional=("record", "particle", "feature", "candidate", "revolutions"), alone=True,
    table={
        "unknown": text("unknown", "entry of the scene that is identified"),
        "input": text("input", "unknowns, then random inputs of the scene"),
        "end": text("end", "lower end of the 95 % interval, median, upper end"),
        "record": text("record", "measured table"),
        "particle": count("particle", "number of the sample of the posterior"),
        "feature": text("feature", "feature of the signals"),
        "candidate": text("candidate", "signal that could be measured"),
        "revolutions": count("revolutions", "number of revolutions that would be measured"),
        "unit": text("unknown", "unit of the unknown", required=True),
        "prior_lower": number("unknown", "m", "lower bound before the measurement", required=True),
        "prior_upper": number("unknown", "m", "upper bound before the measurement", required=True),
        "posterior": number("record particle input", "1", "samples of the posterior, each in the unit of its input"),
        "interval": number("record unknown end", "m", "calibrated 95 % interval and median"),
        "correlation": number("record", "1", "largest correlation of two unknowns in the posterior"),
        "explained": flag("record", "whether the model explains the signal", "not_explained explained"),
        "doubt": number("record", "1", "standard score of the fit among those of simulated signals"),
        "worst_feature": count("record", "number of the feature that fits least"),
        "measured": number("record feature", "1", "measured feature, in SI units of its signal; NaN where a record lacks it"),
        "predicted": number("record feature", "1", "predictive mean of the feature"),
        "predicted_deviation": number("record feature", "1", "predictive standard deviation of the feature"),
        "elapsed": number("record", "s", "time since the first record, NaN without dates"),
        "widening": number("record unknown", "1",
            "factor by which the intervals of the record were widened, from machines simulated with its noise"),
        "coverage": number("record unknown", "1",
            "share of machines simulated with the noise of the record that lie in their 95 % interval before widening"),
        "rate": number("end unknown", "m/s", "growth per second, from the records that the model explains"),
        "time_to_limit": number("end unknown", "s", "time from the last record to the limit; infinite if not reached"),
        "expected_half_width": number("candidate revolutions unknown", "m", "half-width of the 95 % interval to expect"),
        "expected_correlation": number("candidate revolutions", "1", "largest correlation of the errors of two unknowns"),
    },
)
"""Unknowns are clearances as a rule; where they have another unit, `hpcclear.identify.answer` writes it."""
