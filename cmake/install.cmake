# cmake --install: a tree that can be moved. The binary holds its kernels and data; the text files are for reading, and for
# ITN_KERNEL_DIR.
include(GNUInstallDirs)
include(CMakePackageConfigHelpers)

set(ITN_CONFIG_DIR ${CMAKE_INSTALL_LIBDIR}/cmake/itn)
set(ITN_SCENES_DIR ${CMAKE_INSTALL_DATADIR}/itn/scenes)
set(ITN_KERNELS_DIR ${CMAKE_INSTALL_DATADIR}/itn/kernels)

install(TARGETS itn RUNTIME DESTINATION ${CMAKE_INSTALL_BINDIR})
install(TARGETS itn_bench itn_evaluation itn_training itn_network itn_runtime itn_file itn_kernels
  EXPORT itn_targets ARCHIVE DESTINATION ${CMAKE_INSTALL_LIBDIR})
install(DIRECTORY runtime network kernels DESTINATION ${CMAKE_INSTALL_INCLUDEDIR}/itn FILES_MATCHING PATTERN "*.h")
install(DIRECTORY kernels/ DESTINATION ${ITN_KERNELS_DIR} FILES_MATCHING PATTERN "*.h" PATTERN "*.cl")
install(DIRECTORY scenes/ DESTINATION ${ITN_SCENES_DIR} FILES_MATCHING PATTERN "*")
# README.md and what it links to.
install(FILES README.md LICENSE THIRD-PARTY.md CHANGELOG.md DESTINATION ${CMAKE_INSTALL_DOCDIR})
install(DIRECTORY docs DESTINATION ${CMAKE_INSTALL_DOCDIR}
  PATTERN style EXCLUDE PATTERN .nav.yml EXCLUDE)
install(FILES scenes/gallery/preview.png DESTINATION ${CMAKE_INSTALL_DOCDIR}/scenes/gallery)
foreach(folder IN ITEMS kernels kernels/model runtime runtime/dataset runtime/derivative runtime/evaluation runtime/shapes
                        network network/weights tools scenes python tests/inversion tests/stage tests/transport)
  install(FILES ${folder}/README.md DESTINATION ${CMAKE_INSTALL_DOCDIR}/${folder})
endforeach()

install(EXPORT itn_targets NAMESPACE itn:: FILE itnTargets.cmake DESTINATION ${ITN_CONFIG_DIR})
configure_package_config_file(cmake/itnConfig.cmake.in ${CMAKE_BINARY_DIR}/itnConfig.cmake
  INSTALL_DESTINATION ${ITN_CONFIG_DIR} PATH_VARS ITN_SCENES_DIR ITN_KERNELS_DIR)
write_basic_package_version_file(${CMAKE_BINARY_DIR}/itnConfigVersion.cmake COMPATIBILITY SameMinorVersion)
install(FILES ${CMAKE_BINARY_DIR}/itnConfig.cmake ${CMAKE_BINARY_DIR}/itnConfigVersion.cmake
  DESTINATION ${ITN_CONFIG_DIR})
