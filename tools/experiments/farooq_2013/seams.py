"""Seams between views that see colours differently: how visible they are, and what fine detail they cost.

Where one view takes over from another, a picture has to pass from the gain of the one to that of the other.
What a gain does that changes slowly is no seam. docs/how-it-works/laplacian.md has the formulas.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from viewer.bench.metrics import Errors, Mask
from viewer.camera import Camera
from viewer.mesh.reference import Reference, visible
from viewer.mesh.scene import Scene

SCALES = (1, 2, 4, 8)  # pixels: standard deviations of the Gaussians that gradients are taken after
SMOOTH = 16.0  # pixels, likewise: a gain that changes more slowly is none that one sees
REACH = 8.0  # pixels, from where the winner changes
_FINE = float(
    np.sqrt(2)
)  # pixels: what reducing and expanding an image once, by Burt and Adelson's taps, smooths it
_DARKEST = 1e-3  # linear: what is seen of the darkest has no gradients of its own
_ALL, _BUT_FIRST, _BUT_LAST = slice(None), slice(1, None), slice(-1)
_PAIRS = (
    ((_ALL, _BUT_LAST), (_ALL, _BUT_FIRST)),
    ((_BUT_LAST, _ALL), (_BUT_FIRST, _ALL)),
)  # pixels and those right and below

Colors = NDArray[np.floating]


def pods_facing(truth: Scene, reference: Reference, pods: Sequence[Camera]) -> NDArray[np.float64]:
    """How each pod sees what a picture truly shows, (pods, H, W): the cosine of the incidence, 0 where it
    does not see it."""
    at, covered = reference.positions() + reference.origin, reference.covered
    cosines = np.zeros((len(pods), *covered.shape))
    for own, pod in zip(cosines, pods, strict=True):
        to_pod = np.array(pod.eye) - at
        cosine = (to_pod * reference.normal[covered]).sum(axis=1) / np.linalg.norm(to_pod, axis=1)
        own[covered] = np.maximum(cosine, 0) * visible(truth, at - truth.origin, pod)
    return cosines


def seams(weights: NDArray[np.floating]) -> Mask:
    """The pixels, (H, W), beside which another view wins. weights: (views, H, W), those of the competition; a
    pixel where all are 0 is nobody's."""
    winner = np.where(weights.max(axis=0) > 0, weights.argmax(axis=0), -1)
    found = np.zeros(winner.shape, bool)
    for here, there in _PAIRS:
        changes = (winner[here] != winner[there]) & (winner[here] >= 0) & (winner[there] >= 0)
        found[here] |= changes
        found[there] |= changes
    return found


def seam_visibility(drawn: Colors, alike: Colors, shown: Mask, seam: Mask) -> Errors:
    """The energy of gradients near seams that a smooth gain lacks, in squared percent of the brightness.

    drawn: (H, W, 3), the picture, linear light. alike: the same of a scan whose views all have one gain,
    drawn the same way. shown: (H, W), where both show the surface; nothing else has a part in it. seam:
    (H, W), as `seams` finds it. Gives `seam_S` for each scale S: S^2 times the mean squared gradient after
    a Gaussian of S pixels; and `seam`, their sum. NaN where there is no seam.
    """
    from scipy import ndimage

    if not (seam & shown).any():
        return dict.fromkeys(("seam", *(f"seam_{scale}" for scale in SCALES)), float("nan"))
    gain = _mean_around(drawn * alike, shown, SMOOTH) / np.maximum(
        _mean_around(alike**2, shown, SMOOTH), _DARKEST**2
    )
    brightness = np.maximum(_mean_around(alike, shown, SMOOTH), _DARKEST)
    excess = 100 * (drawn - gain * alike) / brightness
    near = shown & (ndimage.distance_transform_edt(~(seam & shown)) <= REACH)
    errors = {
        f"seam_{scale}": scale**2 * _energy(_mean_around(excess, shown, scale), shown, near)
        for scale in SCALES
    }
    return {"seam": sum(errors.values()), **errors}


def detail_psnr(drawn: Colors, true: Colors, inside: Mask, shown: Mask) -> float:
    """PSNR, dB, of fine detail: what pictures (H, W, 3), linear light, have beyond themselves smoothed, as
    the finest band of a Laplacian pyramid. inside: (H, W), where it is asked for. shown: (H, W), where both
    show the surface."""
    difference = drawn - true
    error = (difference - _mean_around(difference, shown, _FINE))[inside & shown]
    mean = float(np.square(error).mean()) if error.size else float("nan")
    return float("inf") if mean == 0 else -10 * float(np.log10(mean))


def _mean_around(values: Colors, shown: Mask, deviation: float) -> NDArray[np.float64]:
    """Means of (H, W, 3) around each pixel by a Gaussian, of what is shown alone; 0 where nothing is."""
    from scipy import ndimage

    weights = ndimage.gaussian_filter(shown.astype(np.float64), deviation)
    sums = ndimage.gaussian_filter(values * shown[..., None], (deviation, deviation, 0), output=np.float64)
    return np.where(shown[..., None], sums / np.maximum(weights, 1e-12)[..., None], 0)


def _energy(values: NDArray[np.float64], shown: Mask, near: Mask) -> float:
    """The mean squared gradient of (H, W, 3) over the pixels `near` and the channels, between pixels that are
    both shown."""
    squares = np.zeros(shown.shape)
    for before, after in _PAIRS:
        both = shown[before] & shown[after]
        energy = np.square(values[after] - values[before]).mean(axis=2) * both / 2  # half to each of the two
        squares[before] += energy
        squares[after] += energy
    return float(squares[near].mean())
