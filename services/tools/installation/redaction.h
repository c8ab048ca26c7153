// Texts without the secrets that may stand in them.
#pragma once

#include <string>
#include <vector>

namespace weft {

// Thread safety: const access.
class Redaction {
 public:
  // Words shorter than 8 characters are no secrets.
  void AddSecret(const std::string& secret);
  // Each line of the file, if it can be read.
  void AddSecretFile(const std::string& path);

  // What follows the host, wherever it stands.
  void AddSecretUrl(const std::string& url);

  // Secrets that were added, private keys in PEM, tokens of `weft access`, what follows "Bearer", users in
  // URLs, and paths and queries of those of the web: each is replaced by "[redacted]".
  std::string Apply(std::string text) const;

 private:
  std::vector<std::string> secrets_;
};

}  // namespace weft
