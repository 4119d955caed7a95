"""Options that several commands share, and what all of them do with their words."""

import contextlib
import functools
import math
from collections.abc import Callable, Iterator, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple

import click
from click.core import ParameterSource
from click.decorators import FC

from hpcclear.base.errors import InputError
from hpcclear.base.plain import plain
from hpcclear.ranks.launcher import launched_rank
from hpcclear.ranks.stopping import StopSwitch
from hpcclear.ranks.terminal import Style, clear, write

if TYPE_CHECKING:
    from hpcclear.ensemble.session import Options
    from hpcclear.ranks.team import Ranks

PATH = click.Path(path_type=Path, readable=False)  # an unreadable file is reported where it is read
FILE = click.argument("file", type=PATH)
ENDINGS = ("", ".nc", ".nc4", ".cdf", ".netcdf", ".h5", ".hdf5")
"""Endings of names of result files: what is written is NetCDF-4, which is HDF5."""


def _netcdf_name(context: click.Context, option: click.Parameter, path: Path | None) -> Path | None:
    """Raise BadParameter where a name promises another format than the one that is written."""
    if path is not None and path.suffix.lower() not in ENDINGS:
        other = path.with_suffix(".nc")
        table = path if path.suffix in (".csv", ".xlsx", ".mat", ".parquet") else "TABLE.csv"
        raise click.BadParameter(
            f"{str(path)!r}: results are written as NetCDF, not as {path.suffix}. Write {str(other)!r}. "
            f"For a table, then: hpcclear export {other} -o {table}"
        )
    return path


def output_option(words: str, required: bool = True) -> Callable[[FC], FC]:
    """The option that names the file that results go to."""
    return option("-o --output", words, type=PATH, required=required, callback=_netcdf_name)


def option(usage: str, words: str, shown: object = None, **more: Any) -> Callable[[FC], FC]:
    """An option as its usage has it, such as "--size LENGTH"; repeatable where its words say so.

    `shown`: a default that the help prints. Further arguments: of `click.option`, and `name`, of the command's parameter where
    that is another one.
    """
    names = [word for word in usage.split() if word.startswith("-")]
    metavar = next((word for word in usage.split() if word not in names), None)
    names += [more.pop("name")] if "name" in more else []
    if shown is not None:
        more |= {"default": shown, "show_default": True}
    if "Repeatable." in words:
        more["multiple"] = True
    return click.option(*names, metavar=metavar, help=words, **more)


def flag(name: str, words: str) -> Callable[[FC], FC]:
    """An option that is given or not."""
    return click.option(name, is_flag=True, help=words)


class Amount(click.FloatRange):
    """A number within bounds; "nan" is none."""

    def convert(
        self, value: Any, param: click.Parameter | None, ctx: click.Context | None
    ) -> float:
        """Return the number, or raise BadParameter."""
        number: float = super().convert(value, param, ctx)
        if math.isnan(number):
            self.fail(f"{value!r} is not a number.", param, ctx)
        return number


class Share(Amount):
    """A relative amount: 0.01, or 1%."""

    def convert(
        self, value: Any, param: click.Parameter | None, ctx: click.Context | None
    ) -> float:
        """Return the number, or raise BadParameter."""
        from hpcclear.base.units import to_si  # not for the list of commands

        with contextlib.suppress(ValueError):  # else the words are refused as they are
            value = to_si(str(value), "")
        return super().convert(value, param, ctx)


TRUST = flag("--trust", "Run Python source of plug-ins that the results carry; read it first.")
FRESH = flag("--fresh", "Start a new run beside earlier results; nothing is overwritten.")
SET = option("--set KEY.PATH=VALUE", "Override an entry of the file. Repeatable.", name="overrides")
LIMIT = option(
    "--time-limit SECONDS", "Stop after this time. The same command resumes.",
    type=Amount(min=0.0, min_open=True),
)  # fmt: skip
INTERVAL = option(
    "--checkpoint-interval SECONDS", "Save finished samples this often; a crash loses about this much simulation time.",
    5.0, type=Amount(min=0.0), name="interval",
)  # fmt: skip
_STYLES = click.Choice(["auto", "bar", "log", "quiet"])
PROGRESS = option("--progress", "Display of progress.", "auto", type=_STYLES)


class Written(NamedTuple):
    """A scene as the words of a command have it: what `hpcclear.scene.load_scene` takes.

    Load it before anything that simulates: a scene that is refused is refused within a second.
    """

    file: Path
    overrides: tuple[str, ...]


class How(NamedTuple):
    """How a run is carried out."""

    fresh: bool
    time_limit: float | None
    interval: float
    progress: Style

    def options(self) -> "Options":
        """The same for a session of a run, but for the time limit, which is the process's."""
        from hpcclear.ensemble.session import Options

        return Options(self.fresh, self.interval, self.progress)


GATHERED: dict[str, type[Written] | type[How]] = {"written": Written, "how": How}
"""Arguments of commands, and what they are gathered of."""


