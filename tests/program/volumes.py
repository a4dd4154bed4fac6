"""Volumes with a known surface, written in every format that is read, from nothing but numpy."""

import gzip
import struct
import zlib

import numpy as np

# An ellipsoid that no mirror or turn about an axis leaves in place, LPS, mm.
CENTER = np.array([12.0, -30.0, 45.0])
AXES = np.array([[0.6, 0.64, -0.48], [-0.8, 0.48, -0.36], [0.0, 0.6, 0.8]])  # a rotation
RADII = np.array([9.0, 14.0, 21.0])

# A grid around it whose axes are turned against the patient's.
SPACING = np.array([1.3, 1.1, 1.7])
TURN = np.array([[0.36, 0.48, -0.8], [-0.8, 0.6, 0.0], [0.48, 0.64, 0.6]]).T
SIZE = np.array([48, 50, 40])
ORIGIN = CENTER - TURN @ (SPACING * (SIZE - 1) / 2)


def level_of(points):
    """1 on the ellipsoid, less outside; points [..., 3]."""
    return 2 - np.linalg.norm((points - CENTER) @ AXES / RADII, axis=-1)


def samples(origin=ORIGIN, turn=TURN, spacing=SPACING, size=SIZE):
    """Values at the voxel centers times 1000, [k, j, i], as 16-bit numbers."""
    k, j, i = np.meshgrid(*(np.arange(n) for n in size[::-1]), indexing="ij")
    points = origin + np.stack([i, j, k], axis=-1) * spacing @ turn.T
    return np.rint(1000 * level_of(points)).astype("<i2")


def write_meta(file, values, spacing=SPACING, compressed=False, local=True):
    """MetaImage: .mha, or .mhd with .raw or .zraw beside it."""
    data = values.tobytes()
    data = zlib.compress(data) if compressed else data
    raw = file.with_suffix(".zraw" if compressed else ".raw")
    text = "ObjectType = Image\nNDims = 3\nBinaryData = True\nBinaryDataByteOrderMSB = False\n"
    text += f"CompressedData = {compressed}\n"
    text += f"CompressedDataSize = {len(data)}\n" if compressed else ""
    text += f"TransformMatrix = {' '.join(map(repr, TURN.T.ravel().tolist()))}\n"
    text += f"Offset = {' '.join(map(repr, ORIGIN.tolist()))}\n"
    text += f"ElementSpacing = {' '.join(map(str, spacing))}\n"
    text += f"DimSize = {' '.join(map(str, values.shape[::-1]))}\nElementType = MET_SHORT\n"
    text += f"ElementDataFile = {'LOCAL' if local else raw.name}\n"
    file.write_bytes(text.encode() + (data if local else b""))
    if not local:
        raw.write_bytes(data)
    return file


def write_nrrd(file, values, spacing=SPACING, space="left-posterior-superior", compressed=True):
    """NRRD; `space` may be right-anterior-superior, in which x and y change their signs."""
    flip = np.array([-1, -1, 1]) if space.startswith("right-anterior") else np.ones(3)
    vectors = [f"({','.join(map(repr, (flip * TURN[:, a] * spacing[a]).tolist()))})"
               for a in range(3)]
    text = f"NRRD0004\ntype: short\ndimension: 3\nspace: {space}\nendian: little\n"
    text += f"sizes: {' '.join(map(str, values.shape[::-1]))}\n"
    text += f"space directions: {' '.join(vectors)}\nkinds: domain domain domain\n"
    text += f"space origin: ({','.join(map(repr, (flip * ORIGIN).tolist()))})\n"
    text += f"encoding: {'gzip' if compressed else 'raw'}\n\n"
    data = values.tobytes()
    file.write_bytes(text.encode() + (gzip.compress(data) if compressed else data))
    return file


def write_nifti(file, values, spacing=SPACING, volumes=1, sform=1):
    """NIfTI-1 with an sform, which is RAS: x and y have the opposite sign."""
    header = bytearray(352)
    to_ras = np.diag([-1.0, -1, 1]) @ np.column_stack([TURN * SPACING, ORIGIN])  # sound in any case
    struct.pack_into("<i", header, 0, 348)
    dimensions = 3 if volumes == 1 else 4
    struct.pack_into("<8h", header, 40, dimensions, *values.shape[::-1], volumes, 1, 1, 1)
    struct.pack_into("<2h", header, 70, 4, 16)
    struct.pack_into("<8f", header, 76, 1, *spacing, 1, 1, 1, 1)
    struct.pack_into("<2f", header, 108, 352, 1)
    struct.pack_into("<B", header, 123, 2)
    struct.pack_into("<2h", header, 252, 0, sform)
    for row in range(3):
        struct.pack_into("<4f", header, 280 + 16 * row, *to_ras[row])
    header[344:348] = b"n+1\0"
    data = bytes(header) + values.tobytes() * volumes
    file.write_bytes(gzip.compress(data) if file.suffix == ".gz" else data)
    return file


def element(group, number, kind, value):
    """One data element of DICOM in explicit little endian."""
    if isinstance(value, str):
        value = value.encode() + (b"\0" if kind == "UI" else b" ") * (len(value) % 2)
    long = kind in ("OB", "OW")
    size = struct.pack("<2xI", len(value)) if long else struct.pack("<H", len(value))
    return struct.pack("<2H", group, number) + kind.encode() + size + value


