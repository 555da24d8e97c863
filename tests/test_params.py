from __future__ import annotations

import json
from dataclasses import dataclass, field, make_dataclass
from itertools import groupby

import numpy as np
import pytest

from viewer.backends import backend, backends
from viewer.errors import InputError
from viewer.look import COLOR_MAPS, Look, color_table
from viewer.output.legend import Marks
from viewer.params import AFFECTS, describe, param, parse, renamed


@dataclass(frozen=True)
class Example:
    size: int = param(2, "size", low=1, high=9, sweep=(1, 2))
    scale: float = param(1.5, "scale")
    on: bool = param(True, "on")
    mode: str = param("one", "mode", choices=("one", "two"), affects="speed")
    limit: float | None = param(None, "limit", type=float)


def test_values_are_parsed_by_their_declaration() -> None:
    given = {"size": "3", "scale": "2.5", "on": "off", "mode": "two", "limit": "7"}
    assert parse(Example, given) == Example(3, 2.5, False, "two", 7.0)
    assert parse(Example, {"limit": "auto"}) == Example()
    assert parse(Example, {"size": 4, "on": False, "limit": None}) == Example(size=4, on=False)


@pytest.mark.parametrize(
    ("given", "message"),
    [
        ({"sise": 1}, "unknown parameter 'sise'. Did you mean 'size'? Known: limit, mode, on, scale, size"),
        ({"size": "x"}, "'x' is not a whole number"),
        ({"size": 10}, "outside 1 to 9"),
        ({"scale": "nan"}, "'nan' is not a usable number"),
        ({"on": "maybe"}, "'maybe' is not true or false"),
        ({"mode": "three"}, "Known: one, two"),
        ({"size": True}, "'True' is not a whole number"),
        ({"size": 2.5}, "'2.5' is not a whole number"),
        ({"scale": 1e39}, "'1e+39' is not a usable number"),
        ({"scale": 10**4000}, "is not a usable number"),
        ({"scale": False}, "'False' is not a usable number"),
        ({"on": [[]]}, "'[[]]' is not true or false"),
        ({"mode": "x" * 5000}, "unknown mode 'xxx"),
    ],
)
def test_bad_values_are_explained(given: dict[str, object], message: str) -> None:
    with pytest.raises(InputError) as caught:
        parse(Example, given)
    assert message in str(caught.value)
    assert len(str(caught.value)) < 300


@pytest.mark.parametrize("name", list(backends()))
def test_backends_keep_the_contract(name: str) -> None:
    chosen = backend(name)
    assert chosen.title
    assert chosen.help.endswith(".")
    assert chosen.params() == chosen.params_class()
    for p in chosen.parameters:
        assert p.help
        assert p.affects in AFFECTS
        assert p.parse(p.default) == p.default
        for value in p.sweep:
            assert p.parse(value) == value
        for choice in p.choices:
            assert p.parse(choice) == choice
    assert all(n in ("normals", "radii", "views") for n in chosen.needs(_pose(), chosen.params()))


def _pose() -> object:
    from viewer.scan.points import PointCloud
    from viewer.scan.pose import Pose

    return Pose(0, 0.0, "", PointCloud.from_arrays([[0.0, 0, 0]]))


@dataclass(frozen=True)
class Grown:
    """A declaration with all that one may say."""

    mode: str = param("one", "mode", choices=("one", "two"), group="Passes")
    reach: float = param(
        1.0, "reach", low=0, high=9, unit="pixels", group="Passes", when={"mode": ("two",)},
        deprecated=("radius", "extent"),
    )  # fmt: skip
    rest: int = param(1, "rest", unless={"mode": ("two",)})
    fill: bool = param(True, "fill", key="H")


@pytest.mark.parametrize(
    ("fields", "message"),
    [
        ({"mode": param("one", "m", when={"sise": (1,)}), "size": param(1, "s")},
         "Wrong.mode depends on 'sise', which is not the name of another parameter. Known: size"),
        ({"size": param(1, "s", key="K")}, "Wrong.size has a keyboard shortcut, "
         "but only a parameter with two values can have one"),
        ({"a": param(True, "a", key="K"), "b": param(True, "b", key="K")},
         "Wrong.a has the key 'K', which another parameter also has"),
        ({"size": param(1, "s", deprecated=("mode",)), "mode": param("one", "m")},
         "Wrong.size has the former name 'mode', which is also a name or former name of another parameter"),
        ({"size": param(1, "s", low=2)}, "Wrong.size has an invalid default .*: size: 1 is outside"),
        ({"mode": param("one", "m", choices=("one",)), "size": param(1, "s", when={"mode": ("two",)})},
         "Wrong.size has an invalid default or condition: unknown mode 'two'"),
        ({"size": param(1, "s", units="px")}, "Wrong.size: param has no argument units"),  # type: ignore[call-arg]
        ({"size": field(default=1)}, r"Wrong.size is not declared with param\(...\)"),
        ({"size": param(1)}, r"Wrong.size has no help: declare it with param\(default, 'what it does'\)"),
        ({"size": param(1, "s", affects="all")}, "Wrong.size affects 'all', but can affect only draw"),
        ({"size": param((1, 2), "s")}, "Wrong.size has the type tuple, but must be a bool, int"),
    ],
)  # fmt: skip
def test_a_wrong_declaration_says_where(fields: dict[str, object], message: str) -> None:
    declared = [(name, type(field.default), field) for name, field in fields.items()]
    with pytest.raises(TypeError, match=message):
        describe(make_dataclass("Wrong", declared, frozen=True))


