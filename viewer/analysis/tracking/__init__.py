"""Landmarks through time.

Where a scan says which points are the same, a landmark follows its points exactly. Elsewhere the surface
around it, by its shape and its colours, is found again in each frame.
"""

from .settings import TrackingSettings
from .tracker import Tracker, track_landmarks

__all__ = ["Tracker", "TrackingSettings", "track_landmarks"]
