"""What a load may use: kinematics, text and balance of the motion that it is written into."""

from collections.abc import Mapping
from typing import NamedTuple

from hpcclear.dynamics.linkage.balance import Balance
from hpcclear.dynamics.linkage.expression import Writer
from hpcclear.dynamics.linkage.kinematics import Kinematics


class Writing(NamedTuple):
    """A motion that is being written: forces are added to `balance.pulls`, moments to `balance.twists`."""

    kinematics: Kinematics
    writer: Writer
    balance: Balance
    places: Mapping[
        str, int
    ]  # rows of the lanes for the places of straight tables; behind MAX_CURVES, for their rates
