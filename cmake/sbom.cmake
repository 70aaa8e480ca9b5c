# What the program is made of, as CycloneDX JSON (ECMA-424): itn.cdx.json of the build, installed beside the licences. Versions
# are those of the Debian packages that this build sees; without dpkg those that CMake has found, or none.
set(ITN_SBOM ${PROJECT_BINARY_DIR}/itn.cdx.json)

# Debian package, licence (SPDX), version that CMake knows
set(ITN_SBOM_LIBRARIES
  "ocl-icd-opencl-dev|BSD-2-Clause|${OpenCL_VERSION_STRING}"
  "opencl-clhpp-headers|Apache-2.0|"
  "libassimp-dev|BSD-3-Clause|${assimp_VERSION}"
  "libopenexr-dev|BSD-3-Clause|${OpenEXR_VERSION}"
  "libimath-dev|BSD-3-Clause|${Imath_VERSION}"
  "libeigen3-dev|MPL-2.0|${Eigen3_VERSION}"
  "libpugixml-dev|MIT|${pugixml_VERSION}"
  "zlib1g-dev|Zlib|${ZLIB_VERSION_STRING}"
  "nlohmann-json3-dev|MIT|${nlohmann_json_VERSION}"
  "libfmt-dev|MIT|${fmt_VERSION}"
  "libcli11-dev|BSD-3-Clause|${CLI11_VERSION}"
  "libstb-dev|MIT|"
  "libdnnl-dev|Apache-2.0|${dnnl_VERSION}"
  "libopenvdb-dev|MPL-2.0|"
  "libboost-dev|BSL-1.0|"
  "libtbb-dev|Apache-2.0|${TBB_VERSION}")

find_program(ITN_DPKG_QUERY dpkg-query)
set(ITN_SBOM_COMPONENTS "")
foreach(line IN LISTS ITN_SBOM_LIBRARIES)
  string(REPLACE "|" ";" fields "${line}|")
  list(GET fields 0 name)
  list(GET fields 1 licence)
  list(GET fields 2 version)
  set(purl "")
  if(ITN_DPKG_QUERY)
    execute_process(COMMAND ${ITN_DPKG_QUERY} -W "-f=\${Version}" ${name}
      OUTPUT_VARIABLE packaged ERROR_QUIET OUTPUT_STRIP_TRAILING_WHITESPACE)
    if(packaged)
      set(version "${packaged}")
      string(REPLACE "+" "%2B" encoded "${packaged}")
      string(REPLACE ":" "%3A" encoded "${encoded}")
      set(purl ",\n      \"purl\": \"pkg:deb/debian/${name}@${encoded}\"")
    endif()
  endif()
  list(APPEND ITN_SBOM_COMPONENTS "    {\"type\": \"library\", \"name\": \"${name}\", \"version\": \"${version}\",
      \"licenses\": [{\"license\": {\"id\": \"${licence}\"}}]${purl}}")
endforeach()
# What the binary holds of others without a package; THIRD-PARTY.md has the notices.
list(APPEND ITN_SBOM_COMPONENTS "    {\"type\": \"data\", \"name\": \"Hosek-Wilkie sky and sun model\",
      \"licenses\": [{\"license\": {\"id\": \"BSD-3-Clause\"}}]}")
list(JOIN ITN_SBOM_COMPONENTS ",\n" ITN_SBOM_COMPONENTS)
file(CONFIGURE OUTPUT ${ITN_SBOM} @ONLY CONTENT [[{
  "bomFormat": "CycloneDX",
  "specVersion": "1.5",
  "version": 1,
  "metadata": {
    "component": {"type": "application", "name": "itn", "version": "@PROJECT_VERSION@",
      "licenses": [{"license": {"id": "BSD-3-Clause"}}]}
  },
  "components": [
@ITN_SBOM_COMPONENTS@
  ]
}
]])
install(FILES ${ITN_SBOM} DESTINATION ${CMAKE_INSTALL_DOCDIR} COMPONENT program)
