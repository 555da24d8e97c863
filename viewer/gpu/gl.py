"""Every raw OpenGL call of the project: what moderngl does not reach.

Through PyOpenGL's raw modules, which import in a quarter of the time of OpenGL.GL.
"""

from __future__ import annotations

import ctypes
import os
import sys
from collections.abc import Iterator
from contextlib import contextmanager

import moderngl
import numpy as np

if sys.platform.startswith("linux"):
    # Headless contexts come from EGL. In a window the raw functions work all the same: they
    # only need their addresses, which EGL gives for whichever context is current.
    os.environ.setdefault("PYOPENGL_PLATFORM", "egl")

import OpenGL

OpenGL.ERROR_CHECKING = False
OpenGL.ERROR_LOGGING = False

from OpenGL.raw.GL import _types  # noqa: E402
from OpenGL.raw.GL.VERSION import (  # noqa: E402
    GL_1_0,
    GL_1_1,
    GL_1_3,
    GL_1_4,
    GL_1_5,
    GL_2_0,
    GL_3_0,
    GL_3_1,
    GL_3_2,
    GL_3_3,
    GL_4_0,
    GL_4_2,
    GL_4_3,
    GL_4_4,
)
from OpenGL.raw.GL.VERSION import GL_4_5 as _later  # noqa: E402

from .bindings import Texture  # noqa: E402
from .constants import NOTHING  # noqa: E402

RG32UI = 0x823C
RGB32I = 0x8D83
RGB32UI = 0x8D71
RG32F = 0x8230
RGB32F = 0x8815
R32F = 0x822E
R32I = 0x8235
RGBA32F = 0x8814
RGBA32UI = 0x8D70
RGBA8 = 0x8058
R32UI = 0x8236
R8UI = 0x8232
R16UI = 0x8234
_RED_INTEGER = 0x8D94
_RED = 0x1903
_UNSIGNED_INT = 0x1405
_FLOAT = 0x1406
_COPY_READ_BUFFER = 0x8F36
_COPY_WRITE_BUFFER = 0x8F37
_PIXEL_PACK_BUFFER = 0x88EB
_TEXTURE_BUFFER = 0x8C2A
_FRAMEBUFFER = 0x8D40
_RENDERBUFFER = 0x8D41
_COLOR_ATTACHMENT0 = 0x8CE0
_DEPTH_ATTACHMENT = 0x8D00
_DEPTH_COMPONENT32F = 0x8CAC
_MAX_TEXTURE_BUFFER_SIZE = 0x8C2B
_MAX_SHADER_STORAGE_BLOCK_SIZE = 0x90DE
_MAX_SHADER_STORAGE_BUFFER_BINDINGS = 0x90DD
_MAX_UNIFORM_BLOCK_SIZE = 0x8A30
_MAX_TEXTURE_SIZE = 0x0D33
_MAX_RENDERBUFFER_SIZE = 0x84E8
_READ_FRAMEBUFFER = 0x8CA8
_WAIT = 1_000_000_000  # nanoseconds between two looks at a fence


def integer(name: int) -> int:
    """An integer limit or state of the current context."""
    value = ctypes.c_int64(0)
    GL_3_2.glGetInteger64v(name, ctypes.byref(value))
    return value.value


def max_texture_buffer_texels() -> int:
    """How many texels a buffer texture may have."""
    return integer(_MAX_TEXTURE_BUFFER_SIZE)


def max_storage_block_bytes() -> int:
    """How many bytes of a buffer a shader may see as a storage block."""
    return integer(_MAX_SHADER_STORAGE_BLOCK_SIZE)


def storage_bindings() -> int:
    """How many binding points of storage blocks there are."""
    return integer(_MAX_SHADER_STORAGE_BUFFER_BINDINGS)


def max_uniform_block_bytes() -> int:
    """How many bytes of a buffer a shader may see as a uniform block."""
    return integer(_MAX_UNIFORM_BLOCK_SIZE)


