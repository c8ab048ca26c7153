// The meshes of a comparison in three dimensions, coloured by how far both results are apart.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "services/results/evaluation/compare_jobs.h"
#include "services/results/report/sequence_view.h"

namespace weft {

// A's meshes of the frames that both results have, by the distance of each vertex from B's in mm, by A's
// state and by A's sigma. Empty where A has no job.json or no mesh, or where the templates have other
// vertices. What cannot be read is left out with a line in `notes`.
std::optional<SequenceView> ComparisonSequence(const JobComparison& comparison,
                                               std::vector<std::string>& notes);

// Its section of the page; on paper the mean distance on the template.
std::string ComparisonSequenceSection(const JobComparison& comparison, const SequenceView& sequence,
                                      const std::vector<std::string>& notes);

}  // namespace weft
