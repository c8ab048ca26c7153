// The meshes of a comparison in three dimensions, coloured by how far both results are apart.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "services/results/evaluation/compare_jobs.h"
#include "weft/v1/page.pb.h"

namespace weft {

// A's meshes of the frames that both results have, by the distance of each vertex from B's in mm, by A's
// state and by A's sigma. Empty where A has no job.json or no mesh, or where the templates have other
// vertices. On paper the mean
// distance on the template. What cannot be read is left out with a line in `notes`.
std::optional<v1::PageSequence> ComparisonSequence(const JobComparison& comparison,
                                                   std::vector<std::string>& notes);

}  // namespace weft
