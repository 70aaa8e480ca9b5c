# cpack -G DEB: itn, which brings PoCL, and libitn-dev with headers, libraries and the CMake package.
set(CPACK_GENERATOR DEB)
set(CPACK_PACKAGE_NAME itn)
# As LICENSE names them. Debian asks for an address: this one is of nobody (RFC 2606).
set(CPACK_PACKAGE_VENDOR "the itn authors")
set(CPACK_PACKAGE_CONTACT "the itn authors <itn@itn.invalid>")
set(CPACK_PACKAGE_DESCRIPTION_SUMMARY "Differentiable volumetric path tracer on OpenCL")
set(CPACK_PACKAGE_DESCRIPTION
  "Renders translucent things from Mitsuba 3 scenes, with derivatives and standard errors, and tells from photos what they are made of.")
set(CPACK_PACKAGING_INSTALL_PREFIX /usr)
set(CPACK_STRIP_FILES ON)
set(CPACK_DEB_COMPONENT_INSTALL ON)
set(CPACK_COMPONENTS_ALL program development)
set(CPACK_COMPONENTS_GROUPING IGNORE)
set(CPACK_DEBIAN_FILE_NAME DEB-DEFAULT)
set(CPACK_DEBIAN_PACKAGE_SECTION science)
set(CPACK_DEBIAN_PACKAGE_SHLIBDEPS ON)

set(CPACK_DEBIAN_PROGRAM_PACKAGE_NAME itn)
# The first where nothing is there yet: OpenCL on any CPU.
set(CPACK_DEBIAN_PROGRAM_PACKAGE_DEPENDS "pocl-opencl-icd | opencl-icd")
set(CPACK_DEBIAN_PROGRAM_PACKAGE_SUGGESTS "openmpi-bin, libitn-dev")

set(CPACK_DEBIAN_DEVELOPMENT_PACKAGE_NAME libitn-dev)
set(CPACK_DEBIAN_DEVELOPMENT_PACKAGE_SECTION libdevel)
set(CPACK_DEBIAN_DEVELOPMENT_PACKAGE_DEPENDS
  "itn (= ${PROJECT_VERSION}), ocl-icd-opencl-dev, opencl-clhpp-headers, libassimp-dev, libopenexr-dev, libeigen3-dev, libpugixml-dev, zlib1g-dev, libtiff-dev, libjpeg-dev, nlohmann-json3-dev, libfmt-dev, libdnnl-dev, libopenvdb-dev, libboost-dev, libtbb-dev")
include(CPack)
