// The verdict at the head of what a command prints.
#pragma once

#include "weft/v1/verdict.pb.h"

namespace weft {

// VerdictText on standard output; the grade in its colour on a terminal, unless NO_COLOR is set.
void PrintVerdict(const v1::Verdict& verdict);

}  // namespace weft
