"""Code words: splats as whole numbers of 64 bits, drawn from tables in a window that slides down the picture.

Maršík 2010. `encode_elements` projects, quantises and lights the points of a pose: that alone works with
fractions. What follows is whole numbers, the same to the bit everywhere: `WordStream` holds words line by
line, and can be saved; `draw_words` draws them. No OpenGL anywhere in this package.
"""

from __future__ import annotations

SUFFIX = ".cw"  # of files of `WordStream`
