"""Random generators in and out of plain arrays, without pickle."""

import json
from typing import Any

import numpy as np
from numpy.typing import NDArray

from hpcclear.base.errors import InputError

Bytes = NDArray[np.uint8]

_KINDS = {
    kind.__name__: kind
    for kind in (
        np.random.PCG64,
        np.random.PCG64DXSM,
        np.random.MT19937,
        np.random.Philox,
        np.random.SFC64,
    )
}


def to_array(rng: np.random.Generator) -> Bytes:
    """State of the generator's bit generator, as JSON text in bytes."""
    text = json.dumps(rng.bit_generator.state, default=_listed)
    return np.frombuffer(text.encode(), dtype=np.uint8).copy()


def from_array(array: Bytes) -> np.random.Generator:
    """The generator whose state `to_array` gave; raises `InputError` for anything else."""
    text = np.asarray(array, dtype=np.uint8).tobytes()
    try:
        state = json.loads(text, object_hook=_arrays)
    except ValueError as error:
        raise _refused(text, f"not the state of a random generator ({error})") from error
    name = state.get("bit_generator") if isinstance(state, dict) else None
    if name not in _KINDS:
        raise _refused(name, "unknown bit generator")
    bits = _KINDS[name]()
    bits.state = state
    return np.random.Generator(bits)


def _listed(value: Any) -> Any:
    return value.tolist()  # words of MT19937, Philox and SFC64 are arrays


def _arrays(entry: dict[str, Any]) -> dict[str, Any]:
    return {
        key: np.array(value, dtype=np.uint64) if isinstance(value, list) else value
        for key, value in entry.items()
    }


def _refused(found: object, reason: str) -> InputError:
    return InputError("generator state", found, reason, f"Use one of {', '.join(_KINDS)}.")
