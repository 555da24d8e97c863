"""Texts that files bring do no harm in labels and formats: each gets there through one function."""

from __future__ import annotations

import ast
import re
from collections.abc import Iterator
from pathlib import Path
from types import ModuleType

import pytest
from imgui_bundle import ImVec2, imgui, implot

from viewer.app import widgets

APP = Path(widgets.__file__).parent
MODULES = {"imgui": imgui, "implot": implot}
FORMATS = {"format", "format_max", "float_format"}  # parameters that ImGui reads memory by
LABELS = {"label", "str_id", "name", "label_id", "title_id", "preview_value", "overlay"}  # that end at "##"
GUARDS = {"format": {"number_format"}, "label": {"labelled", "unhidden", "id"}}
# Texts that stand in the program.
DECLARED = {
    "menu.title",
    "entry.title",
    "entry.name",
    "parameter.name",
    "parameter.group",
    "options.rest",
    "section.title",
}
HOSTILE = "%s%s%s%s%s%s%n##hidden###other"


def parameters(module: ModuleType, function: str) -> list[list[str]]:
    """The names of the parameters of each form of a function of ImGui, as its binding has them."""
    forms = getattr(getattr(module, function, None), "__nb_signature__", ())
    return [re.findall(r"[(,] ?(\w+): ", signature) for signature, *_ in forms]


def is_format(module: str, name: str) -> bool:
    return name in FORMATS or (module == "implot" and name == "fmt")


def texts(tree: ast.AST) -> Iterator[tuple[str, ast.expr, ast.AST]]:
    """What calls of ImGui in a module have as "format" or "label", and the function that each stands in."""
    for scope in ast.walk(tree):
        if isinstance(scope, ast.FunctionDef):
            for call in ast.walk(scope):
                if isinstance(call, ast.Call) and isinstance(call.func, ast.Attribute):
                    yield from ((kind, text, scope) for kind, text in texts_of(call, call.func))


def texts_of(call: ast.Call, function: ast.Attribute) -> Iterator[tuple[str, ast.expr]]:
    module = function.value.id if isinstance(function.value, ast.Name) else ""
    if module in MODULES:
        for names in parameters(MODULES[module], function.attr):
            given = dict(zip(names, call.args, strict=False)) | {one.arg: one.value for one in call.keywords}
            for name, text in given.items():
                if name and (is_format(module, name) or name in LABELS):
                    yield ("format" if is_format(module, name) else "label"), text


def is_guarded(text: ast.expr, kind: str, scope: ast.AST) -> bool:
    """Whether a text stands in the program, or comes from what guards it. Of what a function is given, nobody
    can tell that here."""
    if isinstance(text, ast.Call):
        return ast.unparse(text.func).rpartition(".")[2] in GUARDS[kind]
    if isinstance(text, ast.JoinedStr):
        return kind == "label" and all(is_guarded(part, kind, scope) for part in shown_parts(text))
    if isinstance(text, ast.FormattedValue):
        is_number = text.format_spec is not None
        return is_number or (is_guarded(text.value, kind, scope) and not is_given(text.value, scope))
    if isinstance(text, ast.IfExp):
        return is_guarded(text.body, kind, scope) and is_guarded(text.orelse, kind, scope)
    if isinstance(text, ast.Subscript):
        return is_guarded(text.value, kind, scope)
    if isinstance(text, ast.List | ast.Tuple):
        return all(is_guarded(one, kind, scope) for one in text.elts)
    if isinstance(text, ast.Attribute):
        return ast.unparse(text) in DECLARED or ast.unparse(text.value) == "icons"
    if isinstance(text, ast.Name) and kind == "label":
        return all(is_guarded(one, kind, scope) for one in assigned(text.id, scope))
    return isinstance(text, ast.Constant)


def shown_parts(text: ast.JoinedStr) -> Iterator[ast.expr]:
    """The parts of a label before "##", what follows being its name."""
    for part in text.values:
        if isinstance(part, ast.Constant) and "##" in part.value:
            return
        yield part


def assigned(name: str, scope: ast.AST) -> list[ast.expr]:
    """What a function assigns to a name."""
    several = [one for one in ast.walk(scope) if isinstance(one, ast.Assign)]
    return [one.value for one in several if name in map(ast.unparse, one.targets)]


