"""Whether the tables of a scene fit one another, and what a file may leave out because another table says it."""

from collections.abc import Iterator, Mapping
from contextlib import contextmanager

from hpcclear.base.errors import InputError
from hpcclear.base.objectives import MEAN_GAP
from hpcclear.base.outcome import IMPACTS, MAX_BANDS, WIDEST
from hpcclear.scene.fields import Entries, check_known, invalid
from hpcclear.scene.fitted import with_fits_of_joints, with_shares
from hpcclear.scene.named import SHORT_NAMES
from hpcclear.scene.paths import replace
from hpcclear.scene.slider_crank import JOINTS
from hpcclear.scene.tables import SceneTables


def _clearance_of_open_joints(data: Entries) -> Entries:
    """Without a path of its own, C drives the clearances there are."""
    try:
        if data["mechanism"].get("kind") == "planar":
            key, rows = "mechanism.joints", data["mechanism"]["joints"]
        else:
            key, rows = "joints", {name: data["joints"][name] for name in JOINTS}
        kinds = {n: row.get("kind") or rows[row["like"]]["kind"] for n, row in rows.items()}
        tables = {name: dict(data["study"].get(name, {})) for name in ("variables", "random")}
    except (AttributeError, KeyError, TypeError, ValueError):
        return data  # the models below say what is wrong with it
    paths = [f"{key}.{name}.clearance" for name, kind in kinds.items() if kind == "clearance"]
    if not paths or tuple(paths) == SHORT_NAMES["C"]:
        return data
    for table, rows in tables.items():
        row = rows.get("C")
        if isinstance(row, Mapping) and "path" not in row and "paths" not in row:
            data = replace(data, f"study.{table}.C", {**row, "paths": paths})
    return data


