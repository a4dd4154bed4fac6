"""Faces after their bones have moved, from the resident solver repose-live (docs/guide/live.md).

    import repose
    with repose.Session("meshes/head_live.yaml") as session:
        face = session.solve({"mandible": {"translate": [0, -3, 0]}})
        face.displacement, face.mesh()          # NumPy array of the skin; meshio mesh
"""

from .scene import Scene
from .session import Face, Piece, Refused, Session, Tangent

__all__ = ["Face", "Piece", "Refused", "Scene", "Session", "Tangent"]