def max_image_edge() -> int:
    """How many pixels an edge of an image may have."""
    return integer(_MAX_TEXTURE_SIZE)


def max_raster_edge() -> int:
    """How many pixels an edge of a `Target` may have."""
    return min(max_image_edge(), integer(_MAX_RENDERBUFFER_SIZE))


def reverse_depth() -> None:
    """Clip space as the project uses it: depth 0..1, row 0 of a picture at its top."""
    _later.glClipControl(_later.GL_UPPER_LEFT, _later.GL_ZERO_TO_ONE)


def default_clip_space() -> None:
    """OpenGL's own clip space, which other libraries expect."""
    _later.glClipControl(_later.GL_LOWER_LEFT, _later.GL_NEGATIVE_ONE_TO_ONE)


@contextmanager
def kept_depth() -> Iterator[None]:
    """Whatever is drawn meanwhile leaves the depth buffer as it is."""
    GL_1_0.glDepthMask(False)
    try:
        yield
    finally:
        GL_1_0.glDepthMask(True)


@contextmanager
def kept_colors() -> Iterator[None]:
    """Whatever is drawn meanwhile leaves images as they are."""
    GL_1_0.glColorMask(False, False, False, False)
    try:
        yield
    finally:
        GL_1_0.glColorMask(True, True, True, True)


@contextmanager
def keeping_largest(image: int) -> Iterator[None]:
    """An image keeps the largest of what is drawn meanwhile, while others are blended."""
    GL_4_0.glBlendEquationi(image, GL_1_4.GL_MAX)
    try:
        yield
    finally:
        GL_4_0.glBlendEquationi(image, GL_1_4.GL_FUNC_ADD)


@contextmanager
def divided_depth(divisor: float) -> Iterator[None]:
    """Divide what reaches the depth buffer meanwhile."""
    GL_1_0.glDepthRange(0.0, 1.0 / divisor)
    try:
        yield
    finally:
        GL_1_0.glDepthRange(0.0, 1.0)


@contextmanager
def debug_messages() -> Iterator[list[str]]:
    """Collect what the driver reports meanwhile, after "error: " where it is an error. Empty where the driver
    reports nothing."""
    messages: list[str] = []

    def take(_: int, kind: int, ident: int, severity: int, length: int, text: int, user: object) -> None:
        error = "error: " if kind == GL_4_3.GL_DEBUG_TYPE_ERROR else ""
        messages.append(error + ctypes.string_at(text, length).decode(errors="replace"))

    callback = _types.GLDEBUGPROC(take)
    for state in (GL_4_3.GL_DEBUG_OUTPUT, GL_4_3.GL_DEBUG_OUTPUT_SYNCHRONOUS):
        GL_1_0.glEnable(state)
    GL_4_3.glDebugMessageCallback(callback, None)
    try:
        yield messages
    finally:
        GL_1_0.glFinish()
        for state in (GL_4_3.GL_DEBUG_OUTPUT, GL_4_3.GL_DEBUG_OUTPUT_SYNCHRONOUS):
            GL_1_0.glDisable(state)
        GL_4_3.glDebugMessageCallback(_types.GLDEBUGPROC(), None)


def clear_words(buffer: moderngl.Buffer, word: int, count: int | None = None) -> None:
    """Fill a buffer with one 32-bit word by the driver. count: of its first words."""
    value = np.array([word], np.uint32)
    size = buffer.size if count is None else 4 * count
    GL_1_5.glBindBuffer(_COPY_WRITE_BUFFER, buffer.glo)
    GL_4_3.glClearBufferSubData(
        _COPY_WRITE_BUFFER, R32UI, 0, size, _RED_INTEGER, _UNSIGNED_INT, ctypes.c_void_p(value.ctypes.data)
    )


def new_queries(count: int) -> list[int]:
    """Names of new queries."""
    names = (ctypes.c_uint * count)()
    GL_1_5.glGenQueries(count, names)
    return list(names)


