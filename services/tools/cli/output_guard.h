// What a command may write where --out says: nothing is overwritten unasked that may not be made again, and
// no folders are made for a misspelt path.
#pragma once

#include <CLI/CLI.hpp>

#include <string>

#include "absl/status/status.h"
#include "alignment/template.h"

namespace weft {

class OutputGuard {
 public:
  // Declares --force. The guard must live as long as the command.
  void AddTo(CLI::App& command);

  // To be asked where `file` would be overwritten with other content. Asks on a terminal. `what`: "the board
  // of a fabric". AlreadyExists: the file is there, and nobody agreed.
  absl::Status MayReplace(const std::string& file, const std::string& what) const;

 private:
  bool force_ = false;
};

// Before a template is written to `folder`: a new one, an empty one, or that of a template to be replaced.
// Errors of MayReplace.
absl::Status MayWriteTemplateFolder(const std::string& folder, const OutputGuard& guard);
// The same one may be written again.
absl::Status MayWriteTemplate(const std::string& folder, const Template& garment, const OutputGuard& guard);

// "PATH: the folder ... is missing", of the folder in which `path` is to be made; empty where it is there.
std::string MissingParent(const std::string& path);
// NotFound: it is missing. Of --out it is asked for all commands (CheckOut).
absl::Status CheckParentFolder(const std::string& path);

}  // namespace weft
