"""Error of a picture against the truth: numbers by the names of docs/developing/benchmark.md.

Functions over arrays; nothing here draws. What is undefined, as the mean of no pixels, is NaN.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

WRONG_LAYER = 4.0  # steps between two depths that are of two sheets
_COUNTS = ("false_positives", "false_negatives", "correct")
_WINDOW = 11  # pixels, of SSIM
_REACH = 10  # pixels to each side that a pixel of the FLIP map depends on; SSIM: 5

Errors = dict[str, float]
Mask = NDArray[np.bool_]


def coverage(drawn: Mask, true: Mask) -> Errors:
    """Holes, spill and distance of the outlines of two silhouettes, (H, W) bool.

    Holes that are wholly inside the true silhouette have no part in the outline: they are counted already.
    How far spill reaches is 0 where there is none.
    """
    box = _box(drawn | true, 1)  # an outline's pixel has a neighbour outside
    drawn, true = drawn[box], true[box]
    area = _count(true)
    outline, true_outline = _outline(drawn | _enclosed(~drawn, true)), _outline(true)
    distances = np.concatenate([_distance(true_outline)[outline], _distance(outline)[true_outline]])
    spill = drawn & ~true
    return {
        "hole_percent": _percent(_count(true & ~drawn), area),
        "spill_percent": _percent(_count(spill), area),
        "spill_p95": _quantile(_distance(true)[spill], 0.95) if spill.any() else 0.0,
        "boundary_mean": _mean(distances),
        "boundary_p95": _quantile(distances, 0.95),
    }


def slits(drawn: Mask, true: Mask) -> float:
    """The share of the true silhouette, percent, that is empty in a picture and does not reach its outline:
    gaps within the subject. drawn, true: (H, W)."""
    box = _box(drawn | true, 1)
    drawn, true = drawn[box], true[box]
    return _percent(_count(_enclosed(~drawn, true)), _count(true))


def depth(
    drawn: NDArray[np.floating],
    true: NDArray[np.floating],
    footprint: NDArray[np.floating],
    step: float | NDArray[np.floating],
) -> Errors:
    """Depth errors where both pictures show something, in scan units and (`_px`) in pixel footprints.

    drawn, true: (H, W), +inf where nothing is. footprint: (H, W), of a pixel at the true depth, scan units.
    step: how far depths of one sheet may lie apart, scan units, one number or (H, W).
    """
    both = np.isfinite(drawn) & np.isfinite(true)
    error = drawn[both].astype(np.float64) - true[both]
    step = np.broadcast_to(step, both.shape)[both]
    errors: Errors = {}
    for unit, values in (("", error), ("_px", error / footprint[both])):
        size = np.abs(values)
        errors |= {
            f"depth_bias{unit}": _mean(values),
            f"depth_rmse{unit}": float(np.sqrt(_mean(values**2))),
            f"depth_median{unit}": _quantile(size, 0.5),
            f"depth_p95{unit}": _quantile(size, 0.95),
        }
    limit, area = WRONG_LAYER * step, _count(np.isfinite(true))
    return errors | {
        "wrong_layer_percent": _percent(_count(np.abs(error) > limit), len(error)),
        "through_percent": _percent(_count(error > limit), area),
        "closed_percent": _percent(_count(error <= limit), area),
    }


def normals(drawn: NDArray[np.floating], true: NDArray[np.floating]) -> Errors:
    """Angles in degrees between normals (..., 3) where both pictures have one that is not zero.

    Unsigned, as if a normal and its opposite were the same, and signed.
    """
    angle = angles_between(drawn, true)
    signed = angle[np.isfinite(angle)]
    errors: Errors = {}
    for kind, values in (("", np.minimum(signed, 180 - signed)), ("_signed", signed)):
        errors |= {
            f"normal{kind}_mean": _mean(values),
            f"normal{kind}_median": _quantile(values, 0.5),
            f"normal{kind}_p95": _quantile(values, 0.95),
        }
    return errors


def angles_between(a: NDArray[np.floating], b: NDArray[np.floating]) -> NDArray[np.float64]:
    """Angles 0..180 in degrees between vectors (..., 3); NaN where one is zero or not finite."""
    usable = np.isfinite(a).all(axis=-1) & np.isfinite(b).all(axis=-1) & a.any(axis=-1) & b.any(axis=-1)
    u, v = a[usable].astype(np.float64), b[usable].astype(np.float64)
    out = np.full(usable.shape, np.nan)
    # Exact near 0 and 180, where the arc cosine is not.
    out[usable] = np.degrees(np.arctan2(np.linalg.norm(np.cross(u, v), axis=1), (u * v).sum(axis=1)))
    return out


def color(drawn: NDArray[np.uint8], true: NDArray[np.uint8], inside: Mask) -> Errors:
    """PSNR (dB), SSIM and FLIP of shaded pictures (H, W, 3 or 4), over `inside` (H, W) and the frame.

    SSIM is NaN for pictures smaller than its window of 11 pixels, FLIP where its package is not installed.
    """
    drawn, true = drawn[..., :3], true[..., :3]
    squares = ((drawn.astype(np.float64) - true) ** 2).mean(axis=2)
    # Beyond the reach of a difference SSIM is exactly 1 and FLIP 0. Twice the reach, so that what lies
    # within it looks at no more than it would in the whole picture.
    box = _box(squares > 0, 2 * _REACH)
    maps = {"ssim": _ssim(drawn, true, box), "flip": _flip(drawn, true, box)}
    errors = {"psnr": _psnr(squares[inside]), "psnr_frame": _psnr(squares)}
    for name, values in maps.items():
        errors |= {name: _mean(values[inside]), f"{name}_frame": _mean(values)}
    return errors


def scanned(drawn: Mask, image: NDArray[np.uint8], true: NDArray[np.uint8], inside: Mask) -> Errors:
    """Holes and PSNR (dB) where the scan has measured what is seen, `inside` (H, W).

    drawn: (H, W), what is covered. image, true: shaded pictures (H, W, 3 or 4).
    """
    squares = (image[inside, :3].astype(np.float64) - true[inside, :3]) ** 2
    return {
        "hole_scanned_percent": _percent(_count(inside & ~drawn), _count(inside)),
        "psnr_scanned": _psnr(squares),
    }


def visibility(found: Mask, true: Mask) -> Errors:
    """Points (N,) bool that were found visible, against those that are (Machado e Silva 2014)."""
    false_positives = _count(found & ~true)
    false_negatives = _count(~found & true)
    correct = len(true) - false_positives - false_negatives
    return {
        "false_positives": false_positives,
        "false_negatives": false_negatives,
        "correct": correct,
        "visibility_error_percent": _percent(false_positives + false_negatives, correct),
    }


def flicker(
    drawn: tuple[dict[str, Any], dict[str, Any]],
    true: tuple[dict[str, Any], dict[str, Any]],
    pixels: tuple[NDArray[np.intp], NDArray[np.intp]],
) -> Errors:
    """The change from one frame to the next that is not in the truth, at surface points both frames see.

    drawn, true: two frames each, with "image", (H, W, 3 or 4) uint8, and "normal", (H, W, 3). pixels: the
    same surface points in the first and the second frame, indices into H * W (`reference.both_see`).
    Colour in parts of full scale, normals in degrees where both frames have one.
    """
    drawn_color, drawn_normal = _changes(drawn, pixels)
    true_color, true_normal = _changes(true, pixels)
    both = np.isfinite(drawn_normal) & np.isfinite(true_normal)
    return {
        "flicker_color": _mean(drawn_color) - _mean(true_color),
        "flicker_normal": _mean(drawn_normal[both]) - _mean(true_normal[both]),
    }


def aggregate(by_view: Mapping[str, Sequence[float]]) -> Errors:
    """The errors of several views as one, by the section "Aggregate" of docs/developing/benchmark.md.

    by_view: for each error its value in every view, NaN where it is undefined there.
    """
    errors: Errors = {}
    for name, values in by_view.items():
        if name in _COUNTS:
            errors[name] = sum(values)
        elif name.startswith("psnr"):
            errors[name] = _psnr(_defined(255**2 * 10 ** (-np.asarray(values, np.float64) / 10)))
        elif name.startswith("depth_rmse"):
            errors[name] = float(np.sqrt(defined_mean(np.square(values))))
        else:
            errors[name] = defined_mean(values)
    if "visibility_error_percent" in errors:
        wrong = errors["false_positives"] + errors["false_negatives"]
        errors["visibility_error_percent"] = _percent(wrong, errors["correct"])
    return errors


def defined_mean(values: ArrayLike) -> float:
    """The mean of the values that are not NaN; NaN where all are."""
    return _mean(_defined(np.asarray(values, np.float64)))


def _changes(
    frames: tuple[dict[str, Any], dict[str, Any]], pixels: tuple[NDArray[np.intp], NDArray[np.intp]]
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Absolute change of colour and of normal at each pair of pixels."""
    before, after = (
        (
            frame["image"].reshape(-1, frame["image"].shape[-1])[at, :3] / 255,
            frame["normal"].reshape(-1, 3)[at],
        )
        for frame, at in zip(frames, pixels, strict=True)
    )
    return np.abs(after[0] - before[0]).mean(axis=1), angles_between(before[1], after[1])