def write_slice(file, values, position, series="1.2.3", title="bone", number=1, spacing=SPACING):
    """One CT slice [rows, columns] with its center of pixel (0, 0) at `position`, LPS."""
    def numbers(entries):
        return "\\".join(f"{entry:.10g}" for entry in entries)

    meta = (element(2, 1, "OB", b"\0\1") + element(2, 2, "UI", "1.2.840.10008.5.1.4.1.1.2")
            + element(2, 3, "UI", f"{series}.{number}")
            + element(2, 0x10, "UI", "1.2.840.10008.1.2.1"))
    rows, columns = values.shape
    body = [(8, 0x16, "UI", "1.2.840.10008.5.1.4.1.1.2"), (8, 0x18, "UI", f"{series}.{number}"),
            (8, 0x60, "CS", "CT"), (8, 0x103e, "LO", title), (0x20, 0xd, "UI", "1.2"),
            (0x20, 0xe, "UI", series), (0x20, 0x13, "IS", str(number)),
            (0x20, 0x32, "DS", numbers(position)),
            (0x20, 0x37, "DS", numbers([*TURN[:, 0], *TURN[:, 1]])),
            (0x28, 2, "US", struct.pack("<H", 1)), (0x28, 4, "CS", "MONOCHROME2"),
            (0x28, 0x10, "US", struct.pack("<H", rows)),
            (0x28, 0x11, "US", struct.pack("<H", columns)),
            (0x28, 0x30, "DS", numbers([spacing[1], spacing[0]])),
            (0x28, 0x100, "US", struct.pack("<H", 16)), (0x28, 0x101, "US", struct.pack("<H", 16)),
            (0x28, 0x102, "US", struct.pack("<H", 15)), (0x28, 0x103, "US", struct.pack("<H", 1)),
            (0x28, 0x1052, "DS", "-1024"), (0x28, 0x1053, "DS", "0.5"),
            (0x7fe0, 0x10, "OW", (2 * (values.astype(int) + 1024)).astype("<i2").tobytes())]
    file.write_bytes(bytes(128) + b"DICM" + element(2, 0, "UL", struct.pack("<I", len(meta)))
                     + meta + b"".join(element(*entry) for entry in sorted(body)))


def write_dicom(folder, values, step=None, **options):
    """A folder of slices, named so that their names are in no order; `step`, mm, may lean."""
    folder.mkdir(exist_ok=True)
    step = TURN[:, 2] * SPACING[2] if step is None else step
    for k, slice_values in enumerate(values):
        name = f"{(37 * k) % 101:03}_{options.get('series', '')}.dcm"
        write_slice(folder / name, slice_values, ORIGIN + k * step, number=k + 1, **options)
    return folder


def voxels_inside(points, triangles, origin, spacing, size):
    """Which voxels [k, j, i] lie inside a closed surface: those behind an odd number of crossings of
    their line along y."""
    columns = [origin[a] + spacing * np.arange(size[a]) + 1.7e-4 for a in range(3)]
    crossings = np.zeros((size[2], size[1] + 1, size[0]), int)
    for a, b, c in points[triangles]:
        (i0, k0), (i1, k1) = (np.clip(np.ceil((f([a, b, c], axis=0)[[0, 2]] - (origin[0], origin[2]) - 1.7e-4)
                                              / spacing), 0, (size[0], size[2])).astype(int)
                              for f in (np.min, np.max))
        if i0 >= i1 or k0 >= k1:
            continue
        x, z = np.meshgrid(columns[0][i0:i1], columns[2][k0:k1])
        area = (b[0] - a[0]) * (c[2] - a[2]) - (c[0] - a[0]) * (b[2] - a[2])
        if area == 0:
            continue
        v = ((x - a[0]) * (c[2] - a[2]) - (c[0] - a[0]) * (z - a[2])) / area
        w = ((b[0] - a[0]) * (z - a[2]) - (x - a[0]) * (b[2] - a[2])) / area
        hit = (v >= 0) & (w >= 0) & (v + w <= 1)
        y = (1 - v - w) * a[1] + v * b[1] + w * c[1]
        j = np.clip(np.ceil((y - columns[1][0]) / spacing), 0, size[1]).astype(int)
        k, i = np.nonzero(hit)
        np.add.at(crossings, (k + k0, j[hit], i + i0), 1)
    return np.cumsum(crossings, axis=1)[:, :-1] % 2 == 1


def write_segmentation(file, labels, names, origin, spacing):
    """A segmentation of 3D Slicer of one layer, LPS; label n + 1 has the n-th name."""
    text = "NRRD0004\ntype: unsigned char\ndimension: 3\nspace: left-posterior-superior\n"
    text += f"sizes: {' '.join(map(str, labels.shape[::-1]))}\n"
    text += f"space directions: ({spacing},0,0) (0,{spacing},0) (0,0,{spacing})\n"
    text += "kinds: domain domain domain\nencoding: gzip\n"
    text += f"space origin: ({','.join(map(str, origin))})\n"
    for n, name in enumerate(names):
        text += (f"Segment{n}_ID:=Segment_{n + 1}\nSegment{n}_LabelValue:={n + 1}\n"
                 f"Segment{n}_Layer:=0\nSegment{n}_Name:={name}\n")
    file.write_bytes(text.encode() + b"\n" + gzip.compress(labels.astype("u1").tobytes(), 1))
    return file
