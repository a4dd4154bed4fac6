"""What report.py, render.py and the panel of 3D Slicer share: the result, the skin to show, landmarks,
measures, and the pages made of them. Needs NumPy and h5py."""

# Colors of a distance in mm, from none to far: in pictures, pages and ParaView.
RAMP = ("fcf3dc", "fed395", "fe9f6d", "f1605d", "c03a76", "832681", "4a1079")
