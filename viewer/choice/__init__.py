"""Automatic choice: which renderer draws a view best within a time, or fastest within an error.

`seen` describes a view before it is drawn, `model` predicts time and error of each configuration (`known` of
them on this device), and `choose` finds the configuration that suits best.
"""
