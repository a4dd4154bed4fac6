#!/usr/bin/env python3
"""The same solid by finite elements of another program, DOLFINx, on the model's own points: every
prism is split into three tetrahedra, and J is not averaged. Says how far results of repose-solve
are from it.

    tests/benchmark/finite_elements.py RESULT.h5 … [-degree 2] [-solver mumps] [-loads 4]
                                       [-young 0.015 -poisson 0.45] [-moving 0.1] [-folder .]
                                       [-against OTHER.h5] [-output page.md]

A result of springs gets the moduli given. Fixed points go to their targets on straight lines, in
-loads parts. -degree 1 or 2: linear or quadratic tetrahedra; an edge between two fixed points stays
straight. -solver mumps factors; gamg iterates, which quadratic tetrahedra of more than half a
million unknowns want for lack of memory. Positions at the model's points are kept in -folder, as
RESULT_linear.npy or RESULT_quadratic.npy, and found there the next time. A row of the table: the
mean and largest distance over the points of the skin that moved by more than -moving mm in the
finite elements, and the mean over the mean motion. -against: the finite elements are those of
another result, of the same skin with other layers, or one whose prisms halve.py has divided.
-output puts the table below the mark <!-- finite elements --> of a page that is there. One core;
times are CPU s.
Needs Debian 12's packages: apt-get install --no-install-recommends python3-dolfinx python3-h5py
python3-scipy (and Debian's own /usr/bin/python3, not another).
"""

import dataclasses
import logging
import os
import pathlib
import time

for name in ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS"):  # before numpy: everything on one core
    os.environ[name] = "1"

import numpy as np

import dolfinx
import ufl
from mpi4py import MPI
from petsc4py import PETSc

from page import option_parser, print_table
from continuum import with_material
from tissue import last, model_of


# a prism turned so that a given corner comes first
TURNED = np.array([[0, 1, 2, 3, 4, 5], [1, 2, 0, 4, 5, 3], [2, 0, 1, 5, 3, 4],
                   [3, 5, 4, 0, 2, 1], [4, 3, 5, 1, 0, 2], [5, 4, 3, 2, 1, 0]])
# its tetrahedra where the side across from that corner is cut from 1 to 5, and from 2 to 4
CUTS = np.array([[[0, 1, 2, 5], [0, 1, 5, 4], [0, 4, 5, 3]],
                 [[0, 1, 2, 4], [0, 4, 2, 5], [0, 4, 5, 3]]])
EDGES = np.array([[2, 3], [1, 3], [1, 2], [0, 3], [0, 2], [0, 1]])  # of a quadratic tetrahedron


def tetrahedra(x, prisms):
    """Three tetrahedra a prism, [3 M, 4]: each side is cut from the point of least number
    (Dompierre and others, 1999), so that neighbors agree."""
    turned = np.take_along_axis(prisms, TURNED[prisms.argmin(1)], 1)
    first = turned[:, [1, 5]].min(1) < turned[:, [2, 4]].min(1)
    rows = np.arange(len(prisms))[:, None, None]
    cells = turned[rows, CUTS[np.where(first, 0, 1)]].reshape(-1, 4)
    a, b, c, d = x[cells].transpose(1, 0, 2)
    flat = np.einsum("md,md->m", np.cross(b - a, c - a), d - a) <= 0
    if flat.any():
        raise SystemExit(f"{flat.sum()} tetrahedra have no positive volume: prisms too skewed")
    return cells


