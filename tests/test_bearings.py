"""What an engineer reads first: loads of the bearings, in the terminal and on the page alike."""

import re
from pathlib import Path

import numpy as np
import pytest
import report_data as data

from hpcclear import load_scene, simulate
from hpcclear.base.outcome import Status
from hpcclear.cli.printing import describe
from hpcclear.report import bearings
from hpcclear.report.html.content import Content

TURN = 2.0 * np.pi


def response(**flags):
    """Four revolutions of a synthetic response, the first two of them the transient."""
    made = data.response(4, instants=360)
    made.attrs["transient_turns"] = 2
    made["peak_contact_force"][:] = made["contact_force"].to_numpy().max(axis=0)
    for name, value in flags.items():
        made[name] = value
    return made


@pytest.mark.parametrize("instants", [16, 720])
def test_the_peak_has_the_angle_at_which_it_occurs(instants):
    """Of the steps, however many instants are stored between them; of the averaged revolutions."""
    brief = {"numerics.transient_revolutions": 1, "numerics.averaged_revolutions": 2}
    scene = load_scene("jobs/slider_crank.toml").with_(brief)
    whole = simulate(scene.with_({"output.instants_per_revolution": 0}))
    assert bearings.outside(whole).endswith(", Hertz' limit is 73.87 µm")  # c/4 R_J/R_B
    inside = bearings.averaged(whole)
    stored = whole["contact_force"].to_numpy()[inside].argmax(axis=0)
    angles = whole["crank_angle"].to_numpy()[inside][stored] % TURN
    found = bearings.bearings(simulate(scene.with_({"output.instants_per_revolution": instants})))
    for one, angle in zip(found, angles, strict=True):
        assert np.degrees(one.angle) == pytest.approx(np.degrees(angle), abs=0.5)
        assert bearings.degrees(one) == f"{np.degrees(one.angle):.0f} deg"


def test_means_are_over_time_whatever_the_instants():
    """Force 100 N in contact, 0 in flight, for 30 % of each revolution; then many more instants in contact."""
    made = response()
    share = made["crank_angle"].to_numpy() / TURN % 1.0
    touching = share < 0.3
    made["contact_force"][:] = np.where(touching, 100.0, 0.0)[:, None]
    made["penetration"][:] = np.where(touching, 1e-6, 0.0)[:, None]
    thinned = made.isel(time=np.flatnonzero(touching | (np.arange(len(share)) % 4 == 0)))
    # the jumps lie between instants 1 or 4 degrees apart; a mean over instants would be 63 N of the second
    for shown in (made, thinned):
        for one in bearings.bearings(shown):
            assert one.mean == pytest.approx(30.0, abs=100.0 * 4 / 360)
            assert one.contact == pytest.approx(0.3, abs=4 / 360)


def test_a_failed_simulation_has_no_loads(tmp_path, capsys, details):
    made = response(status=np.int8(Status.STEP_CAP))
    describe(Content(tmp_path, {}, {"response": made}), tmp_path / "a.nc")
    shown = capsys.readouterr().out
    assert "peak force" not in shown


def test_pressure_is_force_over_projected_area_and_ideal_joints_are_left_out():
    fast = ["numerics.transient_revolutions=1", "numerics.averaged_revolutions=1"]
    scene = load_scene("jobs/wear.toml", fast)
    found = {one.joint: one for one in bearings.bearings(simulate(scene))}
    assert set(found) == set(scene.clearance_joints())
    for joint, one in found.items():
        part = scene.clearance_joint(joint)
        area = 2.0 * part.bearing_radius * part.wear.length
        assert one.pressure == pytest.approx(one.mean / area, rel=1e-12)
        assert one.mean > 0.0
    ideal = load_scene("jobs/slider_crank.toml", [*fast, "joints.crank_rod.kind=ideal"])
    assert [one.joint for one in bearings.bearings(simulate(ideal))] == ["rod_slider"]


@pytest.mark.parametrize("contact", [0.0, 1e-7, 0.0004, 0.5, 0.9996, 1.0 - 1e-9, 1.0])
def test_no_share_is_rounded_to_all_or_nothing(contact):
    shown = bearings.share(contact)
    assert (re.fullmatch(r"(0|100) %", shown) is not None) == (contact in (0.0, 1.0))


def test_the_mean_torque_is_the_work_over_the_angle_whatever_the_instants(
    tmp_path, capsys, details
):
    made = response()
    angle, force = made["crank_angle"].to_numpy().copy(), 0.39
    made["driving_work"][:] = force * angle
    made["crank_moment"][:] = np.where(np.arange(len(angle)) % 9 == 0, -814.0, 0.0)  # impacts
    drive = bearings.torque(made)
    assert (drive.peak, drive.mean) == (814.0, pytest.approx(force))
    made["crank_angle"][:] = -angle  # clockwise, the same work
    assert bearings.torque(made).mean == pytest.approx(-force)
    made["crank_angle"][:] = angle
    made["drive_phase"] = ("time", angle)
    made.attrs["scene"] = Path("jobs/linkages/crank_rocker.toml").read_text(encoding="utf-8")
    assert bearings.torque(made).mean == pytest.approx(force)
    made["crank_angle"][:] = np.sin(angle)  # it swings
    assert np.isnan(bearings.torque(made).mean)
    describe(Content(tmp_path, {}, {"response": made}), tmp_path / "a.nc")
    assert "largest 814 N m, mean" not in capsys.readouterr().out


def test_means_of_impacts_are_the_same_at_any_number_of_instants():
    few = ["numerics.transient_revolutions=1", "numerics.averaged_revolutions=2"]
    for name in ("jobs/linkages/crank_rocker.toml", "jobs/linkages/three_rrr.toml"):
        found = [
            simulate(load_scene(name, [*few, f"output.instants_per_revolution={count}"]))
            for count in (40, 4000)
        ]
        rough, fine = (bearings.bearings(one) for one in found)
        for one, other in zip(rough, fine, strict=True):
            assert (one.mean, one.contact) == pytest.approx((other.mean, other.contact), rel=1e-6)
        means = [bearings.torque(one).mean for one in found]
        assert means[0] == pytest.approx(means[1], rel=1e-6, nan_ok=True)
        assert np.isnan(means[0]) == ("rrr" in name)  # three drives share the work
        force = found[1]["contact_force"].to_numpy()[bearings.averaged(found[1])]
        assert [one.mean for one in fine] == pytest.approx(list(force.mean(axis=0)), rel=0.05)


@pytest.mark.parametrize(("lost", "warned"), [(-4e-4, True), (-1e-6, False), (4e-4, False)])
def test_impacts_that_gain_energy_are_warned_of(lost, warned):
    made = response()
    made["impact_energy"] = ("joint", np.array([1e-3, lost]))
    made["impact_energy_limit"] = ("joint", np.array([1e-5, 1e-5]))
    found = [text for kind, text in bearings.remarks(made) if "gain energy" in text]
    assert len(found) == warned
    assert all("rod_slider" in text and "400 µJ" in text for text in found)
