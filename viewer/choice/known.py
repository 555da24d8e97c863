"""The model of a device: what was measured on it and is kept in this user's folder, or what is shipped for
drawing in software."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import asdict
from pathlib import Path
from typing import Any

import numpy as np

from ..errors import InputError
from ..files import parsed_json, read_text, save_json
from ..folders import user_folder
from ..gpu.context import Gpu
from ..resources import resource_path
from .model import ERROR_TERMS, TIME_TERMS, Law, Model

FILE = "choice.json"
FORMAT = 1
_MOST_BYTES = 2**20


def model_of(gpu: Gpu, file: Path | None = None) -> Model:
    """The model of a device. file: where models are kept; None: in the user's folder. Raises InputError for a
    device that was not measured, and is none that draws in software."""
    kept = read_models(file or user_folder() / FILE).get(_key(gpu))
    if kept is None and gpu.software:
        kept = read_models(resource_path("assets", FILE)).get("software")
    if kept is None:
        what = f"Scan4D does not know how long {gpu.device} takes for a picture"
        raise InputError(
            what, "automatic choice", "Measure this device once: scan4d bench --calibrate -o DIR"
        )
    return kept


def keep_model(gpu: Gpu, model: Model, file: Path | None = None) -> Path:
    """Keep what was measured on a device; gives the file. Raises InputError where that cannot be written."""
    file = file or user_folder() / FILE
    models = {**read_models(file), _key(gpu): model}
    write_models(models, file)
    return file


def read_models(file: Path) -> dict[str, Model]:
    """Models by device; none where there is no such file, or it is damaged or of another version."""
    try:
        data = parsed_json(read_text(file, _MOST_BYTES))
    except (OSError, ValueError):
        return {}
    if not isinstance(data, dict) or data.get("format") != FORMAT or not isinstance(data.get("models"), dict):
        return {}
    models = {device: _model(stored) for device, stored in data["models"].items()}
    return {device: model for device, model in models.items() if model}


def write_models(models: Mapping[str, Model], file: Path) -> None:
    """Write models by device. Raises InputError where that is not possible."""
    plain = {device: {key: asdict(law) for key, law in model.items()} for device, model in models.items()}
    save_json(file, {"format": FORMAT, "models": plain})


def _key(gpu: Gpu) -> str:
    return f"{gpu.device}, {gpu.driver}"


def _model(stored: Any) -> Model:
    """The laws of JSON data, less those that are none."""
    laws = {key: _law(law) for key, law in stored.items()} if isinstance(stored, dict) else {}
    return {key: law for key, law in laws.items() if law is not None}


def _law(stored: Any) -> Law | None:
    try:
        time, error = (tuple(float(factor) for factor in stored[name]) for name in ("time", "error"))
        law = Law(time, error, float(stored["late"]), float(stored["wrong"]))
    except (KeyError, TypeError, ValueError, OverflowError):
        return None
    numbers = np.array([*time, *error, law.late, law.wrong])
    fits = len(time) == TIME_TERMS and len(error) == ERROR_TERMS
    return law if fits and np.isfinite(numbers).all() and (numbers >= 0).all() else None
