#include "services/formats/synthetic/take_folder.h"

#include <fcntl.h>
#include <sys/file.h>
#include <unistd.h>

#include <filesystem>
#include <utility>

#include "absl/strings/str_cat.h"
#include "absl/strings/str_format.h"
#include "absl/strings/strip.h"
#include "base/path_facts.h"
#include "base/status_macros.h"
#include "services/formats/files/atomic_file.h"

namespace weft {
namespace {

namespace fs = std::filesystem;

constexpr const char* kRecipe = "recipe.txt";

absl::Status CheckRecipe(const std::string& path, const std::string& recipe) {
  std::error_code error;
  if (!fs::exists(fs::path(path) / kRecipe, error)) {
    if (!fs::exists(path, error) || fs::is_empty(path, error)) return absl::OkStatus();
    return absl::AlreadyExistsError(
        absl::StrCat(path, ": exists and is not an empty folder; remove it or choose another"));
  }
  WEFT_ASSIGN_OR_RETURN(const std::string text, ReadWholeFile((fs::path(path) / kRecipe).string()));
  const std::string begun(absl::StripSuffix(text, "\n"));
  if (begun == recipe) return absl::OkStatus();
  return absl::AlreadyExistsError(
      absl::StrCat(path, ": a take of another recipe exists there (\"", begun, "\", not \"", recipe,
                   "\"); give the same options to go on, or choose another folder"));
}

absl::Status Move(const fs::path& from, const fs::path& to) {
  std::error_code error;
  fs::remove_all(to, error);
  fs::rename(from, to, error);
  if (!error) return absl::OkStatus();
  return absl::UnavailableError(
      absl::StrCat(to.string(), ": cannot be put in place (", error.message(), ")"));
}

}  // namespace

absl::StatusOr<TakeFolder> TakeFolder::Open(const std::string& out, const std::string& recipe) {
  fs::path path = fs::path(out).lexically_normal();
  if (!path.has_filename()) path = path.parent_path();
  WEFT_RETURN_IF_ERROR(CheckRecipe(path.string(), recipe));
  WEFT_RETURN_IF_ERROR(CreateFolders(path / "truth"));
  const std::string record = (path / kRecipe).string();
  if (!PathExists(record)) {
    WEFT_RETURN_IF_ERROR(WriteFileAtomically(record, recipe + "\n"));
  }
  const int lock = open(record.c_str(), O_RDONLY | O_CLOEXEC);
  if (lock < 0 || flock(lock, LOCK_EX | LOCK_NB) != 0) {
    if (lock >= 0) close(lock);
    return absl::UnavailableError(
        absl::StrCat(path.string(), ": another process writes this take; wait for it or stop it"));
  }
  TakeFolder folder(path.string(), lock);
  RemoveTree(folder.Unfinished());
  return folder;
}

TakeFolder::TakeFolder(TakeFolder&& other) noexcept
    : path_(std::move(other.path_)), lock_(std::exchange(other.lock_, -1)) {}

TakeFolder::~TakeFolder() {
  if (lock_ < 0) return;
  RemoveTree(Unfinished());
  close(lock_);
}

std::string TakeFolder::NameOf(int frame) { return absl::StrFormat("%04d", frame); }

std::string TakeFolder::Unfinished() const { return (fs::path(path_) / ".unfinished").string(); }

std::string TakeFolder::TruthOf(int frame) const {
  return (fs::path(path_) / "truth" / NameOf(frame)).string();
}

bool TakeFolder::HasFrame(int frame) const {
  return IsFolder(fs::path(path_) / NameOf(frame)) && IsFolder(TruthOf(frame));
}

absl::StatusOr<TakeFolder::Draft> TakeFolder::BeginFrame(int frame) const {
  const fs::path folder = fs::path(Unfinished()) / NameOf(frame);
  Draft out = {folder / "pictures", folder / "truth"};
  for (const std::string& part : {out.pictures, out.truth}) WEFT_RETURN_IF_ERROR(CreateFolders(part));
  return out;
}

// The pictures come last: a frame counts when they are there.
absl::Status TakeFolder::KeepFrame(int frame) const {
  const fs::path folder = fs::path(Unfinished()) / NameOf(frame);
  WEFT_RETURN_IF_ERROR(Move(folder / "truth", TruthOf(frame)));
  return Move(folder / "pictures", fs::path(path_) / NameOf(frame));
}

std::string TakeFolder::PicturesCsv() const { return (fs::path(path_) / "truth" / "pictures.csv").string(); }

std::string TakeFolder::FramesFile() const { return (fs::path(path_) / "truth" / "frames.bin").string(); }

bool TakeFolder::IsComplete() const { return PathExists(PicturesCsv()) || PathExists(FramesFile()); }

}  // namespace weft
