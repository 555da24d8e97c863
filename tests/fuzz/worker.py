"""Runs inputs in a process of its own, whose address space is limited; campaign.py starts it and watches.

    worker.py FOLDER SEED|CORPUS FIRST COUNT [KIND ...]

On its standard output it says, a line of JSON each, what it begins with and what was wrong with it.
"""

from __future__ import annotations

import json
import os
import resource
import sys
import time
import traceback
import warnings
from collections.abc import Callable
from pathlib import Path
from random import Random
from typing import Any, NamedTuple

SPARE = 200 << 20  # bytes that any file may take
PER_BYTE = 10  # the same for each byte of it
SLOW = 5.0  # seconds of processor time that reading an input may take
_WARM = 2  # files of each kind that are tried before
OUR_OWN_FAULT = (AttributeError, NameError, LookupError, RecursionError, AssertionError)  # and no library's


class Input(NamedTuple):
    """A file to be read, and drawn where it is a scan and that is asked for."""

    kind: str
    data: bytes
    drawn: bool


def main() -> None:
    """Run the inputs FIRST to FIRST + COUNT - 1, of which a SHARE is drawn."""
    said = os.fdopen(os.dup(1), "w", buffering=1)
    folder, source = Path(sys.argv[1]), sys.argv[2]
    first, count = map(int, sys.argv[3:5])
    share, named = float(sys.argv[5]), sys.argv[6:]
    output = os.open(folder / "output", os.O_RDWR | os.O_CREAT | os.O_TRUNC)
    os.dup2(output, 1)
    os.dup2(output, 2)

    sys.path.append(str(Path(__file__).parents[1]))  # where the tests' helpers are
    from kinds import corpus, data_folder, file_name, seeds

    (folder / "seeds").mkdir(exist_ok=True)
    whole = seeds(folder / "seeds", data_folder())
    warned: list[str] = []
    warnings.simplefilter("always")
    warnings.showwarning = lambda message, category, *_: warned.append(f"{category.__name__}: {message}")
    kinds = named or sorted(whole)
    for kind in kinds:  # so that what libraries need is there before memory is limited
        for number, data in enumerate(whole[kind][:_WARM]):
            _run(Input(kind, data, drawn=share > 0 and not number), folder)
    if source.isdecimal():
        of = damaged_seeds(int(source), whole, kinds, share)
    else:
        of = corpus(Path(source), share > 0)
    said_before = os.fstat(output).st_size
    warned.clear()
    print(json.dumps({"ready": True}), file=said)
    for number in range(first, first + count):
        each = Input(*of(number))
        print(json.dumps({"begins": number, "kind": each.kind, "drawn": each.drawn}), file=said)
        _limit_memory(SPARE + PER_BYTE * len(each.data))
        began = time.process_time()
        outcome, wrong = _run(each, folder)
        taken = time.process_time() - began
        if not each.drawn and taken > SLOW:
            wrong = wrong or f"slow: {taken:.0f} s of processor time"
        _limit_memory(None)
        if warned:
            wrong = wrong or f"warning: {warned[0]}"
        if os.fstat(output).st_size > said_before:
            wrong = wrong or f"output: {os.pread(output, 200, said_before)!r}"
        said_before = os.fstat(output).st_size
        warned.clear()
        if wrong:
            kept = folder.parent / "found" / f"{number}-{file_name(each.kind)}"
            kept.parent.mkdir(exist_ok=True)
            kept.write_bytes(each.data)
        print(json.dumps({"ended": number, "outcome": outcome, "wrong": wrong}), file=said)


def damaged_seeds(
    seed: int, whole: dict[str, list[bytes]], kinds: list[str], share: float
) -> Callable[[int], tuple[str, bytes, bool]]:
    """Inputs by number, without end; the same for the same seed."""
    from mutations import damaged

    def of(number: int) -> tuple[str, bytes, bool]:
        rng = Random(f"{seed} {number}")
        kind = rng.choice(kinds)
        data = damaged(rng.choice(whole[kind]), kind[kind.rindex(".") :], rng)
        return kind, data, rng.random() < share

    return of


def _run(each: Input, folder: Path) -> tuple[str, str | None]:
    """("read" or "refused", what is wrong about it)."""
    from kinds import file_name, use

    from viewer.errors import Scan4DError

    path = folder / file_name(each.kind)
    path.write_bytes(each.data)
    try:
        use(each.kind, each.drawn)(path)
    except Scan4DError as error:
        names = str(path), path.name
        is_told = not each.kind.startswith(".") or (str(error).startswith(names) and error.hint)
        return "refused", _wrong_refusal(error) if is_told else f"message: no place or hint: {error}"
    except MemoryError as error:
        return "failed", f"allocation: {_place(error)}"
    except BaseException as error:
        return "failed", f"exception: {_place(error)}"
    return "read", None


def _wrong_refusal(error: Any) -> str | None:
    """What is wrong with a message: it hides a fault of ours, or memory that ran out, or cannot be read."""
    text = str(error)
    cause = error.__cause__
    if isinstance(cause, OUR_OWN_FAULT):
        return f"fault: {_place(cause)}"
    if isinstance(cause, MemoryError) or "not enough memory" in text:
        return f"allocation: {_place(cause or error)}"
    if "\n" in text or len(text) > 1500:
        return f"message: {text[:100]!r}, {len(text)} letters"
    return None


def _place(error: BaseException) -> str:
    """The error, and the last line of the project on its way."""
    frames = traceback.extract_tb(error.__traceback__)
    ours = [each for each in frames if "viewer" in each.filename] or frames
    place = f"{Path(ours[-1].filename).name}:{ours[-1].lineno}" if ours else "?"
    return f"{type(error).__name__} at {place}: {str(error)[:120]}"


def _limit_memory(beyond: int | None) -> None:
    """Let the address space grow by no more than this from now on, bytes; None: as much as it likes."""
    size = int(Path("/proc/self/statm").read_text().split()[0]) * resource.getpagesize()
    limit = resource.RLIM_INFINITY if beyond is None else size + beyond
    resource.setrlimit(resource.RLIMIT_AS, (limit, resource.RLIM_INFINITY))


if __name__ == "__main__":
    main()
