# cmake --install, find_package(Repose) for programs of one's own, and Debian packages by cpack.
include(CMakePackageConfigHelpers)

set(rooms base scene volume surface imaging meshtools anatomy model mechanics discrete linear solve results adapt app core tools)
list(TRANSFORM tools PREPEND tools_ OUTPUT_VARIABLE tool_rooms)
list(APPEND rooms ${tool_rooms})
list(TRANSFORM rooms PREPEND repose_ OUTPUT_VARIABLE libraries)
foreach(room ${rooms})
  set_target_properties(repose_${room} PROPERTIES EXPORT_NAME ${room})
endforeach()
install(TARGETS ${programs} RUNTIME DESTINATION bin)
install(TARGETS repose_options ${libraries} EXPORT Repose ARCHIVE DESTINATION lib)
install(DIRECTORY include/repose DESTINATION include)

# Scripts find each other, and the Slicer panel the programs, by where they lie.
install(DIRECTORY meshes examples DESTINATION share/repose)
install(DIRECTORY drivers/ DESTINATION share/repose USE_SOURCE_PERMISSIONS
  FILES_MATCHING PATTERN *.py PATTERN *.js PATTERN *.css PATTERN *.html PATTERN norms.json PATTERN setup.sh PATTERN repose.slurm PATTERN slicer/Repose PATTERN Repose.xml)

# Manual pages and bash completion, printed by the programs' own tables of options.
foreach(program ${programs})
  set(page ${PROJECT_BINARY_DIR}/manual/man1/${program}.1)
  add_custom_command(OUTPUT ${page} DEPENDS ${program} ${PROJECT_SOURCE_DIR}/cmake/manual.cmake
    COMMAND ${CMAKE_COMMAND} -DPROGRAM=$<TARGET_FILE:${program}> -DVERSION=${PROJECT_VERSION}
      -DFOLDER=${PROJECT_BINARY_DIR}/manual -P ${PROJECT_SOURCE_DIR}/cmake/manual.cmake)
  list(APPEND pages ${page})
endforeach()
add_custom_target(manual ALL DEPENDS ${pages})
install(DIRECTORY ${PROJECT_BINARY_DIR}/manual/man1 DESTINATION share/man)
install(DIRECTORY ${PROJECT_BINARY_DIR}/manual/completions DESTINATION share/bash-completion)

set(package lib/cmake/Repose)
install(EXPORT Repose NAMESPACE Repose:: DESTINATION ${package} FILE ReposeTargets.cmake)
configure_file(cmake/ReposeConfig.cmake ReposeConfig.cmake COPYONLY)
write_basic_package_version_file(ReposeConfigVersion.cmake COMPATIBILITY SameMinorVersion)
install(FILES ${PROJECT_BINARY_DIR}/ReposeConfig.cmake
  ${PROJECT_BINARY_DIR}/ReposeConfigVersion.cmake DESTINATION ${package})

set(CPACK_GENERATOR DEB)
set(CPACK_PACKAGE_CONTACT "the authors of Repose")
set(CPACK_PACKAGE_DESCRIPTION_SUMMARY "Rest position of facial soft tissue after its bones moved")
set(CPACK_DEBIAN_FILE_NAME DEB-DEFAULT)
set(CPACK_DEBIAN_PACKAGE_SECTION science)
set(CPACK_DEBIAN_PACKAGE_SHLIBDEPS ON)
set(CPACK_DEBIAN_PACKAGE_DEPENDS openmpi-bin)
set(CPACK_DEBIAN_PACKAGE_RECOMMENDS "python3-numpy, python3-h5py, python3-yaml")
include(CPack)
