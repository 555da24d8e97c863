"""What is measured: every value that is declared, one thing at a time."""

from __future__ import annotations

from dataclasses import asdict

import pytest

from viewer.backends import backends
from viewer.bench.plan import Contender, plan
from viewer.errors import InputError

NAMES = list(backends())


def test_every_swept_value_is_tried_alone() -> None:
    (group,) = plan(["bunny"], NAMES, counts=(), noises=())
    for name, backend in backends().items():
        defaults = asdict(backend.params())
        rows = [c for c in group.contenders if c.backend == name]
        assert rows[0] == Contender(name, backend.params())
        swept = [p for p in backend.parameters if p.sweep and p.matters(backend.params())]
        tried: dict[str, set[object]] = {p.name: {p.default} for p in swept}
        for row in rows[1:]:
            changed = {key: value for key, value in asdict(row.params).items() if value != defaults[key]}
            assert list(changed) == [row.sweep]
            tried[row.sweep].add(changed[row.sweep])
        assert tried == {p.name: {p.default, *p.sweep} for p in swept}


def test_a_parameter_that_has_no_effect_beside_the_defaults_is_not_swept() -> None:
    (group,) = plan(["bunny"], ["hpr"], counts=(), noises=())
    swept = {contender.sweep for contender in group.contenders}
    assert "output" in swept
    assert not swept & {"quality", "depth", "longest"}, "they matter in other modes and outputs alone"


def test_floor_and_ceiling_are_in_every_group() -> None:
    for group in plan(["torus", "bunny", "torus-simulated"], NAMES):
        assert [c.backend for c in group.contenders][:2] == ["gl-points", "mesh"]


def test_counts_and_noise_vary_on_two_scenes_each() -> None:
    scenes = ["sphere", "torus", "bunny", "dragon-scans", "dragon", "torus-simulated", "bunny-simulated"]
    groups = plan(scenes, NAMES, counts=(10, 20), noises=(0.0, 3.0))
    assert [(g.scene, g.count) for g in groups if g.sweep == "n"] == [
        ("torus", 10), ("torus", 20), ("dragon", 10), ("dragon", 20)
    ]  # fmt: skip
    noisy = {(g.scene, g.noise) for g in groups if g.sweep == "noise"}
    assert noisy == {(s, v) for s in ("torus-simulated", "bunny-simulated") for v in (0.0, 3.0)}
    assert all(not c.sweep for g in groups if g.sweep for c in g.contenders)


def test_what_is_usual_for_a_scene_is_measured_once() -> None:
    groups = plan(["torus", "torus-simulated"], NAMES, counts=(100_000, 20), noises=(0.5, 1.0))
    assert [(g.count, g.noise) for g in groups] == [(None, None), (None, None), (20, None), (None, 1.0)]


def test_parameters_may_be_swept_on_some_scenes_only() -> None:
    first, second = plan(["sphere", "torus"], NAMES, counts=(), noises=(), swept_scenes=1)
    assert len(first.contenders) > len(second.contenders) == 2 + len(NAMES)


def test_an_unknown_backend_is_told() -> None:
    with pytest.raises(InputError, match="nerf"):
        plan(["sphere"], ["nerf"])
