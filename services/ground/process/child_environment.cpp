#include "services/ground/process/child_environment.h"

#include <unistd.h>

#include <algorithm>
#include <array>
#include <cctype>

namespace weft {

bool IsNameOfSecret(std::string_view name) {
  static constexpr std::array<std::string_view, 11> kWords = {
      "TOKEN",  "SECRET",  "PASSWORD",   "PASSWD",      "PASSPHRASE", "CREDENTIAL",
      "APIKEY", "API_KEY", "ACCESS_KEY", "PRIVATE_KEY", "WEBHOOK"};
  std::string upper(name);
  std::ranges::transform(upper, upper.begin(), [](unsigned char c) { return std::toupper(c); });
  return std::ranges::any_of(
      kWords, [&upper](std::string_view word) { return upper.find(word) != std::string::npos; });
}

std::vector<std::string> EnvironmentWithoutSecrets() {
  std::vector<std::string> kept;
  for (char** entry = environ; entry != nullptr && *entry != nullptr; ++entry) {
    const std::string_view variable = *entry;
    if (!IsNameOfSecret(variable.substr(0, variable.find('=')))) kept.emplace_back(variable);
  }
  return kept;
}

}  // namespace weft
