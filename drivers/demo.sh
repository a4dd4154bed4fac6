#!/usr/bin/env bash
# Installs what is missing (apt), builds, solves the shipped head on two MPI ranks, recomputes every
# number of the result independently and says where to look.
# REPOSE_BUILD=FOLDER takes the programs of a build folder that is already there instead.
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/.."
. drivers/setup.sh

if [ -n "${REPOSE_BUILD:-}" ]; then
  build=$REPOSE_BUILD
else
  build=build
  install_packages "${build_packages[@]}"
  cmake --preset release
  cmake --build --preset release
fi

mpi_environment
result=$build/demo/head_jaw_opening
mkdir -p "$build/demo"
mpirun -n 2 "$build/bin/repose-solve" meshes/head_jaw_opening.yaml -output "$result"
"$build/bin/repose-check" "$result.h5" | tee "${result}_check.txt" | tail -n 1

cat <<TEXT

The result is in $build/demo: every load step, displacement, force and volume ratio,
and what the check recomputed (${result}_check.txt).
Look at it in ParaView:   paraview ${result}_skin.xdmf ${result}_bones.xdmf
A picture of it, before and after:   drivers/render.py $result
TEXT
