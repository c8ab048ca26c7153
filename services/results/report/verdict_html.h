// The verdict at the head of a page.
#pragma once

#include <string>

namespace weft {

namespace v1 {
class Verdict;
}

// The head of a page. `kind` (HTML) and the badge precede the headline (not escaped). The reason, if it
// differs, the remedy, and values with limits follow, then `more` (HTML) in the same <header>. Without a
// verdict there is only the headline.
std::string PageHead(const std::string& kind, const std::string& headline, const v1::Verdict& verdict,
                     const std::string& more);

// Badge and headline, reason, remedy, and values with limits, for a section within a page; the headline alone
// without a verdict.
std::string VerdictBlock(const std::string& headline, const v1::Verdict& verdict);

}  // namespace weft
