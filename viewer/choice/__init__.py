"""Automatic choice: which renderer draws a view best within a time, or fastest within an error.

What is known of a view before it is drawn (`seen`), a small model of each way's time and error (`model`, of
the device: `known`), and the way that suits best (`choose`).
"""
