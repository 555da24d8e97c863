"""Turns a scan upright by a click on a surface that faces up, such as a floor or a table."""

from __future__ import annotations

import logging
from dataclasses import replace

from ...analysis.seen_normal import seen_normal
from ...errors import InputError
from ...geometry import up_name
from ...scan.upright import upright_camera
from ..commands import Command
from ..tool_context import Click, ToolContext

log = logging.getLogger(__name__)
TITLE = "Turn upright"


class Tool:
    """The tool that waits for a click on a surface that faces up."""

    def __init__(self, context: ToolContext) -> None:
        self.context = context

    def toggle(self) -> None:
        """Take up the tool or put it away."""
        if self.context.has_clicks:
            self.context.leave_clicks()
        else:
            self.context.take_clicks()

    def prompt(self) -> str:
        """The words that say what a click does."""
        return "Click a surface that faces up, such as a floor. Esc to stop."

    def on_click(self, click: Click) -> bool:
        """Take what was clicked to face up; raises InputError where no surface is there."""
        surface, camera = self.context.viewport.surface, self.context.document.camera
        direction = seen_normal(surface, *click.pixel) if surface and click.picked else None
        if direction is None or camera is None:
            raise InputError("No surface here: click on the scan.")
        up = up_name(direction)
        bounds = click.motion.bounds(self.context.viewport.bounds(click.pose))
        self.context.change(
            "Turn upright",
            look=replace(self.context.document.look, up=up),
            camera=upright_camera(camera, bounds, self.context.viewport.aspect, up),
            pivot=None,
            front=0.0,
        )
        self.context.leave_clicks()
        log.debug("up is %s", up)
        return True


COMMANDS: dict[str, tuple[Command, ...]] = {
    "View": (
        Command(
            "pick_up", "Set up from a surface...", lambda tool: tool.toggle(),
            is_on=lambda tool: tool.context.has_clicks,
        ),
    ),
}  # fmt: skip
