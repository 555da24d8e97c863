"""The window's tools: a folder or file each in this folder, or in another package (viewer/extensions.py).

A tool is what a user takes up to work on a scan.

A tool's module has

    a docstring         its first line says what the tool does
    TITLE               its name, which its section in the panel has
    Tool                a class, made with a `ToolContext` (viewer/app/tool_context.py) when the window opens

and, where it has some,

    COMMANDS            title of a menu -> entries of that menu (see viewer/app/commands.py), whose functions
                        take the Tool; those with a `short` title stand on the toolbar
    RANK                the place of its section among those of tools: lower ones stand first; default 0
    MOUSE               (how, what) of the mouse, for the list of keys
    Settings            a frozen dataclass (see viewer/params.py) of what comes back at the next start, as
                        `context.settings`

The Tool has any of

    panel(ui)               declares its section of the panel
    overlay(canvas, view)   draws over the picture
    drawn(frame)            the `DrawnMarks` over a frame, by its index, of pictures that are saved: as its
                            overlay shows it there
    below(ui)               declares what it shows under the timeline, while `is_below()` is true
    is_bare()               whether that is a few words only: the drawer is then as low as they are
    dialog()                declares windows of its own, over everything
    prompt()                what to say at the top of the view while it has the clicks
    on_click(click)         a click in the view while it has the clicks (`context.take_clicks`); False: the
                            tool does not take it, and a double click turns the view about that position
    on_press(mouse)         the left button goes down in the view while it has the clicks, at a position on
                            the screen; True: a drag from there is its own, and does not move the view
    on_drag(click, ends)    a drag of its own has come to what `click` tells, without its spacing; ends: the
                            button is let go of there, and the click has all. Without a move it is a click
    on_arrow(right, up)     an arrow key was pressed while it has the clicks, each -1, 0 or 1; True: it is
                            taken, and goes to no other frame
    spans()                 the `FrameSpan`s to mark on the timeline
    on_file(path)           a file was opened or dropped; True: it is this tool's, and no scan
    on_escape()             Escape was pressed; True: that has ended something
    is_under_way()          whether something has begun that is in no document yet: undo takes that back first
    abandon()               let go of it: for undo, and since another scan or document is shown from now on
    advance(budget)         each turn of the window's loop, for so many milliseconds at most; True: to be
                            drawn, and called again at once

What a user would be sorry to lose is in the document (`context.document`, `context.change`), what is under
way in the Tool. A tool that raises, or leaves widgets begun, is reported and switched off until the next
start, all else goes on; only an InputError in a command, a click, a widget of `panel` or `dialog` or in what
was run beside the window is the user's mistake, and reported alone. Names that begin with an underscore are
no tools. No other list of tools exists.
"""

from __future__ import annotations

from ...extensions import extensions_of, names_in


def tool_names() -> tuple[str, ...]:
    """The names of all tools: Scan4D's own in alphabetical order, then those of other packages."""
    return tuple(tool_modules())


def tool_modules() -> dict[str, str]:
    """Name -> dotted name of the module, of all tools. None is imported."""
    own = {name: f"{__name__}.{name}" for name in names_in(__path__)}
    return own | {each.name: each.module for each in extensions_of("tools", own)}
