// What processes that read the files of others learn of the environment of their parent.
#pragma once

#include <string>
#include <string_view>
#include <vector>

namespace weft {

// Whether the variable's name says that its value is a secret, as AWS_SECRET_ACCESS_KEY or GITHUB_TOKEN.
bool IsNameOfSecret(std::string_view name);

// "NAME=value" of each variable of this process but secrets.
std::vector<std::string> EnvironmentWithoutSecrets();

}  // namespace weft
