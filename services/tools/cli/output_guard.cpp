#include "services/tools/cli/output_guard.h"

#include <unistd.h>

#include <cstdio>
#include <filesystem>
#include <iostream>
#include <set>

#include "absl/strings/ascii.h"
#include "absl/strings/str_cat.h"
#include "base/path_facts.h"
#include "services/formats/files/template_file.h"

namespace weft {
namespace {

namespace fs = std::filesystem;

// What a build writes before the template itself.
const std::set<std::string> kOfStoppedBuilds = {"clouds", "report.html"};

bool Agrees(const std::string& file, const std::string& what) {
  std::fprintf(stderr, "%s is there already: %s. Overwrite it? [y/N] ", file.c_str(), what.c_str());
  std::fflush(stderr);
  std::string answer;
  std::getline(std::cin, answer);
  answer = absl::AsciiStrToLower(absl::StripAsciiWhitespace(answer));
  return answer == "y" || answer == "yes";
}

}  // namespace

void OutputGuard::AddTo(CLI::App& command) {
  command.add_flag("--force", force_, "Overwrite what is there without a question");
}

absl::Status OutputGuard::MayReplace(const std::string& file, const std::string& what) const {
  if (force_ || !PathExists(file)) return absl::OkStatus();
  const bool can_ask = isatty(STDIN_FILENO) == 1 && isatty(STDERR_FILENO) == 1;
  if (can_ask && Agrees(file, what)) return absl::OkStatus();
  return absl::AlreadyExistsError(
      absl::StrCat(file, ": is there already: ", what, "; name another place, or overwrite it with --force"));
}

absl::Status MayWriteTemplateFolder(const std::string& folder, const OutputGuard& guard) {
  std::error_code error;
  const fs::path is_template = fs::path(folder) / "template.json";
  if (fs::exists(is_template, error))
    return guard.MayReplace(is_template.string(), "a template, and results may have its vertices");
  for (const fs::directory_entry& entry : fs::directory_iterator(folder, error)) {
    const std::string name = entry.path().filename().string();
    if (kOfStoppedBuilds.contains(name) || name.starts_with('.')) continue;
    return guard.MayReplace(folder, absl::StrCat("a folder of something else, it has ", name));
  }
  return absl::OkStatus();
}

absl::Status MayWriteTemplate(const std::string& folder, const Template& garment, const OutputGuard& guard) {
  const absl::StatusOr<Template> before = ReadTemplate(folder);
  if (before.ok() && before->ContentHash() == garment.ContentHash()) return absl::OkStatus();
  return MayWriteTemplateFolder(folder, guard);
}

std::string MissingParent(const std::string& path) {
  std::error_code error;
  fs::path whole = fs::absolute(path, error).lexically_normal();
  if (!whole.has_filename()) whole = whole.parent_path();  // "dir/"
  const fs::path parent = whole.parent_path();
  if (error || fs::is_directory(parent, error)) return "";
  fs::path there = parent;
  while (!fs::exists(there, error) && there.has_relative_path()) there = there.parent_path();
  return absl::StrCat(path, ": the folder ", parent.string(), " is missing (", there.string(), " is there)");
}

absl::Status CheckParentFolder(const std::string& path) {
  const std::string missing = MissingParent(path);
  if (missing.empty()) return absl::OkStatus();
  return absl::NotFoundError(absl::StrCat(missing, "; look for a typing error, or make it with mkdir -p"));
}

}  // namespace weft
