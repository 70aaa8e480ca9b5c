// The fields of a path (kernels/shared/path_state.h) in a program with given definitions.
#pragma once
#include <cstddef>
#include <map>
#include <string>

namespace itn {

struct PathFields {
  std::map<std::string, std::size_t> first;  // by the names of path_state.h
  std::size_t size = 0;
};

// definitions: those of the program, by which path_state.h counts.
PathFields path_fields(const std::map<std::string, std::string>& definitions);

}  // namespace itn
