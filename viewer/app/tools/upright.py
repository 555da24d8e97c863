"""Turns a scan upright by a click on a surface that faces up, such as a floor or a table."""

from __future__ import annotations

import logging
from dataclasses import replace

from ...analysis.seen_normal import seen_normal
from ...errors import InputError
from ...geometry import up_name
from ...scan.upright import upright_camera
from ..commands import Command
from ..desk import Click, Desk

log = logging.getLogger(__name__)
TITLE = "Turn upright"


class Tool:
    """The tool that waits for a click on a surface that faces up."""

    def __init__(self, desk: Desk) -> None:
        self.desk = desk

    def toggle(self) -> None:
        """Take up the tool or put it away."""
        if self.desk.has_clicks:
            self.desk.leave_clicks()
        else:
            self.desk.take_clicks()

    def prompt(self) -> str:
        """The words that say what a click does."""
        return "Click a surface that faces up, such as a floor. Esc to stop."

    def on_click(self, click: Click) -> bool:
        """Take what was clicked to face up; raises InputError where no surface is there."""
        surface, camera = self.desk.viewport.surface, self.desk.document.camera
        direction = seen_normal(surface, *click.pixel) if surface and click.picked else None
        if direction is None or camera is None:
            raise InputError("No surface here: click on the scan.")
        up = up_name(direction)
        bounds = click.motion.bounds(self.desk.viewport.bounds(click.pose))
        self.desk.change(
            "Turn upright",
            look=replace(self.desk.document.look, up=up),
            camera=upright_camera(camera, bounds, self.desk.viewport.aspect, up),
            pivot=None,
            front=0.0,
        )
        self.desk.leave_clicks()
        log.debug("up is %s", up)
        return True


COMMANDS: dict[str, tuple[Command[Tool], ...]] = {
    "View": (
        Command(
            "pick_up", "Set up from a surface...", lambda tool: tool.toggle(),
            is_on=lambda tool: tool.desk.has_clicks,
        ),
    ),
}  # fmt: skip
