"""A pytest plugin: the quick run draws each value of each parameter, and not each combination of them.

A test that draws and has several parameters is a product of renderers, feeds, cameras or scenes. The quick
run takes as many of its combinations as each value needs to be among them. The others are slow. The same
holds for any test that is marked with `each_value`.
"""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Hashable, Sequence, Set

import pytest


@pytest.hookimpl(tryfirst=True)  # before -m chooses
def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    """Mark as slow what repeats the values of others."""
    tests: defaultdict[tuple[object, ...], list[pytest.Function]] = defaultdict(list)
    for item in items:
        if isinstance(item, pytest.Function) and _is_product(item) and not item.get_closest_marker("slow"):
            tests[item.path, item.cls, item.originalname].append(item)
    for combinations in tests.values():
        quick = representatives([_values(item) for item in combinations])
        for number, item in enumerate(combinations):
            if number not in quick:
                item.add_marker(pytest.mark.slow)


def _is_product(item: pytest.Function) -> bool:
    """Whether the quick run takes each value of a test's parameters once."""
    draws = "renderer" in item.fixturenames
    return hasattr(item, "callspec") and (draws or item.get_closest_marker("each_value") is not None)


def _values(item: pytest.Function) -> set[Hashable]:
    """A value for each list of parameters. Parameters that are listed together are one value."""
    params = item.callspec.params
    lists = [mark.args[0] for mark in item.iter_markers("parametrize")]
    names = [each.replace(",", " ").split() if isinstance(each, str) else each for each in lists]
    others = [[name] for name in params if not any(name in together for together in names)]  # of fixtures
    return {tuple((name, id(params[name])) for name in together) for together in [*names, *others]}


def representatives(combinations: Sequence[Set[Hashable]]) -> set[int]:
    """Numbers of combinations of values such that each value is in one of them.

    Takes the first of the combinations with the most values that are missing, as long as there is one.
    """
    missing = [set(values) for values in combinations]
    chosen: set[int] = set()
    while any(missing):
        best = max(range(len(missing)), key=lambda number: len(missing[number]))
        chosen.add(best)
        found = set(missing[best])
        for values in missing:
            values -= found
    return chosen
