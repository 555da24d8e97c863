"""A thin layer over moderngl: context, shader files, buffers, Surface, primitives, timers."""
