# find_package(Repose): Repose::core solves a face, Repose::tools is what the other programs call. Each room
# of docs/develop/design.md is a target, too (Repose::surface), and brings those it builds on. On Debian the
# packages that build Repose are needed.
include(CMakeFindDependencyMacro)
enable_language(C) # of MPI
find_dependency(MPI COMPONENTS C)
find_dependency(Eigen3 NO_MODULE)
find_dependency(fmt)
find_dependency(yaml-cpp)
find_dependency(CGAL)
find_dependency(ZLIB)
find_dependency(PkgConfig)
pkg_check_modules(PETSC REQUIRED IMPORTED_TARGET GLOBAL PETSc>=3.18)
pkg_check_modules(SLEPC REQUIRED IMPORTED_TARGET GLOBAL slepc>=3.18)
pkg_check_modules(HDF5 REQUIRED IMPORTED_TARGET GLOBAL hdf5-openmpi)
# In a function, which keeps ITK's variables, the serial HDF5's among them.
function(repose_find_itk)
  find_package(ITK 5.2 REQUIRED COMPONENTS
    ITKCommon ITKIOGDCM ITKIOImageBase ITKIOMeta ITKIONIFTI ITKIONRRD)
endfunction()
repose_find_itk()
include(${CMAKE_CURRENT_LIST_DIR}/ReposeTargets.cmake)
