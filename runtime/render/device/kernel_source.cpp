#include "itn/kernel_source.h"

#include <cstdlib>
#include <fstream>
#include <iomanip>
#include <regex>
#include <set>
#include <sstream>
#include <stdexcept>
#include <vector>

namespace itn {

// Defined in the generated embedded_kernels.cpp: null when there is no such file.
const char* embedded_kernel(const std::string& path);

namespace {

std::string read(const std::string& path, const KernelFiles& generated) {
  if (const auto found = generated.find(path); found != generated.end()) return found->second;
  if (const char* folder = std::getenv("ITN_KERNEL_DIR")) {
    std::ifstream in(std::string(folder) + "/" + path);
    if (in) return {std::istreambuf_iterator<char>(in), {}};
  }
  if (const char* text = embedded_kernel(path)) return text;
  throw std::logic_error("no kernel file kernels/" + path);
}

void expand(const std::string& path, const KernelFiles& generated, std::set<std::string>& seen, std::string& out) {
  if (!seen.insert(path).second) return;
  std::istringstream in(read(path, generated));
  const auto mark = [&](int line) { out += "#line " + std::to_string(line) + " \"kernels/" + path + "\"\n"; };
  mark(1);
  int number = 0;
  for (std::string line; std::getline(in, line);) {
    ++number;
    const auto open = line.find("#include \"");
    if (open == std::string::npos) {
      out += line + "\n";
      continue;
    }
    const auto first = open + 10, last = line.find('"', first);
    expand(line.substr(first, last - first), generated, seen, out);
    mark(number + 1);
  }
}

}  // namespace

std::string kernel_source(const std::string& path, const KernelFiles& generated) {
  std::set<std::string> seen;
  std::string out;
  expand(path, generated, seen, out);
  return out;
}

std::string with_kernel_files(const std::string& log, const std::string& source) {
  std::vector<std::string> places;  // of each line
  std::istringstream lines(source);
  std::string file = "<kernel>";
  int number = 0;
  for (std::string line; std::getline(lines, line);) {
    places.push_back(file + ":" + std::to_string(++number));
    if (!line.starts_with("#line ")) continue;
    std::istringstream directive(line.substr(6));
    directive >> number >> std::quoted(file);
    --number;
  }
  static const std::regex counted("<kernel>:([0-9]{1,9})");
  std::string out;
  auto rest = log.begin();
  for (std::sregex_iterator match(log.begin(), log.end(), counted), end; match != end; ++match) {
    const auto line = static_cast<std::size_t>(std::stoi((*match)[1]));
    out.append(rest, (*match)[0].first);
    out += line >= 1 && line <= places.size() ? places[line - 1] : match->str();
    rest = (*match)[0].second;
  }
  return out.append(rest, log.end());
}

}  // namespace itn