def record_time(query: int) -> None:
    """Have a query hold the time when the GPU has done everything so far."""
    GL_3_3.glQueryCounter(query, GL_3_3.GL_TIMESTAMP)


def recorded_ns(query: int) -> int:
    """The time that a query holds, nanoseconds; waits for it."""
    value = ctypes.c_uint64(0)
    GL_3_3.glGetQueryObjectui64v(query, GL_1_5.GL_QUERY_RESULT, ctypes.byref(value))
    return value.value


def get_buffer(buffer: moderngl.Buffer, offset: int, out: np.ndarray) -> None:
    """Copy bytes of a buffer from an offset on into an array; waits for the GPU."""
    GL_1_5.glBindBuffer(_COPY_READ_BUFFER, buffer.glo)
    GL_1_5.glGetBufferSubData(_COPY_READ_BUFFER, offset, out.nbytes, ctypes.c_void_p(out.ctypes.data))


def has_mapped_buffers(ctx: moderngl.Context) -> bool:
    """Whether buffers may stay mapped while the GPU uses them."""
    return ctx.version_code >= 440 or "GL_ARB_buffer_storage" in ctx.extensions


class MappedBuffer:
    """A buffer in the memory of the host that stays mapped, for the GPU to copy into, or from.

    address: where the CPU reads it, once the GPU has finished, or writes it. is_read: whether it reads.
    """

    def __init__(self, nbytes: int, is_read: bool = True) -> None:
        name, self.nbytes = ctypes.c_uint(0), nbytes
        GL_1_5.glGenBuffers(1, ctypes.byref(name))
        self._glo = name.value
        GL_1_5.glBindBuffer(_COPY_WRITE_BUFFER, self._glo)
        access = GL_3_0.GL_MAP_READ_BIT if is_read else GL_3_0.GL_MAP_WRITE_BIT
        access |= GL_4_4.GL_MAP_PERSISTENT_BIT | GL_4_4.GL_MAP_COHERENT_BIT
        GL_4_4.glBufferStorage(_COPY_WRITE_BUFFER, nbytes, None, access | GL_4_4.GL_CLIENT_STORAGE_BIT)
        self.address: int = GL_3_0.glMapBufferRange(_COPY_WRITE_BUFFER, 0, nbytes, access)
        if not self.address:
            raise MemoryError(f"the graphics driver has no memory for a buffer of {nbytes:,} bytes")

    def take(self, source: moderngl.Buffer, offset: int, nbytes: int, at: int = 0) -> None:
        """Have the GPU copy bytes of another buffer. at: where they come to lie."""
        GL_1_5.glBindBuffer(_COPY_READ_BUFFER, source.glo)
        GL_1_5.glBindBuffer(_COPY_WRITE_BUFFER, self._glo)
        GL_3_1.glCopyBufferSubData(_COPY_READ_BUFFER, _COPY_WRITE_BUFFER, offset, at, nbytes)
        GL_4_2.glMemoryBarrier(GL_4_4.GL_CLIENT_MAPPED_BUFFER_BARRIER_BIT)

    def give(self, target: moderngl.Buffer, offset: int, nbytes: int, at: int) -> Fence:
        """Have the GPU copy bytes into another buffer. at: where they lie. Returns what tells when it has."""
        GL_1_5.glBindBuffer(_COPY_READ_BUFFER, self._glo)
        GL_1_5.glBindBuffer(_COPY_WRITE_BUFFER, target.glo)
        GL_3_1.glCopyBufferSubData(_COPY_READ_BUFFER, _COPY_WRITE_BUFFER, at, offset, nbytes)
        return Fence()

    def release(self) -> None:
        """Delete it."""
        GL_1_5.glDeleteBuffers(1, ctypes.byref(ctypes.c_uint(self._glo)))