class Solid:
    """A model's prisms as tetrahedra of DOLFINx; moduli mu and kappa one a prism, N/mm²."""

    def __init__(self, model, mu, kappa, degree):
        self.rest, self.degree = model["point/position"], degree
        self.goal = model["point/target"] - self.rest
        cells = tetrahedra(self.rest, model["prism/points"])
        mesh = dolfinx.mesh.create_mesh(
            MPI.COMM_SELF, cells, self.rest,
            ufl.Mesh(ufl.VectorElement("Lagrange", ufl.tetrahedron, 1)))
        self.space = dolfinx.fem.VectorFunctionSpace(mesh, ("Lagrange", degree))
        self.displacement = dolfinx.fem.Function(self.space)
        self.number_nodes(mesh)
        self.fix(model["point/set"] != 0)
        prism = np.asarray(mesh.topology.original_cell_index) // 3
        self.make_forms(mesh, mu[prism], kappa[prism])

    def number_nodes(self, mesh):
        """Each node's one or two points of the model: itself, or an edge's ends."""
        per_cell = 4 if self.degree == 1 else 10
        nodes = self.space.dofmap.list.array.reshape(-1, per_cell)
        point = np.array(mesh.geometry.input_global_indices)
        corners = point[mesh.geometry.dofmap.array.reshape(-1, 4)]
        self.ends = np.empty((nodes.max() + 1, 2), int)
        self.ends[nodes[:, :4]] = corners[:, :, None]
        if self.degree == 2:
            self.ends[nodes[:, 4:]] = corners[:, EDGES]
        at = self.space.tabulate_dof_coordinates()
        assert np.allclose(at, self.rest[self.ends].mean(1), atol=1e-9)

    def fix(self, fixed):
        """Nodes whose points are all fixed are known."""
        self.known = np.flatnonzero(fixed[self.ends].all(1)).astype(np.int32)
        self.place = dolfinx.fem.Function(self.space)
        self.conditions = [dolfinx.fem.dirichletbc(self.place, self.known)]

    def load(self, part):
        goal = self.goal[self.ends].mean(1)
        self.place.x.array.reshape(-1, 3)[self.known] = part * goal[self.known]

    def make_forms(self, mesh, mu, kappa):
        u, v, w = self.displacement, ufl.TestFunction(self.space), ufl.TrialFunction(self.space)
        constants = dolfinx.fem.FunctionSpace(mesh, ("DG", 0))
        moduli_of = [dolfinx.fem.Function(constants) for _ in range(2)]
        for function, values in zip(moduli_of, (mu, kappa)):
            function.x.array[constants.dofmap.list.array] = values
        mu, kappa = moduli_of
        gradient = ufl.variable(ufl.Identity(3) + ufl.grad(u))
        det = ufl.det(gradient)
        density = (mu / 2 * (ufl.inner(gradient, gradient) - 3) - mu * (det - 1)
                   + kappa / 2 * (det - 1)**2)
        dx = ufl.dx(metadata={"quadrature_degree": 0 if self.degree == 1 else 4})
        energy = density * dx
        slope = ufl.derivative(energy, u, v)
        self.energy, self.slope, self.stiffness = (
            dolfinx.fem.form(form) for form in (energy, slope, ufl.derivative(slope, u, w)))

    def value(self):
        return dolfinx.fem.assemble_scalar(self.energy)

    def positions(self):
        """At the model's points, [N, 3] mm."""
        own = self.ends[:, 0] == self.ends[:, 1]
        found = self.rest.copy()
        found[self.ends[own, 0]] += self.displacement.x.array.reshape(-1, 3)[own]
        return found


def linear_solver(matrix, kind):
    """One of PETSc: MUMPS's factor L D Lᵀ, or conjugate gradients with GAMG to 1e-6."""
    solver = PETSc.KSP().create(MPI.COMM_SELF)
    solver.setOperators(matrix)
    solver.setType("preonly" if kind == "mumps" else "cg")
    solver.getPC().setType("cholesky" if kind == "mumps" else "gamg")
    if kind == "mumps":
        matrix.setOption(PETSc.Mat.Option.SYMMETRIC, True)
        solver.getPC().setFactorSolverType("mumps")
    else:
        solver.setTolerances(rtol=1e-6, max_it=1000)
    solver.setFromOptions()
    return solver


class Newton:
    """Newton's method of a Solid, each step halved until it leads down."""

    def __init__(self, solid, kind):
        self.solid, self.u = solid, solid.displacement.vector
        self.matrix = dolfinx.fem.petsc.create_matrix(solid.stiffness)
        self.right = dolfinx.fem.petsc.create_vector(solid.slope)
        self.step = self.right.duplicate()
        if kind == "gamg":
            self.matrix.setNearNullSpace(self.rigid_motions())
        self.solver = linear_solver(self.matrix, kind)
        self.count = 0

    def rigid_motions(self):
        return PETSc.NullSpace().createRigidBody(self.coordinates())

    def coordinates(self):
        at = self.right.duplicate()
        at.setArray(self.solid.space.tabulate_dof_coordinates().ravel())
        at.setBlockSize(3)
        return at

    def solve(self):
        """The step -H⁻¹ g with the known nodes going to their places; its largest part, mm."""
        solid = self.solid
        self.matrix.zeroEntries()
        dolfinx.fem.petsc.assemble_matrix(self.matrix, solid.stiffness, solid.conditions)
        self.matrix.assemble()
        with self.right.localForm() as local:
            local.set(0)
        dolfinx.fem.petsc.assemble_vector(self.right, solid.slope)
        dolfinx.fem.petsc.apply_lifting(self.right, [solid.stiffness], [solid.conditions],
                                        [self.u], -1.0)
        dolfinx.fem.petsc.set_bc(self.right, solid.conditions, self.u, -1.0)
        self.solver.solve(self.right, self.step)
        self.count += 1
        return np.linalg.norm(self.step.array.reshape(-1, 3), axis=1).max()

    def advance(self, tolerance, most=30):
        """Searches the rest position from the displacement; returns whether it was found."""
        self.solve()
        self.u.axpy(-1, self.step)
        for _ in range(most):
            before, length = self.solid.value(), self.solve()
            if not np.isfinite(length):
                return False
            part = 1.0
            self.u.axpy(-1, self.step)
            while self.solid.value() > before + 1e-12 * abs(before) and part > 1e-3:
                part /= 2
                self.u.axpy(part, self.step)
            if length <= tolerance:
                return True
        return False


