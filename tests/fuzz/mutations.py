"""Damaged forms of whole files: of their bytes, of the numbers and words in them, and of packed members.

Each is a function of (data, rng); the same generator gives the same damage.
"""

from __future__ import annotations

import io
import json
import re
import struct
import warnings
import zlib
from collections.abc import Callable
from random import Random
from typing import Any
from zipfile import ZIP_BZIP2, ZIP_DEFLATED, ZIP_LZMA, ZIP_STORED, BadZipFile, ZipFile

HEAD = 600  # bytes of a file that hold its header, as a rule
HARD_NUMBERS = (-1, 0, 1, 3, 255, 10**4, 2**31 - 1, 2**31, 2**32, 10**12, 2**63 - 1, 2**63, 10**40)
HARD_FLOATS = (0.0, -0.0, 1e-320, 1e-38, 1.5, 1e15, 1e19, 3.5e38, 1e308, float("inf"), float("nan"))
HARD_VALUES: tuple[Any, ...] = (
    None, True, False, [], {}, "", "\0", "\ud800", "\x1b[31m", "nan", "é" * 5000, *HARD_NUMBERS, *HARD_FLOATS,
    10**400, [[]] * 3, [1, 2, 3], {"a": 1}, "demo", "/**/*", "..",
)  # fmt: skip
_MEMBERS = 64  # of an archive that are damaged and packed anew

Mutation = Callable[[bytes, Random], bytes]


def mutate(data: bytes, rng: Random) -> bytes:
    """The data with one to five damages."""
    for _ in range(rng.choice((1, 1, 1, 2, 3, 5))):
        data = rng.choice(_MUTATIONS)(data, rng)
    return data


def cut(data: bytes, rng: Random) -> bytes:
    return data[: rng.randrange(len(data) + 1)]


def flip(data: bytes, rng: Random) -> bytes:
    changed = bytearray(data or b"x")
    for _ in range(rng.choice((1, 1, 4, 16))):
        changed[_place(data, rng) % len(changed)] ^= 1 << rng.randrange(8)
    return bytes(changed)


def splice(data: bytes, rng: Random) -> bytes:
    """Put some bytes, of its own or by chance, in place of others."""
    at, other = _place(data, rng), _place(data, rng)
    new = rng.randbytes(rng.randrange(40)) if rng.random() < 0.5 else data[other : other + rng.randrange(200)]
    return data[:at] + new + data[at + rng.randrange(40) :]


def repeat(data: bytes, rng: Random) -> bytes:
    """Say a part many times."""
    at = _place(data, rng)
    part = data[at : at + rng.randrange(1, 60)]
    return data[:at] + part * rng.choice((2, 10, 300)) + data[at:]


def renumber(data: bytes, rng: Random) -> bytes:
    """Put a number that is harder to bear in place of one in the text of the header."""
    if not (numbers := list(re.finditer(rb"-?\d+(\.\d+)?", data[:HEAD]))):
        return flip(data, rng)
    old = rng.choice(numbers)
    new = rng.choice(HARD_NUMBERS) if rng.random() < 0.7 else rng.choice(HARD_FLOATS)
    return data[: old.start()] + str(new).encode() + data[old.end() :]


def reword(data: bytes, rng: Random) -> bytes:
    """Remove, double or exchange a word of the header."""
    if not (words := list(re.finditer(rb"[^\s,;]+", data[:HEAD]))):
        return flip(data, rng)
    old, other = rng.choice(words), rng.choice(words)
    new = rng.choice((b"", old[0] + b" " + old[0], other[0], b"nan", b"\xff\x00", b"\n", b"\x1b[2J", b"x"))
    return data[: old.start()] + new + data[old.end() :]


def rebinary(data: bytes, rng: Random) -> bytes:
    """Put a hard number, as machines hold them, somewhere."""
    kind = rng.choice(["<i", ">i", "<I", "<q", ">q", "<H", "<f", ">f", "<d", ">d"])
    values = HARD_FLOATS if kind[1] in "fd" else HARD_NUMBERS
    try:
        new = struct.pack(kind, rng.choice(values))
    except (struct.error, OverflowError):
        new = b"\xff" * struct.calcsize(kind)
    at = _place(data, rng)
    return data[:at] + new + data[at + len(new) :]