def _enclosed(holes: Mask, true: Mask) -> Mask:
    """Connected parts of `holes` that lie wholly in `true`."""
    from scipy import ndimage

    labels, count = ndimage.label(holes)
    reaching_out = np.zeros(count + 1, bool)
    reaching_out[labels[~true]] = True
    return holes & ~reaching_out[labels]


def _outline(mask: Mask) -> Mask:
    """The pixels of a mask that have one of four neighbours outside it; the frame's edge is no outline."""
    from scipy import ndimage

    return mask & ~ndimage.binary_erosion(mask, border_value=1)


def _distance(mask: Mask) -> NDArray[np.float64]:
    """How far each pixel is from the nearest of a mask, (H, W), pixels; NaN where the mask is empty."""
    from scipy import ndimage

    if not mask.any():
        return np.full(mask.shape, np.nan)
    return ndimage.distance_transform_edt(~mask)


def _box(mask: Mask, margin: int) -> tuple[slice, slice]:
    """The rows and columns around what is set in a mask (H, W), so much larger; all where nothing is set."""
    if not mask.any():
        return slice(None), slice(None)
    first_row, last_row = np.flatnonzero(mask.any(axis=1))[[0, -1]]
    first_column, last_column = np.flatnonzero(mask.any(axis=0))[[0, -1]]
    return (
        slice(max(first_row - margin, 0), last_row + margin + 1),
        slice(max(first_column - margin, 0), last_column + margin + 1),
    )


