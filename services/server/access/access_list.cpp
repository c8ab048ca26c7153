#include "services/server/access/access_list.h"

#include <sys/random.h>
#include <sys/stat.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <chrono>

#include "absl/strings/escaping.h"
#include "absl/strings/str_cat.h"
#include "base/host_clock.h"
#include "base/status_macros.h"
#include "capture/file/posix_file.h"
#include "services/formats/files/atomic_file.h"
#include "services/formats/files/json_file.h"
#include "services/server/catalogue/folder_sync.h"
#include "services/work/items/item_words.h"
#include "services/work/items/sha256.h"

namespace weft {
namespace {

constexpr int kTokenBytes = 32;  // of the kernel's random numbers, so that no token can be guessed
constexpr size_t kIdDigits = 12;
constexpr size_t kLongestCommonName = 64;  // X.520, ub-common-name
constexpr double kDay_ns = 86400e9;
constexpr double kMostDays = 36500;

absl::Status CheckRole(v1::Role role) {
  if (v1::Role_IsValid(role) && role != v1::ROLE_UNSPECIFIED) return absl::OkStatus();
  return absl::InvalidArgumentError("role: must be viewer, client, operator or admin");
}

absl::StatusOr<std::string> NewTokenText() {
  std::array<char, kTokenBytes> bytes{};
  if (getrandom(bytes.data(), bytes.size(), 0) != kTokenBytes)
    return absl::UnavailableError("the kernel gave no random numbers for a token");
  return absl::StrCat("weft_", absl::BytesToHexString({bytes.data(), bytes.size()}));
}

// Reads, changes and writes the list while no other process does.
template <typename Change>
absl::Status ChangeList(const std::string& path, Change change) {
  constexpr std::chrono::seconds kLockTimeout{5};
  WEFT_ASSIGN_OR_RETURN(const FileLock lock, FileLock::Take(path, kLockTimeout));
  WEFT_ASSIGN_OR_RETURN(v1::AccessList list, ReadAccessList(path));
  WEFT_RETURN_IF_ERROR(change(list));
  WEFT_ASSIGN_OR_RETURN(const std::string text, ToJson(list));
  return WriteFileAtomically(path, text, 0600);
}

template <typename Entries, typename Is>
void Remove(Entries& entries, Is is) {
  entries.erase(std::remove_if(entries.begin(), entries.end(), is), entries.end());
}

}  // namespace

std::string AccessListFile(const std::string& state_folder) {
  return absl::StrCat(state_folder, "/access.json");
}

absl::StatusOr<v1::AccessList> ReadAccessList(const std::string& path) {
  v1::AccessList list;
  struct stat file = {};
  if (stat(path.c_str(), &file) != 0) {
    if (errno == ENOENT) return list;
    return FileError(path, "cannot be read", errno);
  }
  if ((file.st_mode & (S_IWGRP | S_IWOTH)) != 0) {
    return absl::PermissionDeniedError(
        absl::StrCat(path, ": other users may write this file; close it by `chmod go-rwx ", path, "`"));
  }
  WEFT_RETURN_IF_ERROR(ReadJsonFile(path, list));
  return list;
}

std::string HashOfToken(const std::string& text) { return Sha256().Add(text).Hex(); }

absl::StatusOr<NewToken> AddToken(const std::string& path, const TokenRequest& request) {
  WEFT_RETURN_IF_ERROR(CheckItemName(request.name));
  WEFT_RETURN_IF_ERROR(CheckRole(request.role));
  if (!(request.days >= 0 && request.days <= kMostDays))
    return absl::InvalidArgumentError(absl::StrCat("days: must be 0 to ", kMostDays));
  WEFT_ASSIGN_OR_RETURN(const std::string text, NewTokenText());
  NewToken added;
  added.text = text;
  added.token.set_sha256(HashOfToken(text));
  added.token.set_id(added.token.sha256().substr(0, kIdDigits));
  added.token.set_name(request.name);
  added.token.set_role(request.role);
  added.token.set_created_unix_ns(HostTime_ns());
  if (request.days > 0)
    added.token.set_expires_unix_ns(HostTime_ns() + static_cast<int64_t>(request.days * kDay_ns));
  WEFT_RETURN_IF_ERROR(ChangeList(path, [&](v1::AccessList& list) {
    *list.add_tokens() = added.token;
    return absl::OkStatus();
  }));
  return added;
}

absl::Status AllowCertificate(const std::string& path, const std::string& common_name, v1::Role role) {
  if (common_name.empty() || common_name.size() > kLongestCommonName)
    return absl::InvalidArgumentError("common name: must have 1 to 64 characters");
  WEFT_RETURN_IF_ERROR(CheckRole(role));
  return ChangeList(path, [&](v1::AccessList& list) {
    for (v1::CertificateOwner& owner : *list.mutable_certificates()) {
      if (owner.common_name() != common_name) continue;
      owner.set_role(role);
      return absl::OkStatus();
    }
    v1::CertificateOwner& owner = *list.add_certificates();
    owner.set_common_name(common_name);
    owner.set_role(role);
    return absl::OkStatus();
  });
}

absl::Status RevokeAccess(const std::string& path, const std::string& id_or_name) {
  return ChangeList(path, [&](v1::AccessList& list) {
    const int before = list.tokens_size() + list.certificates_size();
    Remove(*list.mutable_tokens(), [&](const v1::Token& token) { return token.id() == id_or_name; });
    Remove(*list.mutable_certificates(),
           [&](const v1::CertificateOwner& owner) { return owner.common_name() == id_or_name; });
    if (list.tokens_size() + list.certificates_size() < before) return absl::OkStatus();
    return absl::NotFoundError(absl::StrCat(path, ": no token of id \"", id_or_name,
                                            "\" and no certificate of that name; `weft access list` shows "
                                            "them"));
  });
}

}  // namespace weft
