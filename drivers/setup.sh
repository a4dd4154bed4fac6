# Sourced by drivers/demo.sh and tests/run.sh: what they need of a Debian 12 or 13 machine.

build_packages=(
  g++ cmake ninja-build ccache pkg-config
  openmpi-bin libopenmpi-dev libpetsc-real-dev libslepc-real-dev libhdf5-openmpi-dev
  libopenblas0-serial # a fast BLAS, serial because MPI ranks already use the cores
  libeigen3-dev libcgal-dev libyaml-cpp-dev nlohmann-json3-dev libfmt-dev
  libinsighttoolkit5-dev zlib1g-dev # volumes: DICOM, NIfTI, NRRD, MetaImage
)
report_packages=(python3 python3-numpy python3-h5py python3-yaml) # drivers/report.py
test_packages=(
  libgtest-dev libbenchmark-dev clang-format
  python3 python3-pytest python3-numpy python3-scipy python3-h5py python3-meshio python3-yaml
)
# Nobody needs these: what tests/benchmark compares with, and what its pictures are drawn by.
# To have them: . drivers/setup.sh; install_packages "${benchmark_packages[@]}"
benchmark_packages=(liblbfgs-dev python3-matplotlib python3-dolfinx calculix-ccx)

# Prints those of the given Debian packages that are not installed.
missing_packages() {
  local package
  for package in "$@"; do
    [ "$(dpkg-query -W -f '${db:Status-Status}' "$package" 2>/dev/null)" = installed ] ||
      echo "$package"
  done
}

# Runs apt-get as root, directly or by sudo; a failure, often a mirror's, is retried once.
run_apt() {
  local command=(env DEBIAN_FRONTEND=noninteractive apt-get -q "$@")
  [ "$(id -u)" = 0 ] || command=(sudo "${command[@]}")
  "${command[@]}" || { sleep 5 && "${command[@]}"; }
}

# Installs those of the given packages that are missing; needs no network when none is.
install_packages() {
  local missing
  if ! command -v dpkg-query >/dev/null; then
    echo "set-up: this is not Debian (12 or 13); install the like of: $*" >&2
    return 1
  fi
  mapfile -t missing < <(missing_packages "$@")
  [ ${#missing[@]} -gt 0 ] || return 0
  if [ "$(id -u)" != 0 ] && ! command -v sudo >/dev/null; then
    echo "set-up: neither root nor sudo; have installed: apt-get install ${missing[*]}" >&2
    return 1
  fi
  echo "set-up: installing ${missing[*]}"
  if ! { run_apt update && run_apt install -y --no-install-recommends "${missing[@]}"; }; then
    echo "set-up: apt-get could not install: ${missing[*]}" >&2
    return 1
  fi
}

# Exports what mpirun needs here, for Open MPI 4 (OMPI_) and 5 (PRTE_).
mpi_environment() {
  export OMP_NUM_THREADS=1 OPENBLAS_NUM_THREADS=1
  # OpenBLAS takes a processor that is newer than itself for a very old one.
  case $(grep -m1 '^flags' /proc/cpuinfo 2>/dev/null) in
    *avx512vl*) export OPENBLAS_CORETYPE=${OPENBLAS_CORETYPE:-SkylakeX} ;;
    *avx2*) export OPENBLAS_CORETYPE=${OPENBLAS_CORETYPE:-Haswell} ;;
  esac
  if [ "$(id -u)" = 0 ]; then
    export OMPI_ALLOW_RUN_AS_ROOT=1 OMPI_ALLOW_RUN_AS_ROOT_CONFIRM=1
    export PRTE_ALLOW_RUN_AS_ROOT=1 PRTE_ALLOW_RUN_AS_ROOT_CONFIRM=1
  fi
  # More ranks than cores are allowed.
  export OMPI_MCA_rmaps_base_oversubscribe=1 PRTE_MCA_rmaps_default_mapping_policy=:oversubscribe
  # Runs at the same time must not be pinned to the same cores.
  export OMPI_MCA_hwloc_base_binding_policy=none PRTE_MCA_hwloc_default_binding_policy=none
  # Ranks that wait let others go on: on a busy machine a message takes no time slice then.
  export OMPI_MCA_mpi_yield_when_idle=1
  # UCX, below Open MPI, prints complaints on standard output, where repose-live answers.
  export UCX_LOG_LEVEL=${UCX_LOG_LEVEL:-fatal}
}
