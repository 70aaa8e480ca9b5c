# Writes OUTPUT, a C++ file that holds the text of FILES (paths relative to FOLDER) as string literals.
# cmake -DOUTPUT=... -DFOLDER=... -DFILES=a|b [-DFUNCTION=embedded_kernel] -P embed_kernels.cmake
# FUNCTION, in namespace itn, finds a text by its path.
if(NOT FUNCTION)
  set(FUNCTION embedded_kernel)
endif()
string(REPLACE "|" ";" FILES "${FILES}")
set(body "")
foreach(file IN LISTS FILES)
  file(READ "${FOLDER}/${file}" text)
  # Compilers limit the length of one literal: cut the text into pieces of adjacent literals.
  string(LENGTH "${text}" length)
  set(literals "\"\"\n")
  set(at 0)
  while(at LESS length)
    string(SUBSTRING "${text}" ${at} 8000 piece)
    string(APPEND literals "R\"itn(${piece})itn\"\n")
    math(EXPR at "${at} + 8000")
  endwhile()
  string(APPEND body "      {\"${file}\", ${literals}},\n")
endforeach()
file(WRITE "${OUTPUT}" "#include <map>
#include <string>
namespace itn {
const char* ${FUNCTION}(const std::string& path) {
  static const std::map<std::string, const char*> files{
${body}  };
  const auto found = files.find(path);
  return found == files.end() ? nullptr : found->second;
}
}  // namespace itn
")
