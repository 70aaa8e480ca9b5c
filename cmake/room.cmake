# itn_room(name SOURCES file.cpp ... [LINKS library ...]): a folder of runtime/ or network/ as an object library itn_<name>, of which
# runtime/CMakeLists.txt and network/CMakeLists.txt make the libraries itn_runtime and itn_network. tools/rooms.py says which room may
# include which.
function(itn_room name)
  cmake_parse_arguments(PARSE_ARGV 1 ROOM "" "" "SOURCES;LINKS")
  add_library(itn_${name} OBJECT ${ROOM_SOURCES})
  target_include_directories(itn_${name} PRIVATE ${PROJECT_SOURCE_DIR}/include ${PROJECT_SOURCE_DIR} ${PROJECT_SOURCE_DIR}/kernels)
  target_link_libraries(itn_${name} PRIVATE itn_warnings Eigen3::Eigen OpenCL::OpenCL Threads::Threads nlohmann_json::nlohmann_json fmt::fmt
                                            ${ROOM_LINKS})
  set_target_properties(itn_${name} PROPERTIES UNITY_BUILD ${ITN_UNITY} UNITY_BUILD_MODE GROUP)
endfunction()

# itn_unity(group file.cpp ...): files of this room that share large headers compile together. Names in their anonymous namespaces
# have to differ.
function(itn_unity group)
  set_source_files_properties(${ARGN} PROPERTIES UNITY_GROUP ${group})
endfunction()
