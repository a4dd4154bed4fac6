"""What report.py, render.py and the panel of 3D Slicer share: the result, the skin to show, landmarks,
measures, and the pages made of them. Needs NumPy and h5py."""

import math

# Colors of a distance in mm, from none to far: in pictures, pages and ParaView.
RAMP = ("fcf3dc", "fed395", "fe9f6d", "f1605d", "c03a76", "832681", "4a1079")
REGION = ("a8acb2", "2a9d8f")  # of skin as given, and computed


def rounded_up(number):
    """The number rounded up to two digits."""
    digit = 10.0 ** (math.floor(math.log10(number)) - 1) if number > 0 else 1.0
    return float(math.ceil(number / digit * (1 - 1e-12)) * digit)
