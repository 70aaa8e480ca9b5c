function(run)
  execute_process(COMMAND ${ARGV} RESULT_VARIABLE result OUTPUT_VARIABLE output ERROR_VARIABLE output)
  if(NOT result EQUAL 0)
    message(FATAL_ERROR "${ARGV}: ${result}\n${output}")
  endif()
  set(output "${output}" PARENT_SCOPE)
endfunction()

file(REMOVE_RECURSE ${WORK})
run(${CMAKE_COMMAND} --install ${BUILD} --prefix ${WORK}/first)
file(RENAME ${WORK}/first ${WORK}/moved)

run(${WORK}/moved/bin/itn --version)
if(NOT output MATCHES "^itn ${VERSION}\ndevices: .*\nbuilt with .*\n$")
  message(FATAL_ERROR "itn --version: got ${output}, need itn ${VERSION}")
endif()

foreach(file IN ITEMS man/man1/itn.1 man/man1/itn-render.1 bash-completion/completions/itn zsh/vendor-completions/_itn)
  if(NOT EXISTS ${WORK}/moved/share/${file})
    message(FATAL_ERROR "share/${file} was not installed")
  endif()
endforeach()
# The list of what the program is made of is JSON, and every library of THIRD-PARTY.md that is not optional is in it.
file(GLOB sbom ${WORK}/moved/share/doc/*/itn.cdx.json)
file(READ "${sbom}" text)
string(JSON count LENGTH "${text}" components)
if(count LESS 17)
  message(FATAL_ERROR "${sbom} has ${count} components; there were 17")
endif()
string(JSON version GET "${text}" metadata component version)
if(NOT version STREQUAL VERSION)
  message(FATAL_ERROR "${sbom} is of itn ${version}, need ${VERSION}")
endif()

# Lines, since a semicolon would end the argument.
run(bash -c "source share/bash-completion/completions/itn
COMP_WORDS=(itn render --op) COMP_CWORD=2
_itn
echo \${COMPREPLY[*]}
COMP_WORDS=(itn render --operator '') COMP_CWORD=3
_itn
echo \${COMPREPLY[*]}"
    WORKING_DIRECTORY ${WORK}/moved)
if(NOT output MATCHES "--operator --open\nfull single\n")
  message(FATAL_ERROR "completion of `itn render --op` and of what follows --operator: got ${output}")
endif()

# What README.md links to came along.
file(GLOB readme ${WORK}/moved/share/doc/*/README.md)
get_filename_component(folder "${readme}" DIRECTORY)
file(READ "${readme}" text)
string(REGEX MATCHALL "[(][A-Za-z0-9_-]+[/.][A-Za-z0-9/_.-]*[)]" links "${text}")
list(LENGTH links count)
if(count LESS 20)
  message(FATAL_ERROR "README.md has ${count} links to files; there were more than 20")
endif()
foreach(link IN LISTS links)
  string(REGEX REPLACE "[()]" "" link "${link}")
  if(NOT EXISTS "${folder}/${link}")
    message(FATAL_ERROR "README.md links to ${link}, which is not installed")
  endif()
endforeach()

file(GLOB_RECURSE configuration ${WORK}/moved/*.cmake)
if(NOT configuration)
  message(FATAL_ERROR "no CMake package config was installed")
endif()
foreach(file IN LISTS configuration)
  file(READ ${file} text)
  foreach(folder IN ITEMS ${SOURCE}/ ${WORK}/first)
    string(FIND "${text}" "${folder}" at)
    if(NOT at EQUAL -1)
      message(FATAL_ERROR "${file} names ${folder}: the tree cannot be moved")
    endif()
  endforeach()
endforeach()

run(${CMAKE_COMMAND} -S ${CONSUMER} -B ${WORK}/consumer -DCMAKE_PREFIX_PATH=${WORK}/moved
    -DCMAKE_CXX_COMPILER=${COMPILER} "-DCMAKE_CXX_FLAGS=${FLAGS}" -DEXPECTED_VERSION=${VERSION})
run(${CMAKE_COMMAND} --build ${WORK}/consumer)
run(${WORK}/consumer/renders ${WORK}/moved/share/itn/scenes/dataset/scene.xml ${WORK}/found)
run(${WORK}/consumer/learns)
