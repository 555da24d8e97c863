"""Measurements by the developers of Scan4D: each module that declares `EXPERIMENT` is one
(docs/developing)."""