class ConsistentTables(SceneTables):
    """The tables of a scene file, each fitting the others."""

    @classmethod
    def _of_file(cls, row: Entries) -> Entries:
        """A slider-crank where no kind is named; a linkage brings its own drives and joints."""
        if isinstance(row.get("format_version"), bool):  # equal to 1 in Python
            reason = "true or false is not a version"
            raise invalid(reason, "Write format_version = 1", "format_version")
        data = _clearance_of_open_joints(row)
        mechanism = data.get("mechanism")
        if not isinstance(mechanism, Mapping):
            return data
        data = with_shares(with_fits_of_joints(data))
        kind = mechanism.get("kind", "slider-crank")
        for table in ("drive", "joints"):
            if kind == "planar" and table in data:
                own = "drives" if table == "drive" else table
                raise invalid("belongs to a slider-crank", f"Write [mechanism.{own}.NAME]", table)
        return {**data, "mechanism": {"kind": kind, **mechanism}}

    def _check(self) -> None:
        self._check_mechanism()
        self._check_effects()
        self._check_profiles()
        self._check_objective()
        self._check_target()
        self._check_pressures()
        self._check_levels()

    def _check_mechanism(self) -> None:
        for table in ("drive", "joints"):
            if self.template is not None and getattr(self, table) is None:
                raise invalid("is missing", "Add it", table)
        for entry in ("slider_load", "guide_friction"):
            value = getattr(self.effects, entry)
            if self.template is None and value is not None:
                friction = "friction as an entry of a slide in [mechanism.joints.NAME]"
                remedy = f"Write a load in [mechanism.loads.NAME], {friction}"
                raise invalid("belongs to a slider-crank", remedy, f"effects.{entry}")
        if self.template is not None:
            self._check_template()

    def _check_template(self) -> None:
        """What is checked of every linkage, by the entries of its template; a slider with clearance tilts, and rubs at its
        corners."""
        with self._named_as_written():
            self.linkage.check()
        if self.joints.guide is None:
            return
        if self.slider_crank.slider.inertia is None:
            reason = "a slider in a guide with clearance can turn, so it needs an inertia"
            raise invalid(reason, "Write it about its pin in kg m2", "mechanism.slider.inertia")
        (guide,) = (joint for joint in self.linkage.joints if joint.kind == "slide")
        with self._named_as_written("joints.guide"):
            guide.check()

    @contextmanager
    def _named_as_written(self, below: str = "") -> Iterator[None]:
        """Errors of the linkage's tables, with the keys of the entries that stand for them in the scene."""
        try:
            yield
        except InputError as error:
            path = ".".join(filter(None, ("mechanism", below, error.key)))
            said = error.reason, error.remedy
            raise invalid(*said, self.path_in_scene(path), error.value) from None

    def _check_effects(self) -> None:
        clearance = self.clearance_joints()
        contact, shape = self.effects.contact, self.effects.geometry
        if contact is not None and shape is not None and shape.has_length:
            for name in clearance:
                if self.clearance_joint(name).length_path is None:
                    entry, part = self.clearance_joint(name).long_entry
                    geometry = f'the contact geometry "{contact.geometry}"'
                    reason = f"{geometry} needs the {entry} of the {part}"
                    remedy = f'Add {entry} = "20 mm" or so to the joint'
                    raise invalid(reason, remedy, f"{self.joint_key(name)}.{entry}")
        if clearance and contact is None:
            law = 'contact = { law = "lankarani-nikravesh", restitution = 0.9 }'
            remedy = f'Add {law}, or make the joints ideal (kind = "ideal")'
            raise invalid("a clearance joint needs a contact law", remedy, "effects.contact")
        if not clearance and self.effects.friction.law != "none":
            reason = "friction acts in joints with clearance, but all joints are ideal"
            remedy = 'Set effects.friction.law = "none", or give a joint kind = "clearance"'
            raise invalid(reason, remedy, "effects.friction.law")

    def _check_profiles(self) -> None:
        """An angular profile needs dry joints of rigid bodies."""
        if self.wear is None or not self.wear.waves or not self.worn_joints():
            return
        own = "wear.profile", self.wear.profile
        if self.bending():
            remedy = 'Set it to "uniform", or leave bending out'
            reason = "an angular wear profile needs rigid bodies, but a body bends"
            raise invalid(reason, remedy, *own)
        for name in self.worn_joints():
            if name in self.films():
                reason = f"joint {name} has an oil film, which needs round surfaces"
                raise invalid(reason, 'Set it to "uniform", or remove the film', *own)

    def _check_objective(self) -> None:
        chosen, key = self.numerics.objective_joints, "numerics.objective_joints"
        clearance = dict.fromkeys((*self.clearance_joints(), *self.contact_labels()))
        for joint in chosen:
            check_known(joint, clearance, "is not a joint with clearance of this scene", key)
        if len(set(self._contacts_in(chosen))) < len(self._contacts_in(chosen)):
            raise invalid("a joint is named twice", "Name each once", key=key)
        if self.study is not None and self.numerics.objective is not None:
            reason = "a study names its objective itself"
            raise invalid(reason, "Write study.objective instead", "numerics.objective")
        if chosen and not self.objective.of_joints:
            known = "mean-gap, mean-contact-force or peak-contact-force"
            reason = f'{self.objective_key} = "{self.objective.name}" is of no joint'
            raise invalid(reason, f"Leave the joints out, or choose {known}", key)

    def _check_target(self) -> None:
        if self.numerics.target_error is None or not self.clearance_joints():
            return
        why = "the confidence interval of a steady mean exists for the mean gap of all joints only"
        if self.numerics.objective_joints:
            raise invalid(why, "Leave out the joints, or target_error", "numerics.objective_joints")
        if (named := self.objective.name) != MEAN_GAP.name:
            remedy = "Remove numerics.target_error, and raise numerics.averaged_revolutions"
            raise invalid(f"{why}, and the objective is {named}", remedy, "numerics.target_error")

    def _check_pressures(self) -> None:
        for key, one in () if self.effects.has_pressure else self._objectives().items():
            if not one.asks.isdisjoint(WIDEST):
                reason = f"{one.name} needs a geometry of contact with a pressure"
                remedy = 'Add geometry = "line" or "liner" to effects.contact'
                raise invalid(reason, remedy, key, one.name)

    def _check_levels(self) -> None:
        bands, every = self.bands(), self._objectives().items()
        asking = [key for key, one in every if one.band or not one.asks.isdisjoint(IMPACTS)]
        key = "numerics.levels" if self.numerics.levels else (*asking, self.objective_key)[0]
        if (bands or asking) and not self.clearance_joints():
            reason = "force levels and impacts are those of joints with clearance"
            raise invalid(reason, 'Remove it, or set a joint\'s kind = "clearance"', key)
        if bands and self.numerics.target_error is not None:
            reason = "force levels are those of a given number of revolutions"
            raise invalid(reason, "Remove numerics.target_error, and set averaged_revolutions", key)
        if len(bands) > MAX_BANDS:
            raise invalid(f"there are more than {MAX_BANDS} bands of levels", "Remove some", key)