def is_given(text: ast.expr, scope: ast.AST) -> bool:
    """Whether a text is a name that a function does not assign, and no constant of the module."""
    return isinstance(text, ast.Name) and not text.id.lstrip("_").isupper() and not assigned(text.id, scope)


def unguarded(source: str) -> list[str]:
    return [
        f"{text.lineno}: {kind} {ast.unparse(text)}"
        for kind, text, scope in texts(ast.parse(source))
        if not is_guarded(text, kind, scope)
    ]


def test_no_text_of_a_file_is_a_format_or_a_label_as_it_is() -> None:
    found = {str(path.relative_to(APP)): unguarded(path.read_text()) for path in APP.rglob("*.py")}
    assert not {path: told for path, told in found.items() if told}


@pytest.mark.parametrize(
    "call",
    [
        'imgui.drag_float("##a", 1.0, 0.1, 0.0, 1.0, f"%.3g {unit}")',
        'imgui.slider_float("##a", 1.0, 0.0, 1.0, format=unit)',
        'imgui.input_float("##a", 1.0, 0, 0, "%g " + unit)',
        "implot.setup_axis_format(0, unit)",
        'imgui.selectable(f"{unit}##3", True)',
        "imgui.button(scan.name)",
        "words = printable(unit); imgui.button(words)",
    ],
)
def test_such_calls_are_found(call: str) -> None:
    assert len(unguarded(f"def draw(unit):\n    {call}\n")) == 1


def test_what_is_guarded_is_not() -> None:
    calls = (
        'imgui.drag_float("##a", 1.0, 0.1, 0.0, 1.0, widgets.number_format("%.3g", unit))',
        'imgui.button(widgets.labelled(unit, "press"))',
    )
    assert not unguarded("def draw(unit):\n    " + "; ".join(calls) + "\n")


@pytest.fixture
def frame() -> Iterator[None]:
    """A frame of ImGui that nothing shows."""
    context = imgui.create_context()
    io = imgui.get_io()
    io.set_ini_filename("")
    io.display_size = ImVec2(800, 600)
    io.backend_flags |= imgui.BackendFlags_.renderer_has_textures.value
    imgui.new_frame()
    imgui.begin("window")
    yield
    imgui.end()
    imgui.end_frame()
    imgui.destroy_context(context)


@pytest.mark.usefixtures("frame")
def test_a_unit_is_shown_as_it_is_beside_its_number() -> None:
    """Formats as they were ended the process here."""
    format = widgets.number_format("%.3g", HOSTILE)
    imgui.drag_float("##drag", 1.5, 0.1, 0.0, 9.0, format)
    imgui.slider_float("##slider", 1.5, 0.0, 9.0, format)
    imgui.input_float("##input", 1.5, 0, 0, format)
    imgui.slider_int("##whole", 1, 0, 9, widgets.number_format("%d", HOSTILE))
    assert format % 1.5 == f"1.5 {HOSTILE}"
    assert widgets.number_format("%.3g") % 1.5 == "1.5"


@pytest.mark.usefixtures("frame")
def test_texts_of_imgui_are_no_formats() -> None:
    """As the bindings have it; a change of them has to be known."""
    imgui.text_unformatted(HOSTILE)
    wide = imgui.get_item_rect_size().x
    for show in (imgui.text, imgui.text_disabled):
        show(HOSTILE)
        assert imgui.get_item_rect_size().x == wide
    imgui.set_tooltip(HOSTILE)
    imgui.tree_node(HOSTILE)


@pytest.mark.usefixtures("frame")
def test_a_label_shows_all_of_its_text_and_has_its_own_name() -> None:
    label = widgets.labelled(HOSTILE, "press")
    visible = imgui.calc_text_size(label, hide_text_after_double_hash=True).x
    assert visible == imgui.calc_text_size(HOSTILE.replace("#", "#\u200b")).x
    assert imgui.get_id(label) == imgui.get_id("###press")
    assert imgui.get_id(widgets.labelled("a", HOSTILE)) != imgui.get_id(widgets.labelled("a", "other"))
