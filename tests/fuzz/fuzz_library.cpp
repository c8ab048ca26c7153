// Manifests and requests of uploads, on a real library in a temporary folder. Nothing may be written beside
// its item, and what is taken in has the hashes that were declared.
#include <sys/stat.h>

#include <filesystem>
#include <memory>

#include "services/formats/files/json_file.h"
#include "services/server/library/library.h"
#include "services/server/library/uploads.h"
#include "services/work/items/item_words.h"
#include "services/work/items/manifest.h"
#include "services/work/items/sha256.h"
#include "tests/fuzz/fuzz_target.h"

namespace {

namespace fs = std::filesystem;

const weft::Caller kAnybody{"token 1 (anna)", weft::v1::ROLE_CLIENT};

// In memory where that is possible: this is about names and bytes, not about disks.
class Store {
 public:
  Store() : folder_(weft::FuzzFolder("library")) {
    fs::remove_all(folder_);
    fs::create_directories(state());
    auto library = weft::Library::Open(state());
    weft::FuzzRequire(library.ok());
    library_ = *std::move(library);
    uploads_ = std::make_unique<weft::Uploads>(
        *library_, state(), [](auto, const auto&, const auto&) { return absl::OkStatus(); });
  }
  ~Store() { fs::remove_all(folder_); }

  weft::Library& library() { return *library_; }
  weft::Uploads& uploads() { return *uploads_; }

  // Whether only the store's own folders are there.
  bool IsAlone() const {
    return CountIn(folder_) == 1 && CountIn(state()) == 2 &&
           CountIn(state() + "/library") == 6;  // kinds of items
  }

 private:
  static ptrdiff_t CountIn(const fs::path& folder) {
    return std::distance(fs::directory_iterator(folder), fs::directory_iterator());
  }
  std::string state() const { return (folder_ / "state").string(); }

  const fs::path folder_;
  std::unique_ptr<weft::Library> library_;
  std::unique_ptr<weft::Uploads> uploads_;
};

void CheckTaken(Store& store, const weft::v1::LibraryItem& item) {
  const auto held = store.library().Hold(item.kind(), "sha256:" + item.id());
  weft::FuzzRequire(held.ok() && weft::ItemIdOf(held->item.manifest()) == item.id());
  for (const weft::v1::ItemFile& file : held->item.manifest().files()) {
    const auto hash =
        weft::Sha256OfFile(store.library().ContentFolder(item.kind(), item.id()) + "/" + file.path());
    weft::FuzzRequire(hash.ok() && *hash == file.sha256());
  }
}

// A manifest as it lies on the disk. What is accepted keeps its id when it is written and read again.
void TryManifest(std::string_view text) {
  weft::v1::ItemManifest manifest, again;
  if (!weft::ParseJson(text, "json", manifest).ok() || !weft::CheckManifest(manifest).ok()) return;
  const auto json = weft::ToJson(manifest);
  weft::FuzzRequire(json.ok() && weft::ParseJson(*json, "again", again).ok());
  weft::FuzzRequire(weft::CheckManifest(again).ok() && weft::ItemIdOf(again) == weft::ItemIdOf(manifest));
}

// One upload: a line with kind and name, a manifest in lines "<bytes> <path>" up to an empty line, then
// pieces
// "<offset> <path>" with a line of bytes each. Hashes are those of the bytes to come, so that uploads get to
// their end.
void TryUpload(Store& store, const std::string& text) {
  weft::v1::BeginUploadRequest request;
  std::vector<weft::v1::WriteFileRequest> pieces;
  std::vector<std::string> lines;
  for (size_t at = 0; at < text.size() && lines.size() < 40;) {
    const size_t end = std::min(text.find('\n', at), text.size());
    lines.push_back(text.substr(at, end - at));
    at = end + 1;
  }
  if (lines.empty()) return;
  request.set_kind(static_cast<weft::v1::ItemKind>(lines[0].empty() ? 0 : lines[0][0] - '0'));
  request.set_name(lines[0].empty() ? "" : lines[0].substr(1));
  size_t line = 1;
  const auto split = [&](std::string* path) {
    const size_t space = lines[line].find(' ');
    *path = space == std::string::npos ? "" : lines[line].substr(space + 1);
    return static_cast<int64_t>(std::strtoll(lines[line].c_str(), nullptr, 10));
  };
  for (; line < lines.size() && !lines[line].empty(); ++line) {
    weft::v1::ItemFile& file = *request.mutable_manifest()->add_files();
    file.set_bytes(split(file.mutable_path()));
    file.set_sha256(weft::Sha256().Hex());
  }
  for (++line; line + 1 < lines.size(); line += 2) {
    weft::v1::WriteFileRequest& piece = pieces.emplace_back();
    piece.set_offset(split(piece.mutable_path()));
    piece.set_data(lines[line + 1]);
  }
  for (weft::v1::ItemFile& file : *request.mutable_manifest()->mutable_files()) {
    std::string bytes;
    for (const auto& piece : pieces) {
      if (piece.path() == file.path() && piece.offset() == static_cast<int64_t>(bytes.size()))
        bytes += piece.data();
    }
    file.set_sha256(weft::Sha256().Add(bytes).Hex());
  }
  const auto begun = store.uploads().Begin(request, kAnybody);
  if (!begun.ok() || begun->has_item()) return;
  {
    weft::UploadWriter writer(store.uploads(), kAnybody);
    for (weft::v1::WriteFileRequest& piece : pieces) {
      piece.set_upload_id(begun->upload_id());
      if (!writer.Add(piece).ok()) break;
    }
    (void)writer.Sync();
  }
  const auto item = store.uploads().Finish(begun->upload_id(), kAnybody);
  if (!item.ok()) return;
  CheckTaken(store, *item);
  const auto deleted = store.library().Delete(item->kind(), "sha256:" + item->id(),
                                              [](const auto&) { return absl::OkStatus(); });
  weft::FuzzRequire(deleted.ok() && deleted->content_deleted);
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const uint8_t* data, size_t size) {
  static Store store;
  static uint64_t count = 0;
  const std::string text(reinterpret_cast<const char*>(data), size);
  if (!text.empty() && text[0] == '{') {
    TryManifest(text);
  } else {
    (void)store.library().Find(weft::v1::ITEM_KIND_RIG, text);
    TryUpload(store, text);
  }
  if (++count % 256 == 0) {
    for (const weft::Uploads::Unfinished& one : store.uploads().ListUnfinished())
      store.uploads().Abandon(one.upload_id, one.last_piece_unix_ns).IgnoreError();
    weft::FuzzRequire(store.IsAlone());
  }
  return 0;
}

std::vector<std::string> weft::FuzzSeeds() {
  return {"1studio\n3 rig.json\n\n0 rig.json\n{ }\n",
          "4jump\n2 0001/a.png\n1 0001/b.png\n0 empty\n\n"
          "0 0001/a.png\nx\n1 0001/a.png\ny\n0 0001/b.png\nz\n",
          "2stripes@2", "sha256:" + std::string(64, 'a'),
          R"({"files": [{"path": "rig.json", "bytes": "3", "sha256": ")" + std::string(64, 'a') +
              R"("}, {"path": "0001/a.png", "bytes": "0", "sha256": ")" + std::string(64, '0') + R"("}]})"};
}
