"""How large the processor's first-level cache is."""

from pathlib import Path

_CACHES = Path("/sys/devices/system/cpu/cpu0/cache")

USUAL = 32 * 1024
"""Bytes where the system does not say."""


def first_level_cache(caches: Path = _CACHES) -> int:
    """Bytes of a core's first-level cache of data, as Linux states it of the first core; `USUAL` where it does not."""
    for index in sorted(caches.glob("index*")):
        try:
            level, kind, size = (
                (index / name).read_text().strip() for name in ("level", "type", "size")
            )
        except OSError:
            continue
        if (
            level == "1"
            and kind in ("Data", "Unified")
            and size.endswith("K")
            and size[:-1].isdecimal()
        ):
            return int(size[:-1]) * 1024
    return USUAL
