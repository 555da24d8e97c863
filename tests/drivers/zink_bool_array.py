"""Whether a driver reads an array of bool at an index that it learns late; without Scan4D.

    LIBGL_ALWAYS_SOFTWARE=1 GALLIUM_DRIVER=zink python tests/drivers/zink_bool_array.py

Mesa 22.3.6: llvmpipe does; Zink makes a 1-bit integer of it, which SPIR-V lacks ("Invalid number of bits (1)
used for OpTypeInt", says spirv-val of what ZINK_DEBUG=spirv leaves), has no pipeline, and its next
dispatches draw nothing or end the process.
"""

from __future__ import annotations

import sys

import moderngl
import numpy as np

SHADER = """
#version 430 core
layout(local_size_x = 1) in;
layout(std430, binding = 0) buffer Words { uint words[]; };
bool flags[8];

void main() {
    for (int k = 0; k < 8; ++k) flags[k] = words[k] > 3u;
    for (uint i = 0u; i < words[8]; ++i) words[9] += uint(flags[words[i]]);
}
"""


def main() -> int:
    ctx = moderngl.create_context(standalone=True, require=430, backend="egl")
    words = ctx.buffer(np.array([0, 1, 2, 3, 4, 5, 6, 7, 8, 0], np.uint32))
    words.bind_to_storage_buffer(0)
    ctx.compute_shader(SHADER).run()
    ctx.finish()
    found = int(np.frombuffer(words.read(), np.uint32)[9])
    print(f"{ctx.info['GL_RENDERER']}: {found} of 4 flags")
    return int(found != 4)


if __name__ == "__main__":
    sys.exit(main())
