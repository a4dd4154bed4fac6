#!/usr/bin/env bash
# run.sh [--more | --all]: installs missing packages (apt), builds with warnings as errors, checks the formatting
# and runs the quick tests; with --more all but the long ones, with --all these, too. Ends with ctest's summary
# and what was left out.
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/.."
case "${1-}" in
  "") left_out="more|long" target=quick && export REPOSE_FEW=1 ;;
  --more) left_out="long" target=all ;;
  --all) left_out="" target=all && export REPOSE_ALL=1 ;;
  *) echo "run.sh: $1: the only arguments are --more and --all" >&2 && exit 1 ;;
esac
. drivers/setup.sh

install_packages "${build_packages[@]}" "${test_packages[@]}"
cmake --preset ci
cmake --build --preset ci --target "$target"

if command -v clang-format-14 >/dev/null; then
  find drivers examples include src tests \( -name '*.h' -o -name '*.cpp' \) -print0 |
    xargs -0 clang-format-14 --dry-run --Werror
else
  echo "formatting: not checked, the layout is that of clang-format 14 (Debian 12)"
fi

mpi_environment
status=0
ctest --preset ci ${left_out:+-LE "$left_out"} || status=$?
echo "skipped:"
grep -hE '^(\[  SKIPPED \] [^ ]+$|SKIPPED \[)' build-ci/Testing/Temporary/LastTest.log | sort | uniq || echo "  nothing"
if [ -n "$left_out" ]; then
  deselected=$(awk 'match($0, /[0-9]+ deselected/) {n += substr($0, RSTART)} END {print n + 0}' \
    build-ci/Testing/Temporary/LastTest.log)
  echo "left out: $(ctest --preset ci -N -L "$left_out" | sed -n 's/^ *Test *#[0-9]*: //p' | paste -sd' ')" \
    "and $deselected tests of the others: tests/run.sh --all"
fi
exit $status
