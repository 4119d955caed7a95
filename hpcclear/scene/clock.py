"""Clock times and dates of tables: cells such as "12:03:05.2", "2026-03-01 12:03:05" or "1.3.2026 0:05", as seconds; and
numbers of workbooks that are such times by their formats.

What can be read in two ways, such as 03/04/2026, is refused with both readings.
"""

import datetime
import re
from collections.abc import Callable, Mapping, Sequence
from functools import lru_cache

from hpcclear.base.errors import InputError
from hpcclear.base.units import is_unit

DAY = 86_400
_MONTHS = {
    word: number
    for number, words in enumerate((
        "jan", "feb", "mar mär mrz", "apr", "may mai", "jun", "jul", "aug", "sep", "oct okt", "nov", "dec dez",
    ), 1)
    for word in words.split()
}  # fmt: skip
_DATE = (
    r"(?P<year>\d{4})(?P<sign>[-/.])\d{1,2}(?P=sign)\d{1,2}|(?P<basic>\d{8})(?=T)"
    r"|\d{1,2}(?P<mark>[-/.])\d{1,2}(?P=mark)(?:\d{4}|\d\d(?=[\sT,]))"
    r"|\d{1,2}[-\s.]{1,2}[^\W\d_]{3,9}[-\s.,]{1,2}\d{4}|[^\W\d_]{3,9}\.?\s\d{1,2},?\s\d{4}"
)
_TIME = r"(?:(?P<hours>\d{1,4}):)?(?P<minutes>\d{1,2}):(?P<seconds>\d\d)(?P<fraction>[.,]\d{1,12})?"
_HOURS = r"(?P<hour>\d{1,2}):(?P<minute>\d\d)"
_COMPACT = r"(?<=T)(?P<compact>\d{6})(?P<rest>[.,]\d{1,12})?"
_MOMENT = re.compile(
    rf"(?:(?P<date>{_DATE})(?:[T\s,]+|$))?(?:(?:{_HOURS}|{_TIME}|{_COMPACT})\s*(?P<half>[ap]\.?m\.?)?"
    r"\s*(?P<zone>z|utc|gmt|[+-]\d\d:?(?:\d\d)?)?)?",
    re.IGNORECASE,
)
_ORDERS = {"day, month, year": "210", "month, day, year": "201", "year, month, day": "012"}
"""Where year, month and day stand."""

Moment = tuple[int | None, int, float, bool]
"""Day, or None without a date; whole seconds, those of a zone taken off; their fraction; whether a zone is stated."""


def is_clock(cell: str) -> bool:
    """Whether a cell is a clock time or a date."""
    text = cell.strip()
    usual = 0 < len(text) < 60 and (":" in text or len(text) > 7)
    return usual and _MOMENT.fullmatch(text) is not None


def seconds(cells: Sequence[str], where: Callable[[int], str]) -> list[float]:
    """Seconds since the first of clock times or dates; times of day go on after midnight. `where`: place of a cell, in errors.

    Raises InputError: a cell is none, is another kind than those above it, or the order of day and month is open.
    """
    order = _order(cells, where)
    made, gone, first, last = list[float](), 0, None, None
    for row, cell in enumerate(cells):
        found = _MOMENT.fullmatch(cell.strip())
        day, whole, fraction, zoned = now = _moment(found, order, cell, where(row))
        if first is None or last is None:
            first = last = now
        if (day is None, zoned) != (first[0] is None, first[3]):
            reason = "is a time of another kind than those above it"
            raise InputError(where(row), cell, reason, "Write date, time and zone in one way")
        # minutes and seconds without an hour begin again with the hour
        period = 3600 if found and found["minutes"] and not found["hours"] else DAY
        if day is None and last[1] - whole > period / 2:
            gone += period
        days = (day or 0) - (first[0] or 0)
        made.append(DAY * days + gone + whole - first[1] + (fraction - first[2]))
        last = now
    return made


def _moment(found: re.Match[str] | None, order: str, cell: str, where: str) -> Moment:
    if found is None or not cell.strip():
        raise InputError(where, cell, "is no time or date", "Write it as 2026-03-01 12:03:05.2")
    day = None
    if found["date"]:
        day = _day(found["date"], order)
        if day is None:
            reason = f"is no date (read as {order})"
            raise InputError(where, cell, reason, "Write it as 2026-03-01 12:03:05.2")
    if found["compact"]:
        clock = [found["compact"][k : k + 2] for k in (0, 2, 4)]
    elif found["hour"]:
        clock = [found["hour"], found["minute"], "0"]
    else:
        clock = [found["hours"] or "0", found["minutes"] or "0", found["seconds"] or "0"]
    hours, minutes, whole = map(int, clock)
    if day is None and found["hour"] and not found["half"]:
        reason = f"may be {hours} h {minutes} min or {hours} min {minutes} s"
        raise InputError(where, cell, reason, f"Write 0:{cell.strip()} or {cell.strip()}:00")
    if found["half"] and 1 <= hours <= 12:
        hours = hours % 12 + 12 * (found["half"][0].lower() == "p")
    elif found["half"] or (day is not None and hours > 24) or minutes > 59 or whole > 60:
        raise InputError(where, cell, "is no time of day", "Write it as 12:03:05.2")
    rest = found["fraction"] or found["rest"]
    fraction = float("0." + rest[1:]) if rest else 0.0
    zone = found["zone"]
    since = 3600 * hours + 60 * minutes + whole - _offset(zone or "")
    return day, since, fraction, zone is not None


