#!/usr/bin/env bash
# The paper's surgical pictures on the shipped head: Fig. 6 a cut jaw moved, Fig. 7 two options, Fig. 8 an
# instrument pressed in, Fig. 9 a cut that opens by the skin's tension.
#
#     drivers/figures.sh [BIN [FOLDER]]      BIN: build/bin, FOLDER: figures
#
# Needs matplotlib, h5py, PyYAML and what drivers/render.py asks for.
set -euo pipefail
case "${1:-}" in
  -h | -help | --help) sed -n '2,/^set /s/^# \{0,1\}//p' "${BASH_SOURCE[0]}" && exit ;;
  -*) echo "figures.sh: unknown argument: $1; -help prints the usage" >&2 && exit 1 ;;
esac
project="$(cd "$(dirname "${BASH_SOURCE[0]}")/.." && pwd)"
. "$project/drivers/setup.sh"
mpi_environment
bin="$(realpath "${1:-$project/build/bin}")"
mkdir -p "${2:-figures}"
cd "${2:-figures}"

solve() { "$bin/repose-solve" "$1" -output "$2" >"$2.log"; }
render() {
  "$project/drivers/render.py" "$1" -output "$2.png" -views "$3" "${@:4}"
}

solve "$project/meshes/head_split.yaml" split && render split fig6_split three-quarter
solve "$project/meshes/head_jaw_advance.yaml" advance && render advance fig7_jaw_forward three-quarter
solve "$project/meshes/head_genioplasty.yaml" chin && render chin fig7_chin_forward three-quarter
solve "$project/meshes/head_instrument.yaml" instrument
render instrument fig8_instrument three-quarter-left -scene "$project/meshes/head_instrument.yaml"
for turgor in 02 05 10 20; do
  sed -E "s|turgor: [0-9.]+|turgor: 0.$turgor|; s|: head_|: $project/meshes/head_|" \
    "$project/meshes/head_springs_incision.yaml" >"turgor_$turgor.yaml"
  solve "turgor_$turgor.yaml" "turgor_$turgor"
done
python3 "$project/drivers/plot_incision.py" fig9_incision.png turgor_{02,05,10,20}.h5
