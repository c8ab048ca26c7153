// The coding report of a board, for people and for programs.
#pragma once

#include <string>
#include <vector>

#include "pattern/board/board.h"
#include "pattern/board/coding_report.h"

namespace weft {

// A board's report beside that of a random board of its size; `random` is null where there is none.
std::string CodingReportText(const Board& board, const CodingReport& report, const CodingReport* random);

// One JSON object. `clashes` as Board::FindClashes lists them.
std::string CodingReportJson(const Board& board, const CodingReport& report, const CodingReport* random,
                             const std::vector<CodeClash>& clashes);

}  // namespace weft
