"""Forward-mode derivatives: write a formula once, get its value and its exact gradient.

A formula of numpy functions over arrays x, y, z also takes `Dual` numbers; then every
intermediate result carries its gradient along (Griewank and Walther, Evaluating Derivatives, ch. 3).
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Any

import numpy as np
from numpy.lib.mixins import NDArrayOperatorsMixin
from numpy.typing import NDArray

# ufunc -> its derivatives by each argument, from the arguments and the result; None: 1
_SLOPES: dict[np.ufunc, tuple[Callable[..., Any] | None, ...]] = {
    np.negative: (lambda a, out: -1.0,),
    np.absolute: (lambda a, out: np.sign(a),),
    np.square: (lambda a, out: 2.0 * a,),
    np.sqrt: (lambda a, out: 0.5 / out,),
    np.exp: (lambda a, out: out,),
    np.tanh: (lambda a, out: 1.0 - out * out,),
    np.sin: (lambda a, out: np.cos(a),),
    np.add: (None, None),
    np.subtract: (None, lambda a, b, out: -1.0),
    np.multiply: (lambda a, b, out: b, lambda a, b, out: a),
    np.divide: (lambda a, b, out: 1.0 / b, lambda a, b, out: -out / b),
    np.minimum: (lambda a, b, out: a <= b, lambda a, b, out: a > b),
    np.maximum: (lambda a, b, out: a >= b, lambda a, b, out: a < b),
    np.arctan2: (lambda a, b, out: b / (a * a + b * b), lambda a, b, out: -a / (a * a + b * b)),
}


class Dual(NDArrayOperatorsMixin):
    """N numbers with their gradients.

    value: (N,). slopes: the derivatives by x (0), y (1) and z (2), (N,) each; what is absent is 0.
    """

    __slots__ = ("slopes", "value")

    def __init__(self, value: NDArray, slopes: Mapping[int, NDArray]) -> None:
        self.value = value
        self.slopes = slopes

    @property
    def gradient(self) -> NDArray:
        """(3, N)."""
        return np.stack([self.slopes.get(axis, np.zeros_like(self.value)) for axis in range(3)])

    def __array_ufunc__(self, ufunc: np.ufunc, method: str, *inputs: Any, **kwargs: Any) -> Dual:
        if method != "__call__" or kwargs or ufunc not in _SLOPES:
            return NotImplemented
        values = [item.value if isinstance(item, Dual) else item for item in inputs]
        out = ufunc(*values)
        slopes: dict[int, NDArray] = {}
        for item, slope in zip(inputs, _SLOPES[ufunc], strict=True):
            if isinstance(item, Dual):
                factor = None if slope is None else slope(*values, out)
                for axis, inner in item.slopes.items():
                    term = inner if factor is None else factor * inner
                    slopes[axis] = slopes[axis] + term if axis in slopes else term
        return Dual(out, slopes)


def coordinates(points: NDArray) -> tuple[Dual, Dual, Dual]:
    """x, y and z of points (3, N), each with its own unit gradient."""
    x, y, z = (Dual(row, {axis: np.ones_like(row)}) for axis, row in enumerate(points))
    return x, y, z
