"""How a scene is integrated and what is written, as in the scene file."""

from typing import Annotated, Literal

from pydantic import Field, StrictBool

from hpcclear.base.objectives import HIGHEST, LOWEST
from hpcclear.base.outcome import MAX_BANDS
from hpcclear.plugins import OBJECTIVES
from hpcclear.scene.cases import ObjectiveName
from hpcclear.scene.fields import Count, PositiveLength, Quantity, Table

Frequency = Annotated[float, Quantity("Hz", least=LOWEST, most=HIGHEST)]


class Numerics(Table):
    """Integration of the motion: method, tolerances, and revolutions to average."""

    formulation: Literal["minimal", "baumgarte"] = "minimal"
    """Minimal coordinates, or Lagrange multipliers with Baumgarte feedback (eq. 11)."""
    alpha: Annotated[float, Quantity("1/s", least=0)] = 250.0
    """Baumgarte feedback on constraint speed, 1/s; used by that formulation, and by ideal loops of linkages."""
    beta: Annotated[float, Quantity("1/s", least=0)] = 250.0
    """Baumgarte feedback on constraint position, 1/s; used by that formulation, and by ideal loops of linkages."""
    interpolation: Literal["smooth", "linear"] = "smooth"
    """Interpolation between the rows of tables of loads and torques: monotone cubic ("smooth") or linear, with corners."""
    method: Literal[
        "auto", "tsitouras", "dormand-prince", "fehlberg", "prince-dormand", "switching", "radau"
    ] = "auto"
    """Integrator of responses and samples. The four named pairs are explicit, of order 5, 5, 4 and 8; the last is for
    tolerances of 1e-9 and less. "switching" takes implicit steps where the motion is stiff, "radau" always. By
    default ("auto") the method is "switching" for steep friction ramps, strong damping, oil or bristles, "radau" for fast
    bending modes, and "tsitouras" otherwise."""
    rtol: Annotated[float, Quantity("", least=1e-14, most=0.1)] = 1e-6
    """Relative tolerance of a step."""
    atol: PositiveLength | None = None
    """Absolute tolerance on lengths, m; default rtol times 1 mm. Tolerances of other states are scaled in proportion
    ("Integration" in the theory page)."""
    target_error: Annotated[float, Quantity("", above=0, most=0.5)] | None = None
    """Target for the relative error of the mean gap f of responses and samples; other objectives are refused. f is then a
    steady mean with a 95 % half-width. Tolerance and revolutions are chosen automatically, instead of `rtol`,
    `transient_revolutions` and `averaged_revolutions`."""
    target_revolutions: Annotated[int, Count(100, 10**12)] = 20_000
    """With `target_error`: largest number of revolutions of a design, all replicas together. If they do not suffice,
    the target is reported as missed."""
    transient_revolutions: Annotated[int, Count(0, 10**9)] = 5
    """Number of revolutions before averaging begins."""
    averaged_revolutions: Annotated[int, Count(1, 10**9)] = 5
    """Number of revolutions that are averaged."""
    objective: Annotated[str, ObjectiveName(OBJECTIVES)] | None = None
    """Objective f in a scene without a study; default "mean-gap". A study uses `study.objective`."""
    objective_joints: tuple[str, ...] = ()
    """Joints with clearance, or single contacts such as "guide.front_left", whose gaps or contact forces the objective
    combines; default: all."""
    max_steps: Annotated[int, Count(1)] = 10_000_000
    """Largest number of accepted and rejected steps of one sample; beyond it the sample ends with status STEP_CAP."""
    energy: StrictBool = False
    """Whether each sample also records its energy balance."""
    responses: StrictBool = False
    """Whether each sample also records mean contact forces, peak torque of the drive and standard deviation of the
    slider acceleration. Enabled automatically if the study needs one of them."""

    impacts: StrictBool = False
    """Whether each sample also records measures of impact and noise. For each joint and revolution: number of impacts,
    energy lost in them, impulse, angle without contact, RMS contact force. For the mechanism: RMS force on the frame.
    Enabled automatically if the study needs one of them."""

    levels: Annotated[tuple[Frequency, ...], Field(max_length=MAX_BANDS)] = ()
    """Frequencies, Hz. Each sample records the force levels of the third-octave bands that contain them, with
    half-widths, and half-widths of the measures of impact. Enabled automatically if the study needs a level. Samples
    then take ten times as long or more."""

    @property
    def absolute_tolerance(self) -> float:
        """Absolute tolerance on lengths, m."""
        return self.rtol * 1e-3 if self.atol is None else self.atol


class Output(Table):
    """Output of `simulate`."""

    instants_per_revolution: Annotated[int, Count(0, 10**6)] = 720
    """Number of stored instants per revolution, evenly spaced in time; 0: every accepted step. Time series larger than
    half of the machine's memory are refused."""
    keep_revolutions: Annotated[int, Count(1)] | None = None
    """Number of last revolutions whose time series are stored; default: all. f and all mean values are not affected."""
