"""The header of a PLY file, with the line ends of any system."""

import re

TYPES = {"char": "i1", "uchar": "u1", "short": "i2", "ushort": "u2", "int": "i4", "uint": "u4",
         "float": "f4", "double": "f8", "int8": "i1", "uint8": "u1", "int16": "i2", "uint16": "u2",
         "int32": "i4", "uint32": "u4", "float32": "f4", "float64": "f8"}


class Header:
    """Splits the bytes of a PLY file into its header and body, and describes its vertices: how many there
    are (`count`, 0 where they do not come first), and kind and name of each of their properties
    (`columns`). A file without a whole header is a ValueError."""

    def __init__(self, data):
        end = re.search(rb"^end_header[ \t]*\r?\n", data, re.M)
        if not data.startswith(b"ply") or not end:
            raise ValueError("the header has no end_header")
        self.bytes, self.body = data[:end.end()], data[end.end():]
        self.lines = [line.strip() for line in self.bytes.decode("ascii", "replace").splitlines()]
        elements = [i for i, line in enumerate(self.lines) if line.startswith("element")]
        self.count, self.columns = 0, []
        if elements and self.lines[elements[0]].startswith("element vertex"):
            first, behind = elements[0] + 1, (elements + [len(self.lines)])[1]
            self.count = int(self.lines[elements[0]].split()[2])
            self.columns = [tuple(line.split()[1:]) for line in self.lines[first:behind]
                            if line.startswith("property")]

    @property
    def is_text(self):
        return "format ascii 1.0" in self.lines

    def layout(self):
        """The NumPy type of a vertex in a binary body."""
        import numpy as np
        order = "<" if "format binary_little_endian 1.0" in self.lines else ">"
        return np.dtype([(name, order + TYPES[kind]) for kind, name in self.columns])

    def vertices(self):
        """The values of the vertices by the names of their properties."""
        import numpy as np
        if not self.is_text:
            return np.frombuffer(self.body, self.layout(), self.count)
        rows = np.array([row[:len(self.columns)] for row in self.rows()[0]], float)
        return {column[-1]: rows[:, k] for k, column in enumerate(self.columns)}

    def rows(self):
        """The words of each vertex in a text body, and what follows them."""
        lines = self.body.split(b"\n", self.count)
        rows, rest = [line.split() for line in lines[:self.count]], lines[self.count:]
        short = next((k for k, row in enumerate(rows) if len(row) < len(self.columns)), len(rows))
        if short < self.count:
            raise ValueError(f"vertex {short + 1} of {self.count} is missing or incomplete")
        return rows, rest