def _offset(zone: str) -> int:
    digits = zone[1:].replace(":", "")
    if not digits.isdecimal():
        return 0
    ahead = 3600 * int(digits[:2]) + 60 * int(digits[2:] or 0)
    return -ahead if zone[0] == "-" else ahead


@lru_cache(4096)
def _day(text: str, order: str) -> int | None:
    """Number of a day, None if there is no such one."""
    parts = re.findall(r"[^\W_]+", text)
    if text.isdecimal():
        parts = [text[:4], text[4:6], text[6:]]
    month = next((one for one in parts if one.isalpha()), None)
    if month is not None:
        day, year = (one for one in parts if one != month)
        number = str(_MONTHS.get(month[:3].lower(), 0))
    else:
        places = _ORDERS["year, month, day" if len(parts[0]) == 4 else order]
        year, number, day = (parts[int(place)] for place in places)
    try:
        century = 2000 * (len(year) == 2)
        return datetime.date(int(year) + century, int(number), int(day)).toordinal()
    except ValueError:
        return None


def _order(cells: Sequence[str], where: Callable[[int], str]) -> str:
    """The order of day, month and year that makes each cell a date; points stand between day, month and year."""
    every = ((row, _MOMENT.fullmatch(cell.strip())) for row, cell in enumerate(cells))
    open_ = {row: one["date"] for row, one in every if one and one["mark"] in ("/", "-")}
    orders = list(_ORDERS)
    if not any(len(date) < 9 for date in open_.values()):
        orders.pop()  # a year of four digits stands at the end
    if not open_:
        return orders[0]
    fits = [one for one in orders if None not in (_day(date, one) for date in open_.values())]
    if len(fits) > 1:
        row, date = next(iter(open_.items()))
        days = [datetime.date.fromordinal(_day(date, one) or 1).isoformat() for one in fits]
        named = [f"{day} ({order})" for day, order in zip(days, fits, strict=True)]
        raise InputError(where(row), cells[row], f"may be {' or '.join(named)}", f"Write {days[0]}")
    return (fits or orders)[0]


_BUILT_IN = {
    **dict.fromkeys((*range(14, 18), *range(27, 32), 34, 35, 36, *range(50, 55), 57, 58), "date"),
    **dict.fromkeys((*range(18, 23), 32, 33, 45, 47, 55, 56), "time"),
    46: "elapsed", 9: "percent", 10: "percent",
}  # fmt: skip
"""What numbers of built-in formats are (ECMA-376, 18.8.30)."""


_LITERAL = re.compile(r'"([^"]*)"|\\(.)|_.|\*.')
"""Of a number's format: a text, a sign, a space as wide as a sign, a sign that fills the cell."""


def kind_of_format(number: str, own: Mapping[str, str]) -> str:
    """What numbers of a format are; of those that are shown with a unit, a space and the unit."""
    code = own.get(number)
    if code is None:
        return _BUILT_IN.get(int(number) if number.isdecimal() else 0, "")
    code = code.partition(";")[0]
    plain = _LITERAL.sub("", code).lower()
    if re.search(r"\[(h+|m+|s+)\]", plain):
        return "elapsed"
    plain = re.sub(r"\[[^\]]*\]", "", plain)
    if plain in ("general", "@", ""):
        return ""
    if re.search("[hs]", plain):
        return "time"
    shown = "".join(one[1] or one[2] or "" for one in _LITERAL.finditer(code)).strip()
    unit = f" {shown}" if is_unit(shown) else ""
    return "date" if re.search("[dmy]", plain) else "percent" if "%" in plain else unit


def moment_of(days: float, style: str, epoch: datetime.datetime) -> str:
    """A date or time as text, by ISO 8601; hours may be more than 24 where they are counted on."""
    if not 0 <= days < 2_958_466:  # the year 10000
        raise ValueError(f"{days!r} is no date")
    micros = round(days * 86_400_000_000)
    if style == "elapsed" or days < 1:
        seconds, rest = divmod(micros, 1_000_000)
        text = f"{seconds // 3600:02d}:{seconds // 60 % 60:02d}:{seconds % 60:02d}"
        return f"{text}.{rest:06d}" if rest else text
    if days < 60 and epoch.year < 1904:
        micros += 86_400_000_000  # Excel has a 29 February 1900
    moment = epoch + datetime.timedelta(microseconds=micros)
    if style == "date" and days == int(days):
        return moment.date().isoformat()
    return moment.isoformat(sep=" ")