class Fence:
    """Place in what the GPU was told to do, which the CPU can wait for, once."""

    def __init__(self) -> None:
        self._sync = GL_3_2.glFenceSync(GL_3_2.GL_SYNC_GPU_COMMANDS_COMPLETE, 0)

    def wait(self) -> None:
        """Wait until the GPU has done all that it was told before, and delete this."""
        flags = GL_3_2.GL_SYNC_FLUSH_COMMANDS_BIT
        while GL_3_2.glClientWaitSync(self._sync, flags, _WAIT) == GL_3_2.GL_TIMEOUT_EXPIRED:
            pass
        GL_3_2.glDeleteSync(self._sync)


class BufferTexture:
    """A buffer seen as texels, for `texelFetch`: on software drivers twice as fast as an SSBO.

    binds_at_once: whether all contexts so far take a texture and its unit in one call, as OpenGL 4.5 does.
    """

    binds_at_once = True

    def __init__(self, buffer: moderngl.Buffer, texel_format: int) -> None:
        name = ctypes.c_uint(0)
        GL_1_1.glGenTextures(1, ctypes.byref(name))
        self.glo = name.value
        self.buffer = buffer
        self._bind_active(Texture.SCRATCH)  # not over what a shader is about to read
        GL_3_1.glTexBuffer(_TEXTURE_BUFFER, texel_format, buffer.glo)

    def bind(self, unit: int) -> None:
        """Bind to a texture unit."""
        if BufferTexture.binds_at_once:
            _later.glBindTextureUnit(unit, self.glo)
        else:
            self._bind_active(unit)

    def _bind_active(self, unit: int) -> None:
        """Bind to a texture unit, which is the active one then."""
        GL_1_3.glActiveTexture(GL_1_3.GL_TEXTURE0 + unit)
        GL_1_1.glBindTexture(_TEXTURE_BUFFER, self.glo)

    def release(self) -> None:
        """Delete the texture and its buffer."""
        GL_1_1.glDeleteTextures(1, ctypes.byref(ctypes.c_uint(self.glo)))
        self.buffer.release()


class Target:
    """A framebuffer of two images with a 32-bit float depth buffer.

    moderngl's own depth textures are 24-bit integers.
    """

    def __init__(
        self, ctx: moderngl.Context, size: tuple[int, int], images: tuple[moderngl.Texture, moderngl.Texture]
    ) -> None:
        self.size = size
        self.images = images
        renderbuffer, framebuffer = ctypes.c_uint(0), ctypes.c_uint(0)
        GL_3_0.glGenRenderbuffers(1, ctypes.byref(renderbuffer))
        GL_3_0.glBindRenderbuffer(_RENDERBUFFER, renderbuffer.value)
        GL_3_0.glRenderbufferStorage(_RENDERBUFFER, _DEPTH_COMPONENT32F, *size)
        GL_3_0.glGenFramebuffers(1, ctypes.byref(framebuffer))
        GL_3_0.glBindFramebuffer(_FRAMEBUFFER, framebuffer.value)
        for index, texture in enumerate(images):
            GL_3_0.glFramebufferTexture2D(
                _FRAMEBUFFER, _COLOR_ATTACHMENT0 + index, GL_1_1.GL_TEXTURE_2D, texture.glo, 0
            )
        GL_3_0.glFramebufferRenderbuffer(_FRAMEBUFFER, _DEPTH_ATTACHMENT, _RENDERBUFFER, renderbuffer.value)
        buffers = (ctypes.c_uint * 2)(_COLOR_ATTACHMENT0, _COLOR_ATTACHMENT0 + 1)
        GL_2_0.glDrawBuffers(2, buffers)
        self._renderbuffer, self._framebuffer = renderbuffer, framebuffer
        self.target = ctx.detect_framebuffer(framebuffer.value)

    def clear(self) -> None:
        """Set both images to zero; it is bound. The depth buffer stays."""
        zero = (ctypes.c_float * 4)(*[0.0] * 4)
        for index in range(2):
            GL_3_0.glClearBufferfv(GL_1_1.GL_COLOR, index, zero)

    def clear_depth(self) -> None:
        """Set the depth buffer to its far end; it is bound."""
        GL_1_0.glDepthMask(True)
        GL_3_0.glClearBufferfv(GL_1_1.GL_DEPTH, 0, (ctypes.c_float * 1)(0.0))

    def bind_images(self, *units: int) -> None:
        """Bind each image to its texture unit."""
        for unit, image in zip(units, self.images, strict=True):
            image.use(unit)

    def depth_is_float32(self) -> bool:
        """Whether the driver really stores 32-bit float depth."""
        GL_3_0.glBindRenderbuffer(_RENDERBUFFER, self._renderbuffer.value)
        value = ctypes.c_int(0)
        GL_3_0.glGetRenderbufferParameteriv(
            _RENDERBUFFER, GL_3_0.GL_RENDERBUFFER_INTERNAL_FORMAT, ctypes.byref(value)
        )
        return value.value == _DEPTH_COMPONENT32F

    def release(self) -> None:
        """Delete everything."""
        GL_3_0.glDeleteFramebuffers(1, ctypes.byref(self._framebuffer))
        GL_3_0.glDeleteRenderbuffers(1, ctypes.byref(self._renderbuffer))
        for image in self.images:
            image.release()