def test_a_parameter_matters_where_its_conditions_hold() -> None:
    def mattering(values: Grown) -> list[str]:
        return [p.name for p in describe(Grown) if p.matters(values)]

    assert mattering(Grown()) == ["mode", "rest", "fill"]
    assert mattering(Grown(mode="two")) == ["mode", "reach", "fill"]


def test_former_names_are_read_as_what_they_are_now() -> None:
    assert parse(Grown, {"radius": 2}) == parse(Grown, {"reach": 2}) == Grown(reach=2.0)
    assert renamed(Grown, {"extent": 2, "mode": "one"}) == {"reach": 2, "mode": "one"}
    with pytest.raises(InputError, match="outside 0 to 9"):
        parse(Grown, {"radius": 10})
    with pytest.raises(InputError, match="unknown parameter 'radius'"):
        parse(Grown, {"radius": 2, "reach": 3})


def test_a_declaration_is_told_in_full() -> None:
    told = {p.name: p.to_json() for p in describe(Grown)}
    assert told["reach"]["when"] == [{"parameter": "mode", "values": ["two"], "negated": False}]
    assert told["rest"]["when"] == [{"parameter": "mode", "values": ["two"], "negated": True}]
    assert (told["reach"]["unit"], told["reach"]["group"]) == ("pixels", "Passes")
    assert (told["reach"]["deprecated"], told["fill"]["key"]) == (["radius", "extent"], "H")
    assert json.loads(json.dumps(told)) == told


_DECLARED = {"look": Look, "marks": Marks} | {one.name: one.params_class for one in backends().values()}


@pytest.mark.parametrize("name", list(_DECLARED))
def test_declarations_are_complete(name: str) -> None:
    kind = _DECLARED[name]
    declared = {p.name: p for p in describe(kind)}
    former = [old for p in declared.values() for old in p.deprecated]
    assert len({*declared, *former}) == len(declared) + len(former)
    keys = [p.key for p in declared.values() if p.key]
    assert len(keys) == len(set(keys))
    groups = [group for group, _ in groupby(p.group for p in declared.values())]
    assert len(groups) == len(set(groups)), "the parameters of a group stand together"
    for p in declared.values():
        assert p.help
        assert not p.help.endswith(".")
        assert p.states or not p.key
        assert p.type in (int, float) or not p.unit
        for condition in p.when:
            other = declared[condition.parameter]
            assert other.name != p.name
            for value in condition.values:
                assert other.parse(value) == value


def test_unknown_backend_lists_the_known() -> None:
    with pytest.raises(InputError, match=r"unknown backend 'nerf'. Known: .*points, .*surfels"):
        backend("nerf")


@pytest.mark.parametrize("color", ["#ff 00 ", "#\uff10fffff", "#fffffff", "ffffff", "#12345\n"])
def test_what_is_no_colour_is_refused(color: str) -> None:
    with pytest.raises(InputError, match="is not a colour"):
        Look(background=color)


def test_look_is_declared_like_a_backend() -> None:
    look = parse(Look, {"light": "fixed", "eye_dome": "on", "low": "0.5", "background": "#ffffff80"})
    assert look == Look(light="fixed", eye_dome=True, low=0.5, background="#ffffff80")
    assert {p.name for p in describe(Look)} >= {"color_by", "light", "color_map"}
    with pytest.raises(InputError, match="not a colour"):
        Look(background="white")


@pytest.mark.parametrize("name", COLOR_MAPS)
def test_color_maps_are_monotonic_in_lightness(name: str) -> None:
    """Perceptually uniform maps rise or fall steadily in luminance (vik, diverging, peaks once)."""
    table = color_table(name)
    assert table.shape == (256, 4)
    luminance = table[:, :3].astype(float) @ [0.2126, 0.7152, 0.0722]
    turns = 1 if name == "vik" else 0
    steps = np.diff(luminance[::8])
    assert np.count_nonzero(np.diff(np.sign(steps[np.abs(steps) > 1]))) <= turns