GROUPS = {"start": "Start", "compute": "Compute", "look": "Look at results", "keep": "Keep results"}
"""Groups of commands, and their headings in `hpcclear --help`."""


class Command(click.Command):
    """A command: options that belong together reach it as one argument.

    `group`: one of `GROUPS`; `ranks`: whether all ranks carry it out; otherwise only root does, and the others leave at once.
    """

    group = ""
    ranks = True

    def parse_args(self, ctx: click.Context, args: list[str]) -> list[str]:
        """Parse words into `ctx.params`; return those that are left over."""
        left = super().parse_args(ctx, args)
        for name, kind in GATHERED.items():
            if all(field in ctx.params for field in kind._fields):
                ctx.params[name] = kind(*map(ctx.params.pop, kind._fields))
        return left


DETAILS = option(
    "--details", "Print all results, not the first screen only.", is_flag=True, expose_value=False
)


def is_given(name: str) -> bool:
    """Whether the words of a command give a parameter; of no command none is."""
    context = click.get_current_context(silent=True)
    source = None if context is None else context.get_parameter_source(name)
    return source is ParameterSource.COMMANDLINE


def detailed() -> bool:
    """Whether all results are requested; not outside of a command."""
    return is_given("details")


Run = Callable[..., int | None]
"""What a command does: it returns an exit code, none where all is done."""


def command(group: str, words: str, ranks: bool = False) -> Callable[[Run], Command]:
    """Make a command of a function, called as its file; `words`: its line in the list of commands. Others: see `Command`."""

    def declared(function: Run) -> Command:
        name = function.__module__.rpartition(".")[2]
        work = function if ranks else _of_root(function)
        work = DETAILS(work) if group == "compute" else work
        made = click.command(name, cls=Command, short_help=words)(work)
        made.group, made.ranks = group, ranks
        return made

    return declared


def _of_root(function: Run) -> Run:
    """A command that one process carries out."""

    @functools.wraps(function)
    def alone(**values: object) -> int | None:
        return function(**values) if is_root() else None

    return alone


def check_mode(
    mode: str, chosen: bool, others: Sequence[str] = (), its_own: Sequence[str] = ()
) -> None:
    """Raise UsageError where options were given that a mode of a command does not use.

    `mode`: the flag that chooses it, `chosen`: whether that was given; `others` and `its_own`: parameters that are of use
    only without the flag, and only with it.
    """
    context = click.get_current_context()
    for option in context.command.params:
        unused = option.name in (others if chosen else its_own)
        if unused and is_given(option.name or ""):
            word = max(option.opts, key=len)
            why = f"{word} cannot be combined with {mode}" if chosen else f"{word} needs {mode}"
            raise click.UsageError(f"{why}.", context)


def with_scene(function: Run) -> Run:
    """Give a command a scene file and its overrides, as its argument `written`."""
    return FILE(SET(function))


def with_how(function: Run) -> Run:
    """Give a command the options of `How`, as its argument `how`."""
    return FRESH(LIMIT(INTERVAL(PROGRESS(function))))


def place_of(output: Path) -> Path:
    """Return the place for results, with the directories above it made, and without what killed commands left there."""
    from hpcclear.results.files import remove_leftovers

    with contextlib.suppress(OSError):  # reported, with a remedy, by what writes there
        output.parent.mkdir(parents=True, exist_ok=True)
        remove_leftovers(output.parent)
    return output


def check_free(path: Path) -> None:
    """Raise InputError if something is there: what a user wrote is not written over."""
    if path.exists():
        raise InputError("file", str(path), "exists already", "Choose another name")


def is_root() -> bool:
    """Whether this process is the first of its launcher, or has none."""
    return launched_rank() in (0, None)


SIMULATING = ("hpcclear.base.cached", "hpcclear.scene", "hpcclear.dynamics.evaluation")
"""What every rank of every such command loads, in pieces: between two it hears what root says."""

STUDYING = (*SIMULATING, "hpcclear.ensemble.compiling", "hpcclear.study")


@contextlib.contextmanager
def on_ranks(
    time_limit: float | None = None, ahead: tuple[str, ...] = SIMULATING, resumes: bool = True
) -> Iterator["Ranks"]:
    """All ranks, for what root does in the block; `ahead`: what others load meanwhile; `resumes`: what it finishes is kept."""
    from hpcclear.ranks.boundary import boundary

    stop: StopSwitch = click.get_current_context().obj
    if time_limit is not None:
        stop.limit_time(time_limit)
    with boundary(stop, ahead, resumes=resumes) as ranks:
        from hpcclear.base.units import noting  # here, where the others load what they need

        with noting(lambda text, read: say(f"Note: {text!r} is read as {read}")):
            yield ranks


def show(text: str) -> None:
    """Print a line on standard output."""
    clear()
    click.echo(plain(text))


def say(text: str) -> None:
    """Print a text on standard error, from root only: one line in a log, lines of 80 columns on a terminal."""
    if is_root():
        write(text)
