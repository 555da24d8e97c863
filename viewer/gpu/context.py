"""The OpenGL context, headless or a window's, and what was learnt about its driver."""

from __future__ import annotations

import os
import struct
import sys
from collections import deque
from collections.abc import Callable, Hashable, Iterator, Mapping, Sequence
from contextlib import contextmanager, suppress
from dataclasses import dataclass, field
from typing import Any, NamedTuple, Protocol, TypeVar

import moderngl
import numpy as np
from numpy import typing as npt
from numpy.typing import NDArray

from ..errors import InputError, NoOpenGLError, Scan4DError
from ..native import give_memory_back
from . import gl
from .bindings import Storage, UniformBlock
from .blocks import BlockBuffer, Values
from .constants import GROUP, GROUP_LIMIT
from .shader import ShaderError, Source, shader_error
from .shader_cache import shader_cache
from .staging import Staging
from .timers import Timers

T = TypeVar("T")
Program = moderngl.Program | moderngl.ComputeShader
Uniform = bool | int | float | tuple[float, ...]
REQUIRED_VERSION = 430
WIDE_EXTENSIONS = {"GL_ARB_gpu_shader_int64", "GL_NV_shader_atomic_int64"}
_OLDEST_VERSION = 330  # that moderngl takes
REQUIRED_EXTENSIONS = ("GL_ARB_clip_control",)
_FILLED = 4  # words of a buffer that an invocation fills
_MOST_FILLS = 4  # buffers that a dispatch fills
_MISSING = object()
_MUCH = 64 << 20  # bytes to be given back at once
_SOFTWARE = ("llvmpipe", "softpipe", "swrast", "swiftshader", "basic render", "gdi generic")


class Resource(Protocol):
    """Something on the GPU that is released by hand."""

    def release(self) -> object:
        """Delete it."""


class Workspace(Resource, Protocol):
    """Things that a backend keeps with a surface or a pose."""

    @property
    def nbytes(self) -> int:
        """Bytes held on the GPU."""


class Fill(NamedTuple):
    """A 32-bit word in each place of a buffer. first: only in so many, the first ones."""

    buffer: moderngl.Buffer
    word: int
    first: int | None = None

    @property
    def words(self) -> int:
        """How many places that is."""
        return self.buffer.size // 4 if self.first is None else self.first


@dataclass
class Attempts:
    """Attempts to get a context: (how, what came of it)."""

    log: list[tuple[str, str]] = field(default_factory=list)

    def __str__(self) -> str:
        return "; ".join(f"{how}: {outcome}" for how, outcome in self.log)


class _Uniform:
    """A uniform of a program. value, packed: what it holds."""

    __slots__ = ("member", "pack", "packed", "value")

    def __init__(self, member: Any) -> None:
        self.member, self.pack = member, struct.Struct(member.fmt).pack
        self.value: Uniform | None = None
        self.packed = b""


class _Uniforms:
    """The uniforms of a program by name. Only values that change go to the driver."""

    def __init__(self, program: Program, sources: list[Source]) -> None:
        members = ((name, program[name]) for name in program)
        self._used = {name: _Uniform(each) for name, each in members if isinstance(each, moderngl.Uniform)}
        self._unused = set[str]()  # those that the compiler dropped
        self._sources = sources

    def set(self, values: Mapping[str, Uniform]) -> None:
        """Set some of them; see `Gpu.set`."""
        for name, value in values.items():
            used = self._used.get(name)
            if used is None:
                if name not in self._unused:
                    self._check(name)
            elif value is not used.value:
                packed = used.pack(*value) if isinstance(value, tuple) else used.pack(value)
                if packed != used.packed:
                    used.member.write(packed)
                    used.packed = packed
                used.value = value

    def _check(self, name: str) -> None:
        """Note a name without a use. Raises ShaderError for one that no source declares."""
        if not any(name in source.uniforms for source in self._sources):
            names = ", ".join(source.name for source in self._sources)
            raise ShaderError(f"no uniform is called '{name}'", f"shaders/{names}")
        self._unused.add(name)


@dataclass(frozen=True)
class Built:
    """Texts and values that a program is run with, its `extra`. values: of its `<params>`; None without."""

    sources: list[Source]
    values: BlockBuffer | None
    uniforms: _Uniforms