def repack(data: bytes, rng: Random) -> bytes:
    """Damage a member of a ZIP archive, so that its check sums hold; or store it in another way."""
    try:
        with ZipFile(io.BytesIO(data)) as archive:
            members = [(each.filename, archive.read(each)) for each in archive.infolist()[:_MEMBERS]]
    except (BadZipFile, ValueError, NotImplementedError, RuntimeError, EOFError, OSError, zlib.error):
        members = []
    if not members:
        return flip(data, rng)
    at = rng.randrange(len(members))
    name, content = members[at]
    choice = rng.random()
    if choice < 0.6:
        members[at] = name, mutate(content, rng)
    elif choice < 0.7:
        members.append((name, content))
    elif choice < 0.8:
        members[at] = rng.choice(members)[0], content
    packed = io.BytesIO()
    method = rng.choice((ZIP_STORED, ZIP_DEFLATED, ZIP_DEFLATED, ZIP_BZIP2, ZIP_LZMA))
    with warnings.catch_warnings(), ZipFile(packed, "w", method) as archive:
        warnings.simplefilter("ignore")  # of names that are there twice
        for name, content in members:
            archive.writestr(name, content)
    return packed.getvalue()


def reseal(data: bytes, rng: Random) -> bytes:
    """Damage the header of an octree and give it a valid check sum (docs/reference/octree-files.md)."""
    fixed = struct.calcsize("<4s6BI5d2Q")
    if not data.startswith(b"\x8dSVO") or len(data) < fixed:
        return rebinary(data, rng)
    depth, unit = data[7], data[8]
    end = fixed + unit + (depth + 1) * 16
    head = bytearray(data[:end])
    for _ in range(rng.choice((1, 1, 3))):
        at = rng.randrange(5, max(len(head), 6))
        new = rng.choice(
            (b"\xff", b"\0", b"\1", b"\xff\xff\xff\x7f", struct.pack("<d", rng.choice(HARD_FLOATS)))
        )
        head[at : at + len(new)] = new
    head = head[:end]
    return bytes(head) + struct.pack("<I", zlib.crc32(head)) + data[end + 4 :]


def rejson(data: bytes, rng: Random) -> bytes:
    """Put a hard value somewhere in JSON."""
    try:
        value = json.loads(data)
    except (ValueError, RecursionError):
        return reword(data, rng)
    holder: Any = [value]
    key: Any = 0
    while isinstance(holder[key], dict | list) and holder[key] and rng.random() < 0.85:
        holder = holder[key]
        key = rng.choice([*holder]) if isinstance(holder, dict) else rng.randrange(len(holder))
    choice = rng.random()
    if choice < 0.8:
        holder[key] = rng.choice(HARD_VALUES)
    elif isinstance(holder, dict):
        holder[rng.choice(("", "x", "\x1b[2J", "format", "pose"))] = holder.pop(key)
    text = json.dumps(value)
    if rng.random() < 0.05:
        text = text.replace("0", "[" * 20_000, 1)
    return text.encode()