def rest_position(solid, kind, loads, tolerance):
    """Follows the fixed points; a load step that fails is halved."""
    newton, done, step = Newton(solid, kind), 0.0, 1 / loads
    while done < 1 - 1e-9:
        before = newton.u.copy()
        solid.load(min(1.0, done + step))
        if newton.advance(tolerance if done + step > 1 - 1e-9 else max(tolerance, 0.05)):
            done += step
        else:
            before.copy(newton.u)
            step /= 2
            if step < 1e-3 / loads:
                raise ArithmeticError(f"DOLFINx: no rest position beyond load {done:.4g}")
    return newton.count


@dataclasses.dataclass
class Solved:
    position: np.ndarray  # [N, 3] mm
    unknowns: int
    solves: int           # linear systems
    seconds: float        # CPU, set-up included


def solve(model, degree, kind="mumps", loads=4, tolerance=1e-4):
    """A model with prisms' moduli by finite elements."""
    begin = time.process_time()
    solid = Solid(model, model["prism/shear_modulus"], model["prism/modulus"], degree)
    solves = rest_position(solid, kind, loads, tolerance)
    return Solved(solid.positions(), 3 * (len(solid.ends) - len(solid.known)), solves,
                  time.process_time() - begin)


def skin_rows(model):
    """The skin's points, by their columns."""
    rows = np.flatnonzero(model["point/layer"] == 0)
    return rows[np.argsort(model["point/column"][rows])]


def difference(model, position, other, reference_position, moving):
    """Mean and largest distance over the points of the skin that the reference, positions of the
    model `other` of the same skin or of one that `model` has halved (halve.py), moves by more than
    `moving` mm, and their mean motion, mm."""
    others = skin_rows(other)
    skin = skin_rows(model)[:len(others)]
    motion = np.linalg.norm(reference_position - other["point/position"], axis=1)[others]
    moved = motion > moving
    apart = np.linalg.norm(position[skin] - reference_position[others], axis=1)[moved]
    return apart.mean(), apart.max(), motion[moved].mean()


def model_with_moduli(file, young, poisson):
    """A file's model; one without prisms' moduli gets these. Elastic supports are refused: the other
    programs do not have them."""
    model = model_of(file)
    if any(name.startswith("element/") for name in model):
        raise SystemExit(f"{file}: has elements of further energies; make it with tissue.release: 0")
    return model if "prism/shear_modulus" in model else with_material(model, young, poisson)


def reference(model, name, folder, degree=2, kind="mumps", loads=4):
    """Positions at a model's points and how they came to be; kept in a folder."""
    file = pathlib.Path(folder) / f"{name}_{'quadratic' if degree == 2 else 'linear'}.npy"
    if file.exists():
        return np.load(file), "found"
    solved = solve(model, degree, kind, loads)
    np.save(file, solved.position)
    return solved.position, (f"{solved.unknowns} unknowns, {solved.solves} linear systems, "
                             f"{solved.seconds:.0f} s")


def rows(options):
    for file in options.files:
        model = model_with_moduli(file, options.young, options.poisson)
        source = options.against or file
        other = model_with_moduli(source, options.young, options.poisson)
        fine, how = reference(other, pathlib.Path(source).stem, options.folder, options.degree,
                              options.solver, options.loads)
        mean, most, motion = difference(model, last(file)["point/position"], other, fine,
                                        options.moving)
        yield (f"| {pathlib.Path(file).stem} | {pathlib.Path(source).stem}: {how} | {mean:.4f} mm "
               f"| {most:.3f} mm | {motion:.3f} mm | {100 * mean / motion:.2f} % |")


def main():
    logging.disable()  # what the forms' compiler says
    parser = option_parser(__doc__, degree=2, loads=4, young=0.015, poisson=0.45, moving=0.1,
                           solver="mumps", against="", folder=pathlib.Path("."))
    parser.add_argument("files", nargs="+")
    options = parser.parse_args()
    print_table(f"| result | tetrahedra of degree {options.degree} | mean | most | mean motion "
                "| ratio |\n|---|---|--:|--:|--:|--:|", rows(options), options.output,
                "finite elements")


if __name__ == "__main__":
    main()
