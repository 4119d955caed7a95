"""Objectives of one's own, as a user writes them."""

from hpcclear import Objective


def loss(normal_force, sliding_speed):
    return normal_force * abs(sliding_speed)


def in_all(rate):
    return rate.sum()


SlidingWork = Objective(
    words="normal force times sliding distance in a revolution, of all joints together",
    unit="J",
    rate=loss,
    made="revolution",
    value=in_all,
)


def load(normal_force):
    return normal_force


RmsForce = Objective(words="root mean square contact force", unit="N", rate=load, made="rms")
PeakForce = Objective(words="largest contact force", unit="N", rate=load, made="peak")
MeanForce = Objective(words="mean contact force", unit="N", rate=load)


def power(drive_torque, drive_speed):
    return drive_torque * drive_speed


DrivePower = Objective(words="mean power of the drive", unit="W", rate=power)


def wave(drive_cosine, drive_speed):
    return drive_speed * (1.0 + drive_cosine) ** 2


Wave = Objective(words="a rate whose mean is known", unit="rad/s", rate=wave)


def ratio(peak_contact_force, mean_contact_force):
    return (peak_contact_force / mean_contact_force).max()


Ratio = Objective(words="peak over mean contact force", value=ratio)
