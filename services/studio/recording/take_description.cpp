#include "services/studio/recording/take_description.h"

#include <algorithm>
#include <filesystem>

#include "absl/strings/ascii.h"
#include "absl/strings/match.h"
#include "absl/strings/str_cat.h"
#include "absl/strings/str_replace.h"
#include "absl/strings/str_split.h"
#include "base/path_facts.h"
#include "base/status_macros.h"
#include "capture/file/plain_text.h"
#include "capture/take/take_files.h"
#include "services/studio/recording/take_file.h"
#include "services/studio/recording/take_verdict.h"

namespace weft {
namespace {

namespace fs = std::filesystem;

constexpr size_t kMostLine = 255, kMostNotes = 4096;  // bytes, as takes.proto says
constexpr int kDepth = 2;                             // a daemon's takes lie at <takes>/<id>/take

absl::Status CheckLine(const char* what, const std::string& text, size_t most) {
  if (text.size() > most)
    return absl::InvalidArgumentError(absl::StrCat(what, ": ", text.size(), " bytes, at most ", most));
  if (IsPlainText(text)) return absl::OkStatus();
  return absl::InvalidArgumentError(absl::StrCat(what, ": must be UTF-8 text without control characters"));
}

void AddTakesBelow(const fs::path& folder, int depth, std::vector<std::string>& folders) {
  if (IsRecordedTake(folder.string())) {
    folders.push_back(folder.string());
    return;
  }
  if (depth == 0) return;
  std::error_code error;
  for (fs::directory_iterator it(folder, error), end; !error && it != end; it.increment(error)) {
    std::error_code entry_error;
    const bool unfinished = absl::EndsWith(it->path().string(), ".unfinished");
    if (it->is_directory(entry_error) && !unfinished) AddTakesBelow(it->path(), depth - 1, folders);
  }
}

}  // namespace

absl::Status CheckTakeDescription(const TakeDescription& description) {
  absl::Status status;
  if (description.slate) status.Update(CheckLine("slate", *description.slate, kMostLine));
  if (description.name) status.Update(CheckLine("name", *description.name, kMostLine));
  if (description.notes)
    status.Update(CheckLine("notes", absl::StrReplaceAll(*description.notes, {{"\n", " "}}), kMostNotes));
  return status;
}

absl::StatusOr<v1::Take> DescribeTakeFile(const std::string& folder, const TakeDescription& description) {
  WEFT_RETURN_IF_ERROR(CheckTakeDescription(description));
  WEFT_ASSIGN_OR_RETURN(v1::Take take, ReadTakeFile(folder));
  if (IsBeingRecorded(folder))
    return absl::FailedPreconditionError(
        absl::StrCat(folder, ": is being recorded; describe it when it has ended"));
  if (description.slate) take.set_slate(*description.slate);
  if (description.name) take.set_name(*description.name);
  if (description.notes) take.set_notes(*description.notes);
  WEFT_RETURN_IF_ERROR(WriteTakeFile(folder, take));
  return take;
}

bool HasWords(const std::string& words, const std::vector<std::string>& texts) {
  const std::vector<std::string> wanted = absl::StrSplit(words, ' ', absl::SkipWhitespace());
  return std::ranges::all_of(wanted, [&](const std::string& word) {
    return std::ranges::any_of(texts, [&](const std::string& text) {
      return absl::StrContains(absl::AsciiStrToLower(text), absl::AsciiStrToLower(word));
    });
  });
}

absl::StatusOr<std::vector<FoundTake>> FindTakes(const std::string& folder, const std::string& words) {
  if (!IsFolder(folder)) return absl::NotFoundError(absl::StrCat(folder, ": no such folder"));
  std::vector<std::string> folders;
  AddTakesBelow(folder, kDepth, folders);
  std::ranges::sort(folders);
  std::vector<FoundTake> found;
  for (const std::string& path : folders) {
    absl::StatusOr<v1::Take> take = ReadTakeFile(path);
    if (!take.ok()) continue;  // `weft take info` tells what is wrong with it
    if (HasWords(words, {take->slate(), take->name(), take->notes(), take->id(), take->timecode(),
                         take->origin(), path}))
      found.push_back({path, *std::move(take)});
  }
  return found;
}

}  // namespace weft
