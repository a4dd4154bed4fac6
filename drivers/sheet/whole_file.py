"""Files that a script writes: complete or absent, and never one that it reads."""

import contextlib
import io
import os

from sheet.script import REMEDIES, Unusable


class Target:
    """A file to write. It is refused at once, and again when it is written, where it has none of the
    endings, is one of the inputs, or exists and is no regular file."""

    def __init__(self, file, endings, inputs=()):
        self.file, self.inputs = os.fspath(file), list(filter(None, inputs))
        if not self.file.lower().endswith(endings):
            known = " or ".join([endings] if isinstance(endings, str) else endings)
            raise Unusable(f"{file}: cannot be written: its name does not end in {known}; choose another one")
        self.check()

    def __str__(self):
        return self.file

    def check(self):
        folder = os.path.dirname(self.file) or "."
        if not os.path.isdir(folder):
            raise Unusable(f"{self.file}: cannot be written: there is no folder {folder}; make it first")
        if not os.access(folder, os.W_OK | os.X_OK):
            raise Unusable(f"{self.file}: cannot be written: folder {folder} is read-only; choose another one")
        there = os.path.exists(self.file)
        if there and not os.path.isfile(self.file):
            raise Unusable(f"{self.file}: cannot be written: it is no regular file; choose another name")
        if there and any(os.path.exists(file) and os.path.samefile(file, self.file) for file in self.inputs):
            raise Unusable(f"{self.file}: is an input of this run and would be replaced; choose another name")
        with self.part() as part:  # names and folders that the system refuses
            os.remove(part)

    @contextlib.contextmanager
    def part(self):
        """The name of a new file beside the target, to be renamed or removed; it is removed after a failure."""
        part, began = f"{self.file}.{os.getpid()}.part", False
        try:
            with open(part, "wb"):
                began = True
            yield part
        except BaseException as reason:
            if began and os.path.exists(part):
                os.remove(part)
            if not isinstance(reason, OSError):
                raise
            remedy = REMEDIES.get(reason.errno, "choose another name or folder")
            raise Unusable(f"{self.file}: cannot be written: {reason.strerror}; {remedy}") from None

    def write(self, data):
        """Writes bytes or text to another name, and renames that."""
        self.check()
        with self.part() as part:
            with open(part, "wb") as out:
                out.write(data.encode() if isinstance(data, str) else data)
            os.replace(part, self.file)


def write_figure(figure, target):
    """Writes a figure of matplotlib as PNG and closes it."""
    import matplotlib.pyplot as plt
    picture = io.BytesIO()
    figure.savefig(picture, format="png", dpi=110, bbox_inches="tight")
    plt.close(figure)
    target.write(picture.getvalue())
    print(target)
