"""The history of a document: each change is a step with a name, which can be undone and redone."""

from __future__ import annotations

from collections import deque
from collections.abc import Hashable
from dataclasses import dataclass

from .document import Document

MOST_STEPS = (
    1000  # that can be undone; a step is a document, which shares all but its change: about a kilobyte
)


@dataclass(frozen=True)
class Step:
    """A change by its name, and the document on its other side: before it to undo, after it to redo."""

    name: str
    document: Document


class History:
    """A document and the changes that led to it. document: as it is now.

    Changes that follow one another without a pause, such as those of a drag, are one step: they have the same
    merge key, and nothing else comes between them, nor `settle`.
    """

    def __init__(self, document: Document) -> None:
        self.document = document
        self._done: deque[Step] = deque(maxlen=MOST_STEPS)
        self._undone: list[Step] = []
        self._merging: Hashable = None  # the key of the last step, while it is open

    def change(self, name: str, document: Document, merge: Hashable = None) -> None:
        """Go on with another document. name: what was done, such as "Delete bookmark"; nothing where it is
        equal. merge: with the step before where that had this key; None: never.
        """
        if document == self.document:
            return
        if merge is None or merge != self._merging:
            self._done.append(Step(name, self.document))
        elif self._done[-1].document == document:  # back where it began
            self._done.pop()
            merge = None
        self.document, self._merging = document, merge
        self._undone.clear()

    def amend(self, document: Document) -> None:
        """Go on with a document that no user changed, as when its camera is fitted to the scan: no step."""
        self.document = document

    def settle(self) -> None:
        """End what goes on, such as a drag: what comes is another step."""
        self._merging = None

    @property
    def undoes(self) -> str | None:
        """The name of the change that `undo` takes back; None where there is none."""
        return self._done[-1].name if self._done else None

    @property
    def redoes(self) -> str | None:
        """The name of the change that `redo` makes again; None where there is none."""
        return self._undone[-1].name if self._undone else None

    def undo(self) -> None:
        """Take the last change back, if there is one."""
        self._go(self._done, self._undone)

    def redo(self) -> None:
        """Make the change again that was undone last, if none was made since."""
        self._go(self._undone, self._done)

    def _go(self, steps: deque[Step] | list[Step], back: deque[Step] | list[Step]) -> None:
        self.settle()
        if steps:
            step = steps.pop()
            back.append(Step(step.name, self.document))
            self.document = step.document