class Raster(Target):
    """Two 32-bit images: row and depth."""

    def __init__(self, ctx: moderngl.Context, size: tuple[int, int]) -> None:
        super().__init__(ctx, size, (ctx.texture(size, 1, dtype="u4"), ctx.texture(size, 1, dtype="f4")))

    def clear(self) -> None:
        """Bind it and clear: no row anywhere, depth +inf, the depth buffer at its far end."""
        self.target.use()
        none = (ctypes.c_uint * 4)(*[NOTHING] * 4)
        infinite = (ctypes.c_float * 4)(*[float("inf")] * 4)
        far = (ctypes.c_float * 1)(0.0)
        GL_3_0.glClearBufferuiv(GL_1_1.GL_COLOR, 0, none)
        GL_3_0.glClearBufferfv(GL_1_1.GL_COLOR, 1, infinite)
        GL_1_0.glDepthMask(True)
        GL_3_0.glClearBufferfv(GL_1_1.GL_DEPTH, 0, far)

    def copy_to(self, rows: moderngl.Buffer, depth: moderngl.Buffer) -> None:
        """Copy both images to buffers, without leaving the GPU."""
        GL_3_0.glBindFramebuffer(_READ_FRAMEBUFFER, self._framebuffer.value)
        for index, (buffer, form, kind) in enumerate(
            ((rows, _RED_INTEGER, _UNSIGNED_INT), (depth, _RED, _FLOAT))
        ):
            GL_1_0.glReadBuffer(_COLOR_ATTACHMENT0 + index)
            GL_1_5.glBindBuffer(_PIXEL_PACK_BUFFER, buffer.glo)
            GL_1_0.glReadPixels(0, 0, *self.size, form, kind, ctypes.c_void_p(0))
        GL_1_5.glBindBuffer(_PIXEL_PACK_BUFFER, 0)


class Sums(Target):
    """Two images of four floats, to which what is drawn is added or blended."""

    def __init__(self, ctx: moderngl.Context, size: tuple[int, int]) -> None:
        super().__init__(ctx, size, (ctx.texture(size, 4, dtype="f4"), ctx.texture(size, 4, dtype="f4")))
        self.nbytes = (16 + 16 + 4) * size[0] * size[1]


class Blended(Target):
    """An image of 8-bit colours, to which what is drawn is blended, and one of floats, which keeps the
    largest of what is drawn with `keeping_largest`."""

    def __init__(self, ctx: moderngl.Context, size: tuple[int, int]) -> None:
        super().__init__(ctx, size, (ctx.texture(size, 4), ctx.texture(size, 1, dtype="f4")))
        self.nbytes = (4 + 4 + 4) * size[0] * size[1]
