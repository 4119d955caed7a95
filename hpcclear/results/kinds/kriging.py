"""Surrogates, with all that a prediction takes."""

from hpcclear.results.rows import ResultKind, count, flag, number, text

KIND = ResultKind(
    50, "Kriging models of the objective", ("model", "point"),
    design_dims=("model", "point"), limit_dims=("model",), absent="no surrogate (`hpcclear run`)",
    table={
        "model": text("model", "name of the model, one for each subinterval"),
        "point": count("point", "number of the training point"),
        "parameter": text("parameter", "design variable"),
        "family": text("model", "model that the subintervals form together"),
        "training_output": number("model point", "objective", "objective at the training point"),
        "weight": number("model point", "1", "weight of the training point in a prediction"),
        "length_scale": number("model parameter", "1", "correlation length, in the unit cube"),
        "used": flag("model parameter", "whether the parameter is an input of the model", "not_an_input input"),
        "surrogate": text("model", "kind of surrogate, if not Kriging"),
        "cross_validated": number("model point", "objective",
            "prediction at the training point by a model fitted without that point, if not Kriging"),
        "kernel": text("model", "covariance function, if not the squared exponential"),
        "signal_variance": number("model", "1", "variance of the process, in output_scale^2"),
        "noise_variance": number("model", "1", "variance of the noise, in output_scale^2"),
        "output_mean": number("model", "objective", "mean subtracted before the fit"),
        "output_scale": number("model", "objective", "standard deviation used as divisor before the fit"),
        "dropped": count("model", "number of failed samples left out of the fit"),
        "accepted": flag("model", "whether the model passed on its test points", "refused accepted"),
        "r2": number("model", "1", "1 - SSE/SST on test points", required=True),
        "rmae": number("model", "1", "largest test error / standard deviation of test values", required=True),
        "r2_explained": number("model", "1", "explained variance ratio, eq. 26 as printed"),
        "rmae_mean": number("model", "1", "largest test error / mean of test values, eq. 27 as printed"),
        "rmse": number("model", "objective", "root mean square error on test points"),
        "points": count("model", "number of points fitted"),
    },
)
