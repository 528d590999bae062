"""Measured files, dropped into the viewport or chosen: waters, cameras, floors, lights, lamps."""

from __future__ import annotations

from pathlib import Path
from typing import override

import bpy
from bpy_extras import view3d_utils
from bpy_extras.io_utils import ImportHelper

from ..scene import stored_lamps, stored_settings
from ..scene.water import lamp_rigs
from ..settings.scene_settings import SETTINGS
from ..uw_spectral.errors import InputError
from ..uw_spectral.spectra import sensor as sensors
from ..uw_spectral.water import measured
from .live_updates import refresh, transaction
from .reporting import ReportingOperator, water_settings

_LUMENS = 4000.0
"""Of a new lamp whose profile tells no power."""
_EXTENSIONS = ".sb;.env;.csv;.txt;.json;.ies"


class UseFiles(ReportingOperator):
    """Use tables of a water, a camera, a floor, a light or a lamp, by what their headers say. What
    belongs to a lamp goes to the active one; a profile without one makes a lamp.
    """

    bl_idname = "underwater.use_files"
    bl_label = "Use Measured Files"

    filepath: bpy.props.StringProperty(subtype="FILE_PATH", options={"SKIP_SAVE"})
    directory: bpy.props.StringProperty(subtype="DIR_PATH", options={"SKIP_SAVE", "HIDDEN"})
    files: bpy.props.CollectionProperty(
        type=bpy.types.OperatorFileListElement, options={"SKIP_SAVE", "HIDDEN"}
    )
    use_as: bpy.props.StringProperty(
        name="Use As",
        description="What a file is used as that can be several things: water, sensor, floor, "
        "light, spectrum or profile",
        options={"SKIP_SAVE"},
    )
    place: bpy.props.FloatVectorProperty(
        name="Place",
        description="Where a new lamp is put",
        subtype="XYZ_LENGTH",
        options={"SKIP_SAVE"},
    )

    @override
    def invoke(self, context: bpy.types.Context, event: bpy.types.Event) -> set[str]:
        self.place = context.scene.cursor.location
        region, view = context.region, context.region_data
        if isinstance(view, bpy.types.RegionView3D) and region is not None:
            at = event.mouse_region_x, event.mouse_region_y
            self.place = view3d_utils.region_2d_to_location_3d(region, view, at, self.place)
        try:
            choices = self._choices()
        except InputError as error:
            self.report({"ERROR"}, str(error))
            return {"CANCELLED"}
        if choices:
            self._ask(context, choices)
            return {"CANCELLED"}
        return self.execute(context)

    @override
    def run(self, context: bpy.types.Context) -> None:
        from ..settings.file_kinds import FILE_KINDS

        used = self._used()
        lamp = _active_lamp(context)
        if "spectrum" in used and lamp is None and "profile" not in used:
            raise InputError(
                f"{used['spectrum'].name} is the spectrum of a lamp; make a point, spot or area "
                "lamp active, and drop it again"
            )
        group = getattr(context.scene, stored_settings.PROPERTY)
        with transaction():
            for name, path in used.items():
                setting = FILE_KINDS[name].setting
                if not setting:
                    continue
                setattr(group, setting, f"file:{path}")
                label = SETTINGS[setting].label
                self.report({"INFO"}, f"{label}: {path.name}")
                if not SETTINGS[setting].applies(group):
                    needed = ", ".join(SETTINGS[n].label for n in SETTINGS[setting].needs)
                    self.report({"WARNING"}, f"{label} has no effect yet; set {needed}")
        if "profile" in used:
            lamp = self._shape_lamp(context.scene, lamp, used["profile"])
        if "spectrum" in used and lamp is not None:
            getattr(lamp.data, stored_lamps.PROPERTY).spectrum = f"file:{used['spectrum']}"
            self.report({"INFO"}, f"{lamp.name}: spectrum {used['spectrum'].name}")
        if {"profile", "spectrum"} & set(used):
            refresh(context.scene)

    def _paths(self) -> list[Path]:
        folder = Path(bpy.path.abspath(self.directory))
        paths = [folder / item.name for item in self.files if item.name]
        if not paths and self.filepath:
            paths = [Path(bpy.path.abspath(self.filepath))]
        if not paths:
            raise InputError("no file was named; drop one into the viewport")
        return paths

    def _choices(self) -> tuple[str, ...]:
        """Return what the one file can be that is several things; empty if all is clear."""
        from ..settings.file_kinds import kinds_of_file

        found = [kinds for path in self._paths() if len(kinds := kinds_of_file(path)) > 1]
        return () if self.use_as or len(found) != 1 else found[0]

    def _used(self) -> dict[str, Path]:
        """Return each file by the kind that it is used as."""
        from ..settings.file_kinds import FILE_KINDS, kinds_of_file

        used: dict[str, Path] = {}
        for path in self._paths():
            kinds = kinds_of_file(path)
            if self.use_as and (self.use_as in kinds or len(kinds) > 1):
                kinds = tuple(kind for kind in kinds if kind == self.use_as)
            if len(kinds) != 1:
                known = ", ".join(kinds_of_file(path))
                raise InputError(f"{path} can be used as {known}; say as which of them")
            if kinds[0] in used:
                raise InputError(
                    f"{used[kinds[0]].name} and {path.name} are both for "
                    f"{FILE_KINDS[kinds[0]].label!r}; drop one of them"
                )
            used[kinds[0]] = path
        return used

    def _ask(self, context: bpy.types.Context, choices: tuple[str, ...]) -> None:
        """Let the user choose in a menu, which calls this again."""
        from ..settings.file_kinds import FILE_KINDS

        filepath, directory = self.filepath, self.directory
        names, place = [item.name for item in self.files], tuple(self.place)

        def draw(menu: bpy.types.Menu, _: bpy.types.Context) -> None:
            layout = menu.layout
            layout.operator_context = "EXEC_DEFAULT"
            for choice in choices:
                again = layout.operator(self.bl_idname, text=FILE_KINDS[choice].label)
                again.filepath, again.directory = filepath, directory
                again.use_as, again.place = choice, place
                for name in names:
                    again.files.add().name = name

        context.window_manager.popup_menu(draw, title="Use the file as")

    def _shape_lamp(
        self, scene: bpy.types.Scene, lamp: bpy.types.Object | None, path: Path
    ) -> bpy.types.Object:
        """Give a lamp, or a new one, a profile."""
        from ..uw_spectral.lamps.ies import read_ies

        sheet = read_ies(path) if path.suffix.lower() == ".ies" else None
        if lamp is None:
            lumens = _LUMENS if sheet is None else sheet.lumens
            found = lamp_rigs.add_lamp(scene, path.stem, lumens, str(path))
            found.location = self.place
        else:
            found = lamp
            getattr(found.data, stored_lamps.PROPERTY).profile = str(path)
        flux = "" if sheet is None else f", {sheet.lumens:.0f} lm by the file"
        self.report({"INFO"}, f"{found.name}: profile {path.name}{flux}")
        return found


