// The verdict at the head of a page.
#pragma once

#include <string>

namespace weft {

namespace v1 {
class Verdict;
}

// The head of a page: a line of what kind it is (HTML already), the badge before the headline (not escaped),
// the reason where it is another one, the remedy, values beside limits; `more` (HTML already) follows in the
// same <header>. Without a verdict the headline alone.
std::string PageHead(const std::string& kind, const std::string& headline, const v1::Verdict& verdict,
                     const std::string& more);

}  // namespace weft
