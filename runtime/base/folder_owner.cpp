#include "runtime/base/folder_owner.h"

#include <array>
#include <filesystem>

#include "itn/error.h"
#include "itn/file.h"

namespace itn {

void refuse_folder_of_other(const std::string& folder, const std::string& own) {
  struct Mark {
    const char *file, *what, *schema;  // schema: with which the file begins; empty: any
  };
  constexpr std::array marks{Mark{"manifest.json", "a data set", ""}, Mark{"run.json", "a training", ""},
                             Mark{"state.json", "an inversion", ""},
                             Mark{"renderings.json", "renderings of an inversion", ""},
                             Mark{"result.json", "an evaluation", "\"itn.eval/"}};
  for (const Mark& mark : marks) {
    const std::string file = (std::filesystem::path(folder) / mark.file).string();
    std::error_code error;
    if (mark.file == own || !std::filesystem::is_regular_file(file, error)) continue;
    constexpr std::size_t beginning = 100;
    if (*mark.schema && read_file(file).substr(0, beginning).find(mark.schema) == std::string::npos) continue;
    throw UsageError(folder + ": holds " + mark.what + "; give another folder with -o");
  }
}

}  // namespace itn
