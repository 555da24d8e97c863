"""The quick run takes each value of each parameter of a product."""

from __future__ import annotations

import itertools

import pytest
from representatives import representatives

pytest_plugins = ["pytester"]
DRAWS = """
import pytest

@pytest.fixture(params=["one", "other"])
def renderer(request):
    return request.param

@pytest.mark.parametrize("feed", ["a", "b", "c"])
@pytest.mark.parametrize(("x", "y"), [(1, 2), (1, 3), pytest.param(4, 4, marks=pytest.mark.slow)])
def test_product(renderer, feed, x, y):
    pass

@pytest.mark.parametrize("feed", ["a", "b", "c"])
@pytest.mark.parametrize("x", [1, 2])
def test_that_draws_nothing(feed, x):
    pass
"""


def test_each_value_is_in_a_combination_and_few_are_taken() -> None:
    combinations = [{("x", x), ("y", y), ("z", z)} for x, y, z in itertools.product("abcd", "efg", "hi")]
    chosen = representatives(combinations)
    assert set().union(*(combinations[number] for number in chosen)) == set().union(*combinations)
    assert len(chosen) == 4
    assert representatives([]) == set()


def test_the_rest_of_a_product_is_slow(pytester: pytest.Pytester) -> None:
    pytester.makepyfile(DRAWS)
    pytester.makeini("[pytest]\nmarkers =\n    slow: slow\n    each_value: each value")
    every = ["-p", "representatives", "-p", "no:cacheprovider", "-q", "--collect-only"]
    quick = pytester.runpytest_inprocess(*every, "-m", "not slow").stdout.lines
    drawn = [line.partition("[")[2] for line in quick if "test_product" in line]
    assert {word for line in drawn for word in line.rstrip("]").split("-")} == {*"abc123", "one", "other"}
    assert {"1-2", "1-3"} == {"-".join(line.rstrip("]").split("-")[1:3]) for line in drawn}
    assert len(drawn) == 3
    assert sum("test_that_draws_nothing" in line for line in quick) == 6
    whole = pytester.runpytest_inprocess(*every).stdout.lines
    assert sum("test_product" in line for line in whole) == 18
