// One kind of job a folder.
#pragma once
#include <string>

namespace itn {

// own: the file that says what is in the folder, of the job that asks: manifest.json, run.json, state.json,
// renderings.json or, of an evaluation, result.json. Throws UsageError where another's is there: what two jobs write
// would be mixed.
void refuse_folder_of_other(const std::string& folder, const std::string& own);

}  // namespace itn
