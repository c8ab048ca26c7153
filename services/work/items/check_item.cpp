#include "services/work/items/check_item.h"

#include <set>
#include <string>

#include "absl/strings/match.h"
#include "absl/strings/str_cat.h"
#include "absl/strings/str_replace.h"
#include "base/status_macros.h"
#include "capture/take/image_folder.h"
#include "capture/take/recorded_take.h"
#include "capture/take/take_files.h"
#include "services/formats/files/board_file.h"
#include "services/formats/files/garment_file.h"
#include "services/formats/files/rig_file.h"
#include "services/formats/files/template_file.h"
#include "services/work/animation/avatar_file.h"

namespace weft {
namespace {

absl::Status CheckDump(const std::string& folder) {
  if (IsRecordedTake(folder)) return RecordedTake::Open(folder).status();
  WEFT_ASSIGN_OR_RETURN(const ImageFolder images, ListImageFolder(folder, nullptr, UnfitNames::kLeaveOut));
  if (!images.frames.empty()) return absl::OkStatus();
  return absl::InvalidArgumentError(
      "is neither a recorded take nor a folder of images, <frame>/<camera>.png or "
      "cam<camera>/image<frame>.png");
}

absl::Status ReadContent(v1::ItemKind kind, const std::string& path) {
  switch (kind) {
    case v1::ITEM_KIND_RIG:
      return ReadRig(path).status();
    case v1::ITEM_KIND_BOARD:
      return ReadBoard(path).status();
    case v1::ITEM_KIND_TEMPLATE:
      return ReadTemplate(path).status();
    case v1::ITEM_KIND_AVATAR:
      return ReadAvatar(path, NetReading::kBytesAlone).status();
    default:
      return CheckDump(path);
  }
}

// Frames of one mesh in mm, as an import reads them.
absl::Status CheckGarmentFiles(const v1::ItemManifest& manifest, const std::string& folder) {
  GarmentMesh first;
  for (const v1::ItemFile& file : manifest.files()) {
    if (!IsMeshName(file.path()))
      return absl::InvalidArgumentError(absl::StrCat(
          "manifest.files: ", file.path(), " is neither .obj nor .ply; a garment is such files alone"));
    const std::string path = absl::StrCat(folder, "/", file.path());
    if (first.rest.faces.empty()) {
      WEFT_ASSIGN_OR_RETURN(first, ReadGarmentMesh(path));
    } else {
      WEFT_RETURN_IF_ERROR(ReadGarmentMoment(path, first).status());
    }
  }
  return absl::OkStatus();
}

// A net has both of its files.
bool IsAvatar(const v1::ItemManifest& manifest) {
  std::set<std::string> files;
  for (const v1::ItemFile& file : manifest.files()) files.insert(file.path());
  const std::set<std::string> without_net = {kAvatarFile, kAvatarSpaceFile};
  std::set<std::string> with_net = without_net;
  with_net.insert({kAvatarNetFile, kAvatarSampleFile});
  return files == without_net || files == with_net;
}

}  // namespace

std::string InputPathOf(v1::ItemKind kind, const v1::ItemManifest& manifest, const std::string& folder) {
  if (kind == v1::ITEM_KIND_BOARD) {  // any name, with its images beside it
    for (const v1::ItemFile& file : manifest.files()) {
      if (absl::EndsWith(file.path(), ".json")) return absl::StrCat(folder, "/", file.path());
    }
  }
  const bool may_be_file =
      kind == v1::ITEM_KIND_RIG || kind == v1::ITEM_KIND_BOARD || kind == v1::ITEM_KIND_GARMENT;
  if (!may_be_file || manifest.files_size() != 1) return folder;
  return absl::StrCat(folder, "/", manifest.files(0).path());
}

absl::Status CheckItemContent(v1::ItemKind kind, const v1::ItemManifest& manifest,
                              const std::string& folder) {
  if (kind == v1::ITEM_KIND_RIG && manifest.files_size() != 1) {
    return absl::InvalidArgumentError(
        absl::StrCat("manifest.files: a rig is one rig.json, ", manifest.files_size(), " files are given"));
  }
  if (kind == v1::ITEM_KIND_AVATAR && !IsAvatar(manifest)) {
    return absl::InvalidArgumentError(
        "manifest.files: an avatar is avatar.json and space.bin, with a net net.onnx and sample.bin as well; "
        "other files are given");
  }
  const absl::Status status = kind == v1::ITEM_KIND_GARMENT
                                  ? CheckGarmentFiles(manifest, folder)
                                  : ReadContent(kind, InputPathOf(kind, manifest, folder));
  if (status.ok()) return status;
  // The folder has no meaning for the client.
  const std::string message =
      absl::StrReplaceAll(status.message(), {{absl::StrCat(folder, "/"), ""}, {folder, "the item"}});
  const bool of_disk = absl::IsResourceExhausted(status) || absl::IsUnavailable(status);
  return absl::Status(of_disk ? status.code() : absl::StatusCode::kInvalidArgument, message);
}

}  // namespace weft
