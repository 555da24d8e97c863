"""How Scan4D reads a scan: one module a decision, for all readers.

A reader returns what its file says (`viewer/scan/contents.py`). The modules here decide what that means:
which columns are colours, which camera took a picture, which files are frames. Each answer is a `Decision`
in one `Reading` (`record.py`). A user corrects a decision with `Corrections` (`corrections.py`).
"""
