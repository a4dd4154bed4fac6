#!/usr/bin/env bash
# run.sh [--all]: installs missing packages (apt), builds with warnings as errors, checks the formatting and
# runs the tests; with --all also the long ones. Ends with ctest's summary and what was left out.
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/.."
case "${1-}" in
  "") selection=(-LE long) ;;
  --all) selection=() && export REPOSE_ALL=1 ;;
  *) echo "run.sh: $1: the only argument is --all" >&2 && exit 1 ;;
esac
. drivers/setup.sh

install_packages "${build_packages[@]}" "${test_packages[@]}"
cmake --preset ci
cmake --build --preset ci

if command -v clang-format-14 >/dev/null; then
  find drivers examples include src tests \( -name '*.h' -o -name '*.cpp' \) -print0 |
    xargs -0 clang-format-14 --dry-run --Werror
else
  echo "formatting: not checked, the layout is that of clang-format 14 (Debian 12)"
fi

mpi_environment
status=0
ctest --preset ci "${selection[@]}" || status=$?
echo "skipped:"
grep -hE '^(\[  SKIPPED \] [^ ]+$|SKIPPED \[)' build-ci/Testing/Temporary/LastTest.log | sort | uniq || echo "  nothing"
if [ ${#selection[@]} -gt 0 ]; then
  echo "left out: $(ctest --preset ci -N -L long | sed -n 's/^ *Test *#[0-9]*: //p' | paste -sd' ')" \
    "and some tests of $(grep -lE 'pytest.mark.long|RUNS_ALL' tests/program/test_*.py | wc -l) files: tests/run.sh --all"
fi
exit $status
