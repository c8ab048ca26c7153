#include "services/work/items/item_words.h"

#include <algorithm>
#include <filesystem>

#include "absl/strings/ascii.h"
#include "absl/strings/match.h"
#include "absl/strings/numbers.h"
#include "absl/strings/str_cat.h"
#include "base/path_facts.h"
#include "base/status_macros.h"
#include "capture/file/plain_text.h"
#include "services/formats/files/enum_words.h"

namespace weft {
namespace {

constexpr size_t kMaxItemNameBytes = 100;
constexpr char kHashPrefix[] = "sha256:";
constexpr size_t kSha256Digits = 64;

bool IsNameCharacter(char c) { return absl::ascii_isalnum(c) || c == '.' || c == '_' || c == '-'; }

}  // namespace

const char* ItemKindWord(v1::ItemKind kind) { return EnumWord(kind, "unknown"); }

absl::StatusOr<v1::ItemKind> ParseItemKind(const std::string& word) {
  for (const v1::ItemKind kind : {v1::ITEM_KIND_RIG, v1::ITEM_KIND_BOARD, v1::ITEM_KIND_TEMPLATE,
                                  v1::ITEM_KIND_DUMP, v1::ITEM_KIND_AVATAR, v1::ITEM_KIND_GARMENT}) {
    if (word == ItemKindWord(kind)) return kind;
  }
  return absl::InvalidArgumentError(absl::StrCat(
      "kind: \"", EscapedText(word), "\" is none; give rig, board, template, dump, avatar or garment"));
}

absl::Status CheckItemKind(v1::ItemKind kind) {
  if (v1::ItemKind_IsValid(kind) && kind != v1::ITEM_KIND_UNSPECIFIED) return absl::OkStatus();
  return absl::InvalidArgumentError(
      absl::StrCat("kind: ", static_cast<int>(kind),
                   " is no kind of item; give RIG, BOARD, TEMPLATE, DUMP, AVATAR or GARMENT"));
}

absl::Status CheckItemName(const std::string& name) {
  const bool plain = !name.empty() && name.size() <= kMaxItemNameBytes && absl::ascii_isalnum(name.front()) &&
                     std::ranges::all_of(name, IsNameCharacter);
  if (plain) return absl::OkStatus();
  return absl::InvalidArgumentError(absl::StrCat(
      "name: \"", EscapedText(name.substr(0, kMaxItemNameBytes)), "\" must be 1 to ", kMaxItemNameBytes,
      " letters, digits, \".\", \"_\" or \"-\", and begin with a letter or digit"));
}

std::string ItemNameOfPath(const std::string& path) {
  namespace fs = std::filesystem;
  fs::path named = fs::absolute(path).lexically_normal();
  if (!named.has_filename()) named = named.parent_path();
  std::string name = (IsFolder(named) ? named.filename() : named.stem()).string();
  name.resize(std::min(name.size(), kMaxItemNameBytes));
  for (char& c : name) c = IsNameCharacter(c) ? c : '-';
  if (name.empty() || !absl::ascii_isalnum(name.front())) {
    name = "item" + name.substr(0, kMaxItemNameBytes - 4);
  }
  return name;
}

bool IsSha256(const std::string& text) {
  return text.size() == kSha256Digits &&
         std::ranges::all_of(text, [](char c) { return absl::ascii_isdigit(c) || (c >= 'a' && c <= 'f'); });
}

absl::StatusOr<ItemReference> ParseItemReference(const std::string& text) {
  ItemReference reference;
  if (absl::StartsWith(text, kHashPrefix)) {
    reference.id = text.substr(sizeof(kHashPrefix) - 1);
    if (!IsSha256(reference.id)) {
      return absl::InvalidArgumentError("item: after \"sha256:\" there must be 64 lower-case hex digits");
    }
    return reference;
  }
  const size_t at = text.find('@');
  reference.name = text.substr(0, at);
  WEFT_RETURN_IF_ERROR(CheckItemName(reference.name));
  if (at == std::string::npos) return reference;
  int version = 0;
  const std::string digits = text.substr(at + 1);
  if (!absl::SimpleAtoi(digits, &version) || version < 1) {
    return absl::InvalidArgumentError(
        absl::StrCat("item: the version \"", EscapedText(digits.substr(0, kMaxItemNameBytes)),
                     "\" must be a number from 1, as in ", reference.name, "@2"));
  }
  reference.version = version;
  return reference;
}

}  // namespace weft
