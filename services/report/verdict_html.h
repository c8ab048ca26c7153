// The verdict at the head of a page.
#pragma once

#include <string>

namespace weft {

namespace v1 {
class Verdict;
}

// A section with the badge, the reason, the remedy and a table of values beside their limits; empty where the
// verdict says nothing.
std::string VerdictHtml(const v1::Verdict& verdict);

}  // namespace weft