def refolder(data: bytes, rng: Random) -> bytes:
    """Damage a file of a packed folder, or how its files name one another."""
    try:
        with ZipFile(io.BytesIO(data)) as archive:
            files = {each.filename: archive.read(each) for each in archive.infolist()}
    except (BadZipFile, ValueError, NotImplementedError, RuntimeError, EOFError, OSError, zlib.error):
        return data
    name = rng.choice(sorted(files))
    texts = [each for each in files if each.endswith((".txt", ".conf", ".match", ".log", ".json"))]
    pictures = [each for each in files if each.endswith(".png")]
    choice = rng.random()
    if choice < 0.5:
        files[name] = damaged(files[name], name[name.rindex(".") :], rng)
    elif choice < 0.6:
        files[rng.choice(sorted(files))] = files[name]
    elif choice < 0.65:
        del files[name]
    elif choice < 0.8 and texts:
        name = rng.choice(texts)
        files[name] = rng.choice((_repeated, _led_out, _renamed))(files[name], rng)
    elif choice < 0.9 and pictures:
        width, height = (rng.choice((1, 100, 1000, 4000)) for _ in range(2))
        files[rng.choice(pictures)] = flat_picture(width, height)
    else:
        files[name] = mutate(files[name], rng)
    packed = io.BytesIO()
    with ZipFile(packed, "w", ZIP_STORED) as archive:
        for each, content in files.items():
            archive.writestr(each, content)
    return packed.getvalue()


def _repeated(text: bytes, rng: Random) -> bytes:
    """A line, or an element of a list, many times over: with another number at its beginning, or not."""
    if b'"pods": [' in text and rng.random() < 0.7:
        value = json.loads(text)
        number = rng.choice((3, 64, 65))
        value["pods"] = [{**value["pods"][0], "name": str(n)} for n in range(number)]
        return json.dumps(value).encode()
    lines = text.splitlines() or [b""]
    line, count = rng.choice(lines), rng.choice((10, 300, 6000))
    words, step = line.split(), rng.choice((0.0, 1e-6, 0.04))
    if step and words and re.fullmatch(rb"[0-9.]+", words[0]):
        rest = b" ".join(words[1:])
        lines += [b"%.6f %b" % (float(words[0]) + n * step, rest) for n in range(count)]
    else:
        lines += [line] * count
    return b"\n".join(lines)


def _led_out(text: bytes, rng: Random) -> bytes:
    """A name that leads out of the folder."""
    names = list(re.finditer(rb"[\w/*-]+\.(png|jpg|ply|npz|tif)", text))
    if not names:
        return text
    old = rng.choice(names)
    out = (b"../", b"/", b"/etc/", b"a/../../", b"./", b"\\\\host\\", b"C:/")
    return text[: old.start()] + rng.choice(out) + text[old.start() :]


def _renamed(text: bytes, rng: Random) -> bytes:
    """All names of files are one of them."""
    names = [each[0] for each in re.finditer(rb"[\w/*-]+\.(png|jpg|ply|npz|tif)", text)]
    return re.sub(rb"[\w/*-]+\.(png|jpg|ply|npz|tif)", rng.choice(names), text) if names else text


def flat_picture(width: int, height: int) -> bytes:
    """A 16-bit grey PNG of one depth, which packs to a thousandth."""
    head = struct.pack(">IIBBBBB", width, height, 16, 0, 0, 0, 0)
    rows = zlib.compress((b"\0" + b"\3\xe8" * width) * height, 9)
    chunks = ((b"IHDR", head), (b"IDAT", rows), (b"IEND", b""))
    packed = (struct.pack(">I", len(d)) + n + d + struct.pack(">I", zlib.crc32(n + d)) for n, d in chunks)
    return b"\x89PNG\r\n\x1a\n" + b"".join(packed)


_MUTATIONS: tuple[Mutation, ...] = (cut, flip, splice, repeat, renumber, reword, rebinary)


def damaged(data: bytes, suffix: str, rng: Random) -> bytes:
    """A damaged form of a file of this kind: more than half of the time by what knows its layout."""
    if suffix == ".folder":  # damage to the archive itself says nothing of folders
        for _ in range(rng.choice((1, 1, 2, 3))):
            data = refolder(data, rng)
        return data
    aware = {".npz": repack, ".svo": reseal, ".json": rejson}.get(suffix)
    if aware is not None and rng.random() < 0.6:
        data = aware(data, rng)
        return mutate(data, rng) if rng.random() < 0.1 else data
    return mutate(data, rng)


def _place(data: bytes, rng: Random) -> int:
    """A place in the data, in the header half of the time."""
    return rng.randrange((min(len(data), HEAD) if rng.random() < 0.5 else len(data)) + 1)
