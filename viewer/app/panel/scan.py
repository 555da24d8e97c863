"""The panel's section on the scan: which one, what it holds, and what a user can say about it."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

from imgui_bundle import ImVec2, imgui
from imgui_bundle import icons_fontawesome_6 as icons

from ...backends import backend
from ...files import printable
from ...geometry import AXES
from ...output.legend import number
from ...scan.points import UNKNOWN_UNIT
from ...scan.pose import Pose
from ...scan.reading.unit import guess_unit
from ...scan.times import FPS_LIMITS
from ...scan.units import UNIT_WORDS, is_length
from .. import widgets
from ..files.rereading import Rereading
from ..files.scans import Scans, title
from ..keys import Keys
from ..part import Section, WindowPart
from ..playing.averaging import CHOICES, FrameAveraging
from ..playing.pacing import Pacing
from ..playing.playback import Playback
from ..scene.framing import Framing
from ..scene.steering import Steering
from ..session import Session
from ..ui import Ui
from .reading import words_on_assumed

_OWN = "own"  # the unit that the scan has
_PLURALS = {"m": "metres", "mm": "millimetres"}  # of the units that are guessed
_ATTRIBUTES = {"colors": "colours", "normals": "normals", "radii": "radii"}


@dataclass(eq=False)
class ScanSection(WindowPart):
    """The section, and what it shows and changes."""

    name = "scan_section"
    SECTION = Section("Scan", 10, needs_pose=False)
    scans: Scans
    session: Session
    playback: Playback
    pacing: Pacing
    averaging: FrameAveraging
    framing: Framing
    steering: Steering
    keys: Keys
    rereading: Rereading

    @property
    def mark(self) -> str:
        """Words on what Scan4D assumes about the scan and can change a number."""
        return words_on_assumed(self.rereading.record)

    def panel(self, ui: Ui) -> None:
        """Declare it."""
        if len(self.scans.listed) > 1:
            self._draw_scans()
        else:
            room = imgui.get_content_region_avail().x
            imgui.text_unformatted(widgets.fitted(title(self.session.scan), room))
            widgets.tooltip(printable(self.session.scan))
        if self.playback.pose is not None:
            self._draw_facts(self.playback.pose)
            self._draw_unit(self.playback.pose)
            self._draw_rate()
            self._draw_average()
            self._draw_up()

    def _draw_scans(self) -> None:
        """Declare the list of scans, and buttons to the one before and the next."""
        gap = imgui.get_style().item_inner_spacing.x
        for icon, step, name in (
            (icons.ICON_FA_CHEVRON_LEFT, -1, "previous"), (icons.ICON_FA_CHEVRON_RIGHT, 1, "next"),
        ):  # fmt: skip
            hint = self.keys.of[f"{name}_scan"]
            if widgets.icon_button(icon, f"{name.capitalize()} scan" + (f" ({hint})" if hint else "")):
                self.scans.step(step)
            imgui.same_line(0, gap)
        imgui.set_next_item_width(-1)
        room = imgui.get_content_region_avail().x - 2 * imgui.get_frame_height()
        if imgui.begin_combo("##scan", widgets.unhidden(widgets.fitted(title(self.session.scan), room))):
            for number, (name, act, is_open) in enumerate(self.scans.items(self.scans.listed)):
                if imgui.selectable(widgets.labelled(name, number), is_open)[0]:
                    act()
            imgui.end_combo()
        widgets.tooltip(printable(self.session.scan))

    def _draw_facts(self, pose: Pose) -> None:
        dropped = f" ({pose.dropped:,} dropped)" if pose.dropped else ""
        widgets.fact("Points", f"{pose.count:,}{dropped}")
        bounds = self.framing.bounds(pose)
        scale = self.playback.scale
        edges = scale.factor * (bounds.high - bounds.low)
        size = " x ".join(number(edge, edge) for edge in edges)
        widgets.fact("Size", f"{size} {scale.unit}")
        widgets.fact("Stored", _stored(pose))
        if estimated := _estimated(pose, *self.session.document.chosen(pose)):
            widgets.fact("Estimated", ", ".join(estimated))
            widgets.tooltip(
                "The renderer needs data that the scan does not store: Scan4D estimates them from the points"
            )

    def _draw_unit(self, pose: Pose) -> None:
        """Declare what chooses the unit of length, a guess where nobody has stated it, and what lengths are
        shown in."""
        stated, document = self.playback.timeline.unit, self.session.document
        own = "not set" if stated == UNKNOWN_UNIT else f"{stated} (from file)"
        names = [*UNIT_WORDS, *([document.unit] if document.unit and document.unit not in UNIT_WORDS else [])]
        titles = {_OWN: own} | {name: UNIT_WORDS.get(name, name) for name in names}
        widgets.label(
            "Scan unit",
            "The length of one unit of the scan's coordinates. Scan4D remembers the unit for this scan.",
        )
        chosen = widgets.combo("unit", document.unit or _OWN, list(titles), titles)
        guess = guess_unit(self.framing.bounds(pose), document.look.up)
        if stated == UNKNOWN_UNIT and document.unit is None and guess is not None:
            widgets.label("")
            if imgui.button(widgets.labelled(f"Set to {_PLURALS[guess[0]]}?", "accept"), ImVec2(-1, 0)):
                chosen = guess[0]
            widgets.tooltip(
                f"With the unit {guess[0]}, the scan has the size of {guess[1]}. Click to set this unit."
            )
        if chosen != (document.unit or _OWN):
            self.session.change("Set the unit", unit=None if chosen == _OWN else chosen)
        if not is_length(self.playback.unit):
            return
        shown = {_OWN: UNIT_WORDS.get(self.playback.unit, self.playback.unit)}
        shown |= {name: word for name, word in UNIT_WORDS.items() if name != self.playback.unit}
        now = self.playback.scale.unit if self.playback.scale.unit != self.playback.unit else _OWN
        widgets.label("Show lengths in", "Unit of all lengths in the window and in saved tables")
        wanted = widgets.combo("shown_unit", now, list(shown), shown)
        if wanted != now:
            self.session.change(
                "Show lengths in another unit",
                shown_unit=None if wanted == _OWN else wanted,
            )

    def _draw_rate(self) -> None:
        """Declare how fast frames follow each other, and what changes that where nothing measured does."""
        pacing = self.pacing
        if len(self.playback.timeline) == 1:
            return
        if not pacing.can_change:
            by = (
                "set on the command line"
                if pacing.is_stated
                else self.playback.timeline.reading["times"].shown_source
            )
            widgets.fact("Rate", f"{pacing.rate:.4g} Hz, {by}")
            return
        widgets.label(
            "Frame rate",
            "Frames per second of the scan. Press Enter to set the rate. Scan4D remembers the rate for "
            "this scan.",
        )
        entered, rate = imgui.input_float(
            "##rate", pacing.rate, format="%.4g Hz", flags=imgui.InputTextFlags_.enter_returns_true.value
        )
        if entered and FPS_LIMITS[0] <= rate <= FPS_LIMITS[1]:
            pacing.choose(float(f"{rate:.6g}"))
        if pacing.has_names:
            by_names = self.session.document.times_by_names
            changed, wanted = imgui.checkbox("Times from file names", by_names)
            widgets.tooltip("Read the time of each frame from its file name")
            if changed:
                pacing.use_names(wanted)

    def _draw_average(self) -> None:
        """Declare how many frames count for the average of a point, and how much of the frame is averaged."""
        if len(self.playback.timeline) == 1:
            return
        averaging, document = self.averaging, self.session.document
        widgets.label(
            "Average frames",
            "Reduces noise: each point that stands still becomes the mean of its last frames. Points that "
            "move stay as scanned. Measures use the points as scanned, unless you choose otherwise.",
        )
        frames = sorted({*CHOICES, document.average})
        titles = {str(count): f"last {count}" if count else "off" for count in frames}
        chosen = widgets.combo("average", str(document.average), list(titles), titles)
        if int(chosen) != document.average:
            averaging.choose(int(chosen))
        if not document.average:
            return
        widgets.faint(averaging.words)
        changed, wanted = imgui.checkbox("Measure on averaged points", document.measure_averaged)
        widgets.tooltip(
            "Clicks place landmarks and distances on the averaged points, and the labels of such distances "
            "say so. Tracking and areas use the points as scanned."
        )
        if changed:
            averaging.measure(wanted)

    def _draw_up(self) -> None:
        pose, now = self.playback.pose, self.session.document.look.up
        why = f": {pose.upright.why}" if pose and pose.upright.up == now else ""
        widgets.label("Up", f"The axis of the scan that points up{why}. Scan4D measures heights along it.")
        chosen = widgets.combo("up", now, tuple(AXES), {} if now in AXES else {now: "custom"})
        if chosen != now:
            self.steering.set_up(chosen)


def _stored(pose: Pose) -> str:
    """Words on what the scan has stored of each point."""
    cloud = pose.overview
    names = [words for name, words in _ATTRIBUTES.items() if getattr(cloud, name) is not None]
    names += [printable(name) for name in cloud.scalars]
    views = len(pose.views)
    kind = f"{views} range image{'s' if views > 1 else ''}" if views else "positions"
    return ", ".join([kind, *names])


def _estimated(pose: Pose, name: str, params: Any) -> list[str]:
    """Attributes that a renderer uses and the pose does not store: estimated, or found as it draws."""
    drawn_by = backend(name)
    used = {*drawn_by.needs(pose, params), *(["normals"] if drawn_by.finds_normals else [])} - {"views"}
    return sorted(_ATTRIBUTES.get(one, one) for one in used if getattr(pose.overview, one) is None)