def _active_lamp(context: bpy.types.Context) -> bpy.types.Object | None:
    from ..scene.readers.lamp_files import KINDS

    item = context.active_object
    if item is None or item.type != "LIGHT" or not item.select_get():
        return None
    return item if item.data.type in KINDS and item.data.is_editable else None


class OpenWater(ReportingOperator, ImportHelper):
    """Uses a table of a water."""

    bl_idname = "underwater.open_water"
    bl_label = "Open Water File"
    bl_description = f"Use a table of a water: {measured.CONTENT}"
    filename_ext = ".csv"
    filter_glob: bpy.props.StringProperty(default=";".join(measured.PATTERNS), options={"HIDDEN"})

    @override
    def run(self, context: bpy.types.Context) -> None:
        from ..uw_spectral.water.named import parse_water

        name = f"file:{self.filepath}"
        parse_water(name)
        water_settings(context).water = name


class OpenSensor(ReportingOperator, ImportHelper):
    """Uses a file of spectral sensitivities."""

    bl_idname = "underwater.open_sensor"
    bl_label = "Open Sensor File"
    bl_description = f"Use a file of spectral sensitivities: {sensors.FILE_CONTENT}"
    filename_ext = ".csv"
    filter_glob: bpy.props.StringProperty(
        default=";".join(sensors.FILE_PATTERNS), options={"HIDDEN"}
    )

    @override
    def run(self, context: bpy.types.Context) -> None:
        name = f"file:{self.filepath}"
        sensors.parse_sensor(name)
        water_settings(context).sensor = name


class UNDERWATER_FH_measured(bpy.types.FileHandler):  # noqa: N801 - the name is the identifier
    """Takes measured files that are dropped into a viewport."""

    bl_idname = "UNDERWATER_FH_measured"
    bl_label = "Underwater: measured file"
    bl_import_operator = UseFiles.bl_idname
    bl_file_extensions = _EXTENSIONS

    @classmethod
    def poll_drop(cls, context: bpy.types.Context) -> bool:
        """Whether what lies under the mouse is a viewport with objects."""
        area = context.area
        return area is not None and area.type == "VIEW_3D" and context.mode == "OBJECT"


register, unregister = bpy.utils.register_classes_factory((UseFiles, UNDERWATER_FH_measured))