class Gpu:
    """A context with its shader programs and timers.

    wide_atomics: whether passes use 64-bit atomics: where the driver has `WIDE_EXTENSIONS`. On an H200 they
    draw 10 million points in 0.7 of the time, and a million in the same. clears_by_shader: see `fill`.

    Make one with `headless()`, or give it the context of a window. Raises NoOpenGLError
    where the context lacks what the project needs.
    """

    def __init__(self, ctx: moderngl.Context, headless: bool = False) -> None:
        missing = [name for name in REQUIRED_EXTENSIONS if name not in ctx.extensions]
        if ctx.version_code >= 450:
            missing = []  # clip control is core since 4.5
        if ctx.version_code < REQUIRED_VERSION or missing:
            raise NoOpenGLError(
                f"OpenGL {ctx.version_code / 100:.1f} on '{ctx.info['GL_RENDERER']}' is too old for Scan4D"
                + (f" (no {', '.join(missing)})" if missing else ""),
                hint=(
                    "Scan4D needs OpenGL 4.3 with ARB_clip_control. Update the graphics driver, or run "
                    "'scan4d doctor' to see the versions on this computer"
                ),
            )
        self.ctx = ctx
        self._headless = headless
        self.device: str = ctx.info["GL_RENDERER"]
        self.driver: str = ctx.info["GL_VERSION"]
        self.software = any(word in self.device.lower() for word in _SOFTWARE)
        self.timers = Timers(ctx, self.software)
        self.staging = Staging(ctx, self.software)
        self.wide_atomics = ctx.extensions >= WIDE_EXTENSIONS
        last = gl.storage_bindings() - 1
        self._spare_bindings = range(max(last - _MOST_FILLS, *Storage) + 1, last + 1)
        self.clears_by_shader = not self.software and bool(self._spare_bindings)
        self.max_storage_bytes = gl.max_storage_block_bytes()
        self.max_pixels = self.max_storage_bytes // 4  # a word a pixel
        self.max_points = gl.max_texture_buffer_texels()
        self._cached: dict[object, Any] = {}
        self._programs: dict[tuple[object, ...], Any] = {}
        self._discarded: deque[Resource] = deque()
        self._discarded_bytes = 0
        gl.BufferTexture.binds_at_once &= ctx.version_code >= 450
        gl.reverse_depth()

    def compute(
        self,
        name: str,
        defines: Mapping[str, object] | None = None,
        parts: Mapping[str, str] | None = None,
        params: Values | None = None,
    ) -> moderngl.ComputeShader:
        """The compute program of a shader file, built once for each set of defines, parts and class of
        params: whoever asks for the same shares it, with the uniforms and params that it was given last.

        params: a frozen dataclass, whose numbers the program finds in `<params>` whenever `dispatch`,
        `dispatch_indirect` or `vertices` use it.
        """
        return self._build((name,), defines, parts, params)

    def program(
        self,
        stages: tuple[str, ...],
        defines: Mapping[str, object] | None = None,
        parts: Mapping[str, str] | None = None,
        params: Values | None = None,
    ) -> moderngl.Program:
        """The program of a `.vert`, an optional `.geom` and a `.frag` file; as `compute`."""
        return self._build(stages, defines, parts, params)

    def _build(
        self,
        names: tuple[str, ...],
        defines: Mapping[str, object] | None,
        parts: Mapping[str, str] | None,
        params: Values | None,
    ) -> Any:
        declared, defines, parts = None if params is None else type(params), defines or {}, parts or {}
        # Flat, since a picture looks for dozens: tuples in tuples take several times as long to compare.
        key = (names, declared, *defines, *defines.values(), None, *parts, *parts.values())
        program = self._programs.get(key)
        if program is None:
            program = self._programs[key] = self._compile(names, defines, parts, declared)
        if params is not None:
            program.extra.values.write(params)
        return program

    def _compile(
        self,
        names: tuple[str, ...],
        defines: Mapping[str, object],
        parts: Mapping[str, str],
        declared: type[Values] | None,
    ) -> Any:
        sources = [Source(name, dict(defines), dict(parts), declared) for name in names]
        texts = {s.name.rsplit(".", 1)[-1]: s.text for s in sources}
        self.activate()  # a program belongs to the context that is current
        program: Program
        try:
            if "comp" in texts:
                program = self.ctx.compute_shader(texts["comp"])
            else:
                program = self.ctx.program(
                    vertex_shader=texts["vert"],
                    geometry_shader=texts.get("geom"),
                    fragment_shader=texts["frag"],
                )
        except moderngl.Error as error:
            raise shader_error(sources, error) from error
        values = None if declared is None else BlockBuffer(self.ctx, declared, UniformBlock.PARAMS)
        program.extra = Built(sources, values, _Uniforms(program, sources))
        return program

    @property
    def programs(self) -> int:
        """How many programs were compiled so far."""
        return len(self._programs)

    def cached(self, make: Callable[..., T], *args: Hashable) -> T:
        """Make, once for these arguments, `make(gpu, *args)`: small things that live as long as this."""
        key = (make, *args)
        if (found := self._cached.get(key, _MISSING)) is _MISSING:
            found = self._cached[key] = make(self, *args)
        return found

    def activate(self) -> None:
        """Make a headless context the current one, whatever else the process draws with.

        A window's context is its library's to switch.
        """
        if self._headless:
            self.ctx.__enter__()

    def buffer(self, data: Any = None, *, reserve: int = 0, dynamic: bool = False) -> moderngl.Buffer:
        """A buffer that holds data, or so many bytes. Raises Scan4DError where there is no memory for it."""
        made = self.ctx.buffer(data, reserve=reserve, dynamic=dynamic)
        self.check_memory(made)
        return made

    def read(
        self, buffer: moderngl.Buffer, dtype: npt.DTypeLike = np.uint8, count: int = -1, offset: int = 0
    ) -> NDArray:
        """Numbers of a buffer, (count,); waits for the GPU. count: -1: all from the offset on. offset: in
        bytes. Nothing else reads a buffer (see `staging`)."""
        kind = np.dtype(dtype)
        nbytes = buffer.size - offset if count < 0 else count * kind.itemsize
        self.activate()
        return self.staging.read(buffer, nbytes, offset).view(kind)

    def clear(self, buffer: moderngl.Buffer, word: int, count: int | None = None) -> None:
        """Fill a buffer with one 32-bit word. count: only so many words of it, the first ones."""
        self.fill(Fill(buffer, word, count))

    def fill(self, *fills: Fill) -> None:
        """Fill buffers, each with its word: several at once, since a dispatch takes longer than most fills.

        By a shader, in a fortieth of the time of what drivers of graphics cards do; software drivers do it
        faster themselves.
        """
        most = len(self._spare_bindings)
        with self.timers.measure("clear", only_alone=True):
            if not self.clears_by_shader or any(each.buffer.size > self.max_storage_bytes for each in fills):
                for buffer, word, first in fills:
                    gl.clear_words(buffer, word, first)
            else:
                for first in range(0, len(fills), most):
                    self._fill_by_shader(fills[first : first + most])

    def _fill_by_shader(self, fills: Sequence[Fill]) -> None:
        first = self._spare_bindings.start
        program = self.compute("common/fill.comp", {"FILLED": first, "FILLS": len(fills)})
        for binding, each in enumerate(fills, first):
            each.buffer.bind_to_storage_buffer(binding)
        none = (0,) * (_MOST_FILLS - len(fills))
        counts = [each.words for each in fills]
        self.set(program, words=(*(int(each.word) for each in fills), *none), counts=(*counts, *none))
        self.dispatch(program, -(-max(counts) // _FILLED))

    def check_memory(self, *made: Resource) -> None:
        """Release what was just made, and raise Scan4DError, where there was no memory for it: drivers only
        note that, and whatever is done with it then may end the process."""
        errors = set[str]()
        while (error := self.ctx.error) not in ("GL_NO_ERROR", *errors):
            errors.add(error)
        if "GL_OUT_OF_MEMORY" in errors:
            for resource in made:
                resource.release()
            what = "not enough memory" if self.software else "not enough memory on the graphics card"
            raise Scan4DError(
                f"{what} for this picture", hint="Use a smaller picture, or close other programs"
            )

    def discard(self, *resources: Resource | None, nbytes: int = 0) -> None:
        """Have these released by the next `collect`. From any thread, a finalizer's too. nbytes: of large
        ones, which software drivers hold in this process: they go back to the system."""
        self._discarded.extend(r for r in resources if r is not None)
        self._discarded_bytes += nbytes

    def collect(self) -> None:
        """Release what was discarded; on the GL thread only."""
        self.activate()
        while self._discarded:
            self._discarded.popleft().release()
        if self.software and self._discarded_bytes > _MUCH:
            give_memory_back()
            self._discarded_bytes = 0

    def set(self, program: Program, **values: Uniform) -> None:
        """Set uniforms by name: what changes from one call of a program to the next.

        Those that the compiler found unused are passed over. Raises ShaderError for a name that the program's
        source does not declare.
        """
        program.extra.uniforms.set(values)

    def dispatch(self, program: moderngl.ComputeShader, count: int) -> None:
        """Run one invocation for each of `count` items: `item()` in shaders, which is less than `item_count`
        but for the last group's."""
        groups = -(-count // GROUP)
        if groups:
            built: Built = program.extra
            built.uniforms.set({"item_count": count})
            if built.values is not None:
                built.values.bind()
            rows = -(-groups // GROUP_LIMIT)
            program.run(-(-groups // rows), rows)
            self.ctx.memory_barrier()

    def dispatch_indirect(self, program: moderngl.ComputeShader, groups: moderngl.Buffer) -> None:
        """Run as many work groups as a buffer says that begins with their three numbers."""
        _bind_values(program)
        program.run_indirect(groups)
        self.ctx.memory_barrier()

    @contextmanager
    def vertices(
        self,
        program: moderngl.Program,
        content: Sequence[tuple[moderngl.Buffer, str, str]] = (),
        indices: moderngl.Buffer | None = None,
    ) -> Iterator[moderngl.VertexArray]:
        """Vertex array to draw a program with, and nothing else, inside. content: (buffer, format, attribute)
        of each; indices: a uint32 each."""
        array = self.ctx.vertex_array(program, list(content), index_buffer=indices)
        _bind_values(program)
        try:
            yield array
        finally:
            array.release()


def _bind_values(program: Program) -> None:
    """Make the params of a program those that shaders read."""
    if program.extra.values is not None:
        program.extra.values.bind()


def headless(device: int | None = None, attempts: Attempts | None = None) -> Gpu:
    """A context without a window: EGL on Linux, a hidden window elsewhere.

    device: which of several GPUs (EGL's order); None: the environment's SCAN4D_DEVICE,
    else the driver's choice. Raises NoOpenGLError (with what was tried), InputError.
    """
    attempts = attempts if attempts is not None else Attempts()
    if device is None:
        device = device_from_environment()
    if device is not None and device < 0:
        raise InputError(f"there is no device with the number {device}", "--device", "Use 0, 1, ...")
    options: list[tuple[str, dict[str, Any]]] = []
    if sys.platform.startswith("linux"):
        name = "EGL" if device is None else f"EGL device {device}"
        options.append((name, {"backend": "egl", "device_index": device or 0}))
        if device is None and os.environ.get("DISPLAY"):
            options.append(("GLX, hidden window", {}))
    else:
        options.append(("hidden window", {}))
    shader_cache()
    for how, settings in options:
        try:
            ctx = moderngl.create_context(standalone=True, require=REQUIRED_VERSION, **settings)
            gpu = Gpu(ctx, headless=True)
        except NoOpenGLError as error:
            attempts.log.append((how, error.what))
        except Exception as error:  # moderngl and glcontext raise bare Exceptions
            attempts.log.append((how, str(error) or type(error).__name__))
        else:
            attempts.log.append((how, f"{gpu.device}, OpenGL {gpu.driver}"))
            return gpu
    how, settings = options[0]
    if (too_old := _too_old(settings)) is not None:
        attempts.log.append((f"{how}, any version", too_old.what))
        raise too_old
    if device:
        raise NoOpenGLError(
            f"no usable OpenGL on device {device} ({attempts})",
            hint="'scan4d doctor' lists the devices. Without --device, the driver chooses a device",
        )
    raise NoOpenGLError(
        f"no usable OpenGL ({attempts})",
        hint="Install a graphics driver, or Mesa's software OpenGL (Debian: apt-get install libegl1 "
        "libgl1 libgl1-mesa-dri libegl-mesa0); 'scan4d doctor' has details",
    )


def obstacle() -> str | None:
    """Why nothing can be drawn on this machine, with a window or without; None where it can."""
    try:
        headless(0).ctx.release()  # a device, so that no display is asked, which may have failed before
    except NoOpenGLError as error:
        return error.what
    return None


def _too_old(settings: Mapping[str, Any]) -> NoOpenGLError | None:
    """Error of an older OpenGL than the one that is needed, where there is one."""
    with suppress(Exception):
        ctx = moderngl.create_context(standalone=True, require=_OLDEST_VERSION, **settings)
        try:
            Gpu(ctx)
        except NoOpenGLError as error:
            return error
        finally:
            ctx.release()
    return None


def device_from_environment() -> int | None:
    """SCAN4D_DEVICE as a number, None where it is not set; raises InputError."""
    text = os.environ.get("SCAN4D_DEVICE", "")
    if not text:
        return None
    if not text.isdigit():
        raise InputError(
            f"'{text}' must be the number of a device, such as 0", "SCAN4D_DEVICE", "Use 0, 1, ..."
        )
    return int(text)
