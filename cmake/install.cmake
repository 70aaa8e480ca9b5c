# cmake --install: a tree that can be moved. The binary holds its kernels and data; the text files are for reading, and for
# ITN_KERNEL_DIR.
include(CMakePackageConfigHelpers)

set(ITN_CONFIG_DIR ${CMAKE_INSTALL_LIBDIR}/cmake/itn)
set(ITN_SCENES_DIR ${CMAKE_INSTALL_DATADIR}/itn/scenes)
set(ITN_KERNELS_DIR ${CMAKE_INSTALL_DATADIR}/itn/kernels)

install(TARGETS itn RUNTIME DESTINATION ${CMAKE_INSTALL_BINDIR} COMPONENT program)
# Where Debian's shells look.
install(DIRECTORY ${PROJECT_BINARY_DIR}/manual/man1 DESTINATION ${CMAKE_INSTALL_MANDIR} COMPONENT program)
install(FILES ${PROJECT_BINARY_DIR}/manual/itn.bash DESTINATION ${CMAKE_INSTALL_DATADIR}/bash-completion/completions
  RENAME itn COMPONENT program)
install(FILES ${PROJECT_BINARY_DIR}/manual/_itn DESTINATION ${CMAKE_INSTALL_DATADIR}/zsh/vendor-completions COMPONENT program)
install(TARGETS itn_network itn_runtime EXPORT itn_targets
  ARCHIVE DESTINATION ${CMAKE_INSTALL_LIBDIR} COMPONENT development
  LIBRARY DESTINATION ${CMAKE_INSTALL_LIBDIR} COMPONENT program NAMELINK_COMPONENT development)
install(DIRECTORY include/itn DESTINATION ${CMAKE_INSTALL_INCLUDEDIR} COMPONENT development FILES_MATCHING PATTERN "*.h")
install(DIRECTORY kernels/ DESTINATION ${ITN_KERNELS_DIR} COMPONENT program FILES_MATCHING PATTERN "*.h" PATTERN "*.cl")
install(DIRECTORY scenes/ DESTINATION ${ITN_SCENES_DIR} COMPONENT program FILES_MATCHING PATTERN "*")
# README.md and what it links to.
install(FILES README.md CONTRIBUTING.md LICENSE THIRD-PARTY.md CHANGELOG.md DESTINATION ${CMAKE_INSTALL_DOCDIR} COMPONENT program)
install(FILES cmake/copyright DESTINATION ${CMAKE_INSTALL_DOCDIR} COMPONENT program)
install(DIRECTORY docs DESTINATION ${CMAKE_INSTALL_DOCDIR} COMPONENT program
  PATTERN style EXCLUDE PATTERN .nav.yml EXCLUDE)
install(FILES scenes/gallery/preview.png DESTINATION ${CMAKE_INSTALL_DOCDIR}/scenes/gallery COMPONENT program)
foreach(folder IN ITEMS kernels kernels/model runtime runtime/render/derivative runtime/scene/shapes network/dataset network/evaluation
                        network network/weights tools tools/lab scenes python tests/inversion tests/stage tests/transport)
  install(FILES ${folder}/README.md DESTINATION ${CMAKE_INSTALL_DOCDIR}/${folder} COMPONENT program)
endforeach()

install(EXPORT itn_targets NAMESPACE itn:: FILE itnTargets.cmake DESTINATION ${ITN_CONFIG_DIR}
  COMPONENT development)
set(ITN_IS_SHARED OFF)
if(BUILD_SHARED_LIBS)
  set(ITN_IS_SHARED ON)
endif()
configure_package_config_file(cmake/itnConfig.cmake.in ${CMAKE_BINARY_DIR}/itnConfig.cmake
  INSTALL_DESTINATION ${ITN_CONFIG_DIR} PATH_VARS ITN_SCENES_DIR ITN_KERNELS_DIR)
write_basic_package_version_file(${CMAKE_BINARY_DIR}/itnConfigVersion.cmake COMPATIBILITY SameMinorVersion)
install(FILES ${CMAKE_BINARY_DIR}/itnConfig.cmake ${CMAKE_BINARY_DIR}/itnConfigVersion.cmake
  DESTINATION ${ITN_CONFIG_DIR} COMPONENT development)
