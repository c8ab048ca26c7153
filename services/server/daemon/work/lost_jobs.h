// Results below the state folder that no job of the catalogue tells of.
#pragma once

#include <string>
#include <vector>

#include "services/server/catalogue/catalogue.h"

namespace weft {

// Of folders whose jobs were forgotten, and that are being removed.
inline constexpr char kForgottenPrefix[] = ".forgotten-";

// Looks through <results_folder>/<job id>. A job that has ended is taken up again from its job.json and the
// reports of its frames; a folder without a readable job.json is named, forgotten ones aside. Returns what a
// user must know; nothing when the catalogue knows all.
std::vector<std::string> TakeUpLostJobs(const std::string& results_folder, Catalogue& catalogue);

}  // namespace weft
