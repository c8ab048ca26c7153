#include "services/tools/cli/print_verdict.h"

#include <unistd.h>

#include <cstdio>
#include <cstdlib>
#include <string>

#include "services/formats/verdict/verdict.h"

namespace weft {
namespace {

const char* ColourOf(v1::Grade grade) {
  switch (grade) {
    case v1::GRADE_GOOD:
      return "\033[1;32m";
    case v1::GRADE_USABLE:
      return "\033[1;33m";
    default:
      return "\033[1;31m";
  }
}

bool ShowsColours() {
  const char* plain = std::getenv("NO_COLOR");
  return (plain == nullptr || *plain == '\0') && isatty(STDOUT_FILENO) == 1;
}

}  // namespace

void PrintVerdict(const v1::Verdict& verdict) {
  std::string text = VerdictText(verdict);
  if (ShowsColours()) {
    text.insert(GradeWord(verdict.grade()).size(), "\033[0m");
    text.insert(0, ColourOf(verdict.grade()));
  }
  std::fputs(text.c_str(), stdout);
}

}  // namespace weft
