"""How deep points at a scene's first cut lie in the tissue of its other side: depths from prisms and their
places alone, the points of each side from the nets of the file."""

import numpy as np
from scipy.sparse import coo_matrix
from scipy.sparse.csgraph import dijkstra
from scipy.spatial import cKDTree

from format_reader import closest_on_triangles
from tissue import last, model_of

NEAR = 12.0  # mm, farther than a prism is long


def sides(model):
    """1 or 2 of each point within four edges of a cut that lies nearer to that of its sides, otherwise 0."""
    begin, point = model["contact/wall/begin"], model["contact/wall/point"]
    columns, rows = model["contact/wall/net"][0]
    along = [{point[begin[net * columns * rows + c]] for c in range(columns * rows)} for net in (0, 1)]
    tips = along[0] & along[1]
    pairs = np.concatenate([model["prism/points"][:, [i, j]] for i in range(6) for j in range(i)])
    pairs = pairs[~np.isin(pairs, list(tips)).any(axis=1)]
    number = len(model["point/position"])
    edges = coo_matrix((np.ones(len(pairs)), pairs.T), (number, number)).tocsr()
    first, second = (dijkstra(edges, False, sorted(side - tips), unweighted=True, limit=4, min_only=True)
                     for side in along)
    return np.where(first < second, 1, np.where(second < first, 2, 0))


def surface(prisms):
    """Triangles of faces that belong to one prism."""
    quads = np.concatenate([prisms[:, [a, b, b + 3, a + 3]] for a, b in ((0, 1), (1, 2), (2, 0))])
    found = []
    for faces, corners in ((quads, ((0, 1, 2), (0, 2, 3))), (prisms.reshape(-1, 3), ((0, 1, 2),))):
        _, first, count = np.unique(np.sort(faces, axis=1), axis=0, return_index=True, return_counts=True)
        found += [faces[first[count == 1]][:, c] for c in corners]
    return np.concatenate(found)


def depths(file):
    """Depths, mm, of the points that lie in a prism of the other side, below its surface."""
    model, x = model_of(file), last(file)["point/position"]
    prisms, side = model["prism/points"], sides(model)
    tetrahedra = np.concatenate([prisms[:, k:k + 4] for k in range(3)])
    outer = surface(prisms)
    deep = []
    for own, other in ((1, 2), (2, 1)):
        of_other = lambda cells: cells[(side[cells] == other).any(axis=1) & (side[cells] != own).all(axis=1)]
        cells, faces = of_other(tetrahedra), of_other(outer)
        to_cells, to_faces = (cKDTree(x[c].mean(axis=1)) for c in (cells, faces))
        for p in np.unique(outer[side[outer] == own]):
            near = cells[to_cells.query_ball_point(x[p], NEAR)]
            corner = x[near]
            shares = np.linalg.solve((corner[:, 1:] - corner[:, :1]).transpose(0, 2, 1),
                                     (x[p] - corner[:, 0])[:, :, None])[:, :, 0]
            if ((shares > 1e-9).all(axis=1) & (shares.sum(axis=1) < 1 - 1e-9)).any():
                corners = x[faces[to_faces.query_ball_point(x[p], NEAR)]].transpose(1, 0, 2)
                deep.append(np.sqrt(closest_on_triangles(x[[p]], *corners).min()))
    return np.array(deep)
