#!/usr/bin/env bash
# Installs what is missing (apt), builds, solves the shipped head on two MPI ranks, recomputes every
# number of the result independently, writes a page about it with a head to turn, and says how long
# each took. With --ct the head is that of the CT in Debian's package invesalius-examples, from its
# voxels to the solved face.
# REPOSE_BUILD=FOLDER takes the programs of a build folder that is already there instead.
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/.."
. drivers/setup.sh
case "$*" in
  "") ct= ;;
  --ct) ct=1 ;;
  -h | -help | --help) sed -n '2,/^set /s/^# \{0,1\}//p' drivers/demo.sh && exit ;;
  *) echo "demo.sh: unknown argument: $*; it takes none, or --ct" >&2 && exit 1 ;;
esac

laps= landmarks=() since=$SECONDS
lap() { # what has been done since the last
  laps+="${laps:+, }$1 $((SECONDS - since)) s" since=$SECONDS
}

if [ -n "${REPOSE_BUILD:-}" ]; then
  build=$REPOSE_BUILD
else
  build=build
  install_packages "${build_packages[@]}" "${report_packages[@]}"
  lap packages
  cmake --preset release
  cmake --build --preset release
  lap build
fi

mpi_environment
mkdir -p "$build/demo"

# Lays the CT's voxels and a header for them (spacing and size as in its main.plist; InVesalius
# stores rows from back to front) into a folder, and makes meshes of skin and bone to look at. Where
# dpkg leaves out documentation, as in containers, the package is unpacked by hand.
unpack_ct() {
  local folder=$1 archive=/usr/share/doc/invesalius-examples/examples/Cranium.inv3
  mkdir -p "$folder"
  [ -f "$archive" ] || install_packages invesalius-examples
  if [ ! -f "$archive" ]; then
    (cd "$folder" && apt-get -q download invesalius-examples &&
      dpkg-deb -x invesalius-examples_*.deb .)
    archive=$folder$archive
  fi
  tar -xzf "$archive" -C "$folder" --strip-components=1 --wildcards '*/matrix.dat'
  cp meshes/ct.mhd meshes/ct_maxilla.yaml "$folder"
  "$build/bin/repose-isosurface" "$folder/ct.mhd" -level -300 -largest -output "$folder/skin.vtp"
  "$build/bin/repose-isosurface" "$folder/ct.mhd" -level 226 -largest -output "$folder/bone.vtp"
}

if [ -n "$ct" ]; then
  unpack_ct "$build/demo/ct"
  scene=$build/demo/ct/ct_maxilla.yaml
  lap surfaces
else
  scene=meshes/head_solid.yaml
  landmarks=(-landmarks meshes/head.mrk.json)
fi
result=$build/demo/$(basename "$scene" .yaml)
mpirun -n 2 "$build/bin/repose-solve" "$scene" -output "$result" </dev/null # it reads all that it is given
lap solve
"$build/bin/repose-check" "$result.h5" | tee "${result}_check.txt" | tail -n 1
lap check
/usr/bin/python3 drivers/report.py "$result" -scene "$scene" "${landmarks[@]}"
lap page

cat <<TEXT

The result is in $build/demo: every load step, displacement, force and volume ratio,
and what the check recomputed (${result}_check.txt).
Look at it in any browser:  $result.html
Look at it in ParaView:   paraview ${result}_skin.xdmf ${result}_bones.xdmf
A picture of it, before and after:   drivers/render.py $result
Time: $laps.
TEXT