def _ssim(drawn: NDArray[np.uint8], true: NDArray[np.uint8], box: tuple[slice, slice]) -> NDArray[np.float64]:
    """SSIM of each pixel, (H, W), with the settings of Wang et al. 2004; 1 outside the box."""
    from skimage.metrics import structural_similarity

    if min(drawn.shape[:2]) < _WINDOW:
        return np.full(drawn.shape[:2], np.nan)
    values = np.ones(drawn.shape[:2])
    _, by_channel = structural_similarity(
        drawn[box], true[box], channel_axis=2, data_range=255, gaussian_weights=True, sigma=1.5,
        use_sample_covariance=False, full=True,
    )  # fmt: skip
    values[box] = by_channel.mean(axis=2)
    return values


def _flip(drawn: NDArray[np.uint8], true: NDArray[np.uint8], box: tuple[slice, slice]) -> NDArray[np.float64]:
    """FLIP of each pixel, (H, W), 0..1, at its own 67 pixels per degree (Andersson et al. 2020).

    0 outside the box.
    """
    try:
        import flip_evaluator
    except ModuleNotFoundError:  # it has no wheels for some platforms
        return np.full(drawn.shape[:2], np.nan)
    values = np.zeros(drawn.shape[:2])
    pictures = (np.ascontiguousarray(picture[box] / np.float32(255)) for picture in (true, drawn))
    found, _, _ = flip_evaluator.evaluate(*pictures, "LDR", applyMagma=False)
    values[box] = found[..., 0]
    return values


def _psnr(squares: NDArray[np.float64]) -> float:
    error = _mean(squares)
    return float("inf") if error == 0 else float(10 * np.log10(255**2 / error))


def _count(mask: Mask) -> int:
    return int(np.count_nonzero(mask))


def _percent(part: float, whole: float) -> float:
    return 100.0 * part / whole if whole else float("nan")


def _defined(values: NDArray[np.float64]) -> NDArray[np.float64]:
    return values[~np.isnan(values)]


def _mean(values: NDArray[np.float64]) -> float:
    return float(values.mean()) if values.size else float("nan")


def _quantile(values: NDArray[np.float64], q: float) -> float:
    return float(np.quantile(values, q)) if values.size else float("nan")
