"""What is printed and drawn is what it is called: launchers, early stops, indices, peaks, contact, fronts, fits."""

import numpy as np
import pytest
import report_data as data
import xarray as xr
from commands import finish, start

from hpcclear import report
from hpcclear.cli.printing import describe
from hpcclear.report.figures import motion
from hpcclear.report.html.content import Content

# -- launchers, and early stops -----------------------------------------------------------------------


@pytest.mark.parametrize("rank", ["0", "3"])
def test_check_under_a_launcher_of_another_library_ends_with_exit_code_2(rank):
    """What each of eight copies sees that a foreign launcher has started: its own rank, and nobody else in MPI."""
    foreign = {"OMPI_COMM_WORLD_SIZE": "8", "OMPI_COMM_WORLD_RANK": rank}
    job = start(["check", "jobs/quickstart.toml", "--no-cost"], 0, **foreign)
    code, output = finish(job)
    assert code == 2
    assert ("the launcher started 8 processes" in output) == (rank == "0")
    assert "Model" not in output


def test_check_counts_the_ranks_that_reached_each_other():
    code, output = finish(start(["check", "jobs/quickstart.toml", "--no-cost"], 2))
    assert code == 0, output
    assert "2 ranks connected" in " ".join(output.split())


# -- sensitivity, and surrogates that do not fit ------------------------------------------------------


def badly_fitted() -> tuple[xr.Dataset, xr.Dataset]:
    surfaces, models = data.sensitivity(), data.kriging()
    surfaces["r2"][0, 0, 2] = -0.31
    models["r2"][0] = 0.69
    return surfaces, models


@pytest.mark.parametrize(
    ("draw", "which", "words"),
    [
        (report.sensitivity_figure, 0, "worse than a constant"),
        (report.fit_figure, 0, "worse than a constant"),
        (report.surfaces_figure, 1, "indicative only"),
        (report.parity_figure, 1, "indicative only"),
    ],
)
def test_a_figure_of_a_poor_fit_says_so_across_its_panel(draw, which, words):
    poor, good = badly_fitted()[which], (data.sensitivity(), data.kriging())[which]
    told = [text.get_text() for panel in draw(poor).axes for text in panel.texts]
    assert any(words in text for text in told)
    told = [text.get_text() for panel in draw(good).axes for text in panel.texts]
    assert not any("constant" in text or "indicative" in text for text in told)


# -- one response --------------------------------------------------------------------------------------


def test_the_stored_peak_is_one_of_the_averaged_revolutions(tmp_path, capsys, details):
    """The start transient is twice as hard; the peak is of the last two of four revolutions."""
    response = data.response()
    turn = response["crank_angle"].to_numpy() / (2.0 * np.pi)
    force = np.where(turn < 1.0, 2000.0, 1000.0)
    response["contact_force"][:] = force[:, None]
    response["peak_contact_force"][:] = 1500.0
    response.attrs["transient_turns"] = 2
    describe(Content(tmp_path, {}, {"response": response}), tmp_path / "a.nc")
    shown = " ".join(capsys.readouterr().out.split())
    assert "Peak force 1.5 kN" in shown
    assert "2 kN" not in shown


@pytest.mark.parametrize("flights", [0, 1, 2, 5, 100, 400, 1999, 2000])
def test_shares_of_contact_are_never_rounded_to_all_or_none(flights):
    response = data.response(10, instants=200).isel(time=slice(0, 2000))
    depth = np.where(np.arange(2000) < flights, 0.0, 1e-6)
    response["penetration"][:] = depth[:, None]
    told = motion.contact(response, "crank_rod")
    assert ("all instants" in told) == (flights in (0, 2000))
    assert " 100" not in told
    assert " 0 %" not in told
    assert " 0.0 %" not in told
    if flights in (100, 400):
        assert f"{100 - flights / 20:.1f} %" in told


@pytest.mark.parametrize("seed", range(5))
def test_contact_is_drawn_along_the_bore_and_never_across_it(seed):
    """Bounces from side to side between two instants of the file: chords would cut the circle."""
    response, rng = data.response(), np.random.default_rng(seed)
    count, clearance = response.sizes["time"], 3e-4
    angle = np.cumsum(rng.normal(0.0, 0.2, count)) + np.pi * np.cumsum(rng.random(count) < 0.05)
    flies = rng.random(count) < 0.1
    reach = clearance * np.where(flies, 0.5, 1.002)
    response["eccentricity_x"][:] = (reach * np.cos(angle))[:, None]
    response["eccentricity_y"][:] = (reach * np.sin(angle))[:, None]
    response["penetration"][:] = np.maximum(reach - clearance, 0.0)[:, None]
    shown = motion.steady(response)
    for panel in report.orbit_figure(response).axes:
        drawn = {line.get_label(): line.get_xydata() for line in panel.lines}
        for name in ("contact", "contact arc"):
            path = drawn[name]
            middles = 0.5 * (path[1:] + path[:-1])
            depth = np.hypot(*middles.T)
            assert np.nanmin(depth) > 0.3 * (1.0 - 2e-4)  # steps of 2 degrees sag by 1.5e-4
        joined = np.isfinite(drawn["contact arc"]).all(axis=1)
        assert joined.sum() >= (shown["penetration"].to_numpy()[:, 0] > 0.0).sum()
