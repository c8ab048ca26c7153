#include "services/work/animation/avatar_file.h"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <utility>

#include "absl/strings/str_cat.h"
#include "animation/sparse_view/net_correction.h"
#include "base/status_macros.h"
#include "capture/file/checksum.h"
#include "services/formats/files/json_file.h"
#include "services/formats/files/little_endian.h"
#include "services/work/animation/net_sample.h"
#include "services/work/animation/pixel_avatar_file.h"

namespace weft {
namespace {

constexpr std::string_view kSpaceMagic = "weftspc1";
constexpr size_t kTableHeadBytes = 1 + 4 + 4 + 1;  // with an empty name
constexpr float kSteps = 32767;

void PutTable(const AvatarTable& table, std::string& out) {
  PutLittleEndian(static_cast<uint8_t>(table.name.size()), out);
  out += table.name;
  PutLittleEndian(static_cast<uint32_t>(table.rows), out);
  PutLittleEndian(static_cast<uint32_t>(table.columns), out);
  PutLittleEndian(static_cast<uint8_t>(table.sixteen_bits ? 16 : 32), out);
  for (int row = 0; row < table.rows; ++row) {
    const float* values = table.values.data() + static_cast<size_t>(row) * static_cast<size_t>(table.columns);
    if (!table.sixteen_bits) {
      for (int k = 0; k < table.columns; ++k) PutLittleEndian(values[k], out);
      continue;
    }
    float largest = 0;
    for (int k = 0; k < table.columns; ++k) largest = std::max(largest, std::abs(values[k]));
    PutLittleEndian(largest, out);
    for (int k = 0; k < table.columns; ++k)
      PutLittleEndian(static_cast<int16_t>(largest > 0 ? std::lround(values[k] / largest * kSteps) : 0), out);
  }
}

// Takes one table off `rest`; false where it ends within.
bool TakeTable(std::string_view& rest, AvatarTable& table) {
  if (rest.size() < kTableHeadBytes) return false;
  const auto length = TakeLittleEndian<uint8_t>(rest);
  if (rest.size() < kTableHeadBytes - 1 + length) return false;
  table.name = rest.substr(0, length);
  rest.remove_prefix(length);
  const auto rows = TakeLittleEndian<uint32_t>(rest), columns = TakeLittleEndian<uint32_t>(rest);
  const auto bits = TakeLittleEndian<uint8_t>(rest);
  if ((bits != 16 && bits != 32) || rows > INT32_MAX || columns > INT32_MAX) return false;
  table.sixteen_bits = bits == 16;
  table.rows = static_cast<int>(rows), table.columns = static_cast<int>(columns);
  const uint64_t row_bytes = (table.sixteen_bits ? sizeof(float) : 0) + uint64_t{columns} * (bits / 8u);
  if (row_bytes > 0 && rows > rest.size() / row_bytes) return false;
  if (columns == 0 && rows > 0) return false;  // would cost time for nothing
  table.values.reserve(size_t{rows} * columns);
  for (uint32_t row = 0; row < rows; ++row) {
    const float largest = table.sixteen_bits ? TakeLittleEndian<float>(rest) : 1;
    for (uint32_t k = 0; k < columns; ++k)
      table.values.push_back(table.sixteen_bits ? largest * TakeLittleEndian<int16_t>(rest) / kSteps
                                                : TakeLittleEndian<float>(rest));
  }
  return true;
}

void Describe(const SigmaCheck& check, v1::AvatarSigmaCheck& about) {
  about.set_frames(check.frames);
  about.set_within_one(check.within_one);
  about.set_within_two(check.within_two);
}
SigmaCheck CheckOf(const v1::AvatarSigmaCheck& about) {
  return {about.frames(), about.within_one(), about.within_two()};
}

// What avatar.json says of the avatar itself.
void Describe(const SparseViewAvatar& avatar, v1::Avatar& about) {
  about.set_kind(kSparseViewKind);
  about.set_made_by("weft " WEFT_VERSION);
  about.set_template_hash(avatar.template_hash);
  about.set_board_hash(avatar.board_hash);
  about.set_vertices(avatar.space.vertices);
  about.set_components(avatar.space.components());
  about.set_fps(avatar.fps);
  about.set_training_frames(avatar.training_frames);
  about.set_held_out_frames(avatar.held_out_frames);
  v1::AvatarTraining& training = *about.mutable_training();
  training.set_components(avatar.training.components);
  training.set_max_frames(avatar.training.max_frames);
  training.set_calibration_frames(avatar.training.calibration_frames);
  training.set_seed(avatar.training.seed);
  about.set_left_mm(avatar.space.left_mm);
  about.clear_sigma();
  for (const auto& of_rays : avatar.sigma.of) {
    v1::AvatarSigma& sigma = *about.add_sigma();
    for (const float factor : of_rays) sigma.add_of_rays(factor);
  }
  Describe(avatar.held_out_check, *about.mutable_held_out_check());
  Describe(avatar.left_out_check, *about.mutable_left_out_check());
}

}  // namespace

std::string EncodeAvatarSpace(const std::vector<AvatarTable>& tables) {
  std::string out(kSpaceMagic);
  PutLittleEndian(static_cast<uint32_t>(tables.size()), out);
  for (const AvatarTable& table : tables) PutTable(table, out);
  PutLittleEndian(Checksum(out.data(), out.size()), out);
  return out;
}

absl::StatusOr<std::vector<AvatarTable>> DecodeAvatarSpace(std::string_view bytes,
                                                           const std::string& source_name) {
  const auto bad = [&](std::string_view what) {
    return absl::InvalidArgumentError(absl::StrCat(source_name, ": ", std::string(what)));
  };
  if (!bytes.starts_with(kSpaceMagic))
    return bad("holds no shapes of an avatar; it does not begin with weftspc1");
  if (bytes.size() < kSpaceMagic.size() + sizeof(uint32_t) + sizeof(uint64_t))
    return bad("ends within its head; was the file truncated?");
  std::string_view last = bytes.substr(bytes.size() - sizeof(uint64_t));
  if (TakeLittleEndian<uint64_t>(last) != Checksum(bytes.data(), bytes.size() - sizeof(uint64_t)))
    return absl::DataLossError(absl::StrCat(
        source_name, ": does not match its checksum; the file is damaged, copy or train the avatar again"));
  std::string_view rest =
      bytes.substr(kSpaceMagic.size(), bytes.size() - kSpaceMagic.size() - sizeof(uint64_t));
  const auto count = TakeLittleEndian<uint32_t>(rest);
  std::vector<AvatarTable> out;
  for (uint32_t k = 0; k < count; ++k) {
    AvatarTable table;
    if (!TakeTable(rest, table))
      return bad(
          absl::StrCat("ends within table ", k, " of ", count, "; was it written by a program of yours?"));
    out.push_back(std::move(table));
  }
  if (!rest.empty()) return bad(absl::StrCat("has ", rest.size(), " bytes beyond its tables"));
  return out;
}

absl::StatusOr<v1::Avatar> ParseAvatar(std::string_view json, const std::string& source_name,
                                       std::string_view kind) {
  v1::Avatar about;
  WEFT_RETURN_IF_ERROR(ParseJson(json, source_name, about));
  const auto bad = [&](const std::string& what) {
    return absl::InvalidArgumentError(absl::StrCat(source_name, ": ", what));
  };
  if (about.kind() != kind)
    return bad(absl::StrCat(
        "kind is \"", about.kind(), "\", expected \"", std::string(kind), "\"; ",
        about.kind() == kPixelKind || about.kind() == kSparseViewKind
            ? "avatars of the preset paper are compared with, by `weft evaluate --baseline`, "
              "and all others driven"
            : absl::StrCat("was the avatar made by a newer version of weft (made_by: ", about.made_by(),
                           ")?")));
  if (about.template_hash().empty()) return bad("template_hash is missing");
  if (about.board_hash().empty()) return bad("board_hash is missing");
  if (about.vertices() < 1)
    return bad(absl::StrCat("vertices is ", about.vertices(), ", expected 1 and more"));
  if (about.components() < 1)
    return bad(absl::StrCat("components is ", about.components(), ", expected 1 and more"));
  if (!(about.fps() > 0 && about.fps() <= 1000))
    return bad(absl::StrCat("fps is ", about.fps(), ", expected 0 to 1000"));
  if (about.training_frames() < 0) return bad("training_frames is negative");
  if (about.held_out_frames() < 0) return bad("held_out_frames is negative");
  return about;
}

absl::StatusOr<AvatarFile> AssembleAvatar(v1::Avatar about, AvatarBytes bytes, const std::string& folder) {
  const std::string about_path = PathInAvatar(folder, kAvatarFile),
                    space_path = PathInAvatar(folder, kAvatarSpaceFile);
  WEFT_RETURN_IF_ERROR(CheckAvatarBytes(about, bytes, folder));
  WEFT_ASSIGN_OR_RETURN(const std::vector<AvatarTable> tables, DecodeAvatarSpace(bytes.space, space_path));
  AvatarFile out;
  SparseViewAvatar& avatar = out.avatar;
  avatar.template_hash = about.template_hash();
  avatar.board_hash = about.board_hash();
  avatar.fps = about.fps();
  avatar.training_frames = about.training_frames();
  avatar.held_out_frames = about.held_out_frames();
  avatar.training.components = about.training().components();
  avatar.training.max_frames = about.training().max_frames();
  avatar.training.calibration_frames = about.training().calibration_frames();
  avatar.training.seed = about.training().seed();
  avatar.held_out_check = CheckOf(about.held_out_check());
  avatar.left_out_check = CheckOf(about.left_out_check());
  absl::Status status = TakeTables(tables, &avatar);
  if (status.ok()) status = avatar.Validate();
  if (!status.ok())
    return absl::InvalidArgumentError(absl::StrCat(space_path, ": ", std::string(status.message())));
  if (avatar.space.vertices != about.vertices() || avatar.space.components() != about.components())
    return absl::InvalidArgumentError(absl::StrCat(
        space_path, ": has ", avatar.space.components(), " components of ", avatar.space.vertices,
        " vertices, ", about_path, " says ", about.components(), " of ", about.vertices()));
  if (about.has_net()) {
    WEFT_ASSIGN_OR_RETURN(avatar.net, NetOfBytes(about.net(), std::move(bytes), folder));
  }
  out.about = std::move(about);
  return out;
}

absl::StatusOr<AvatarFile> ReadAvatar(const std::string& path, NetReading reading) {
  const std::string folder = AvatarFolderOf(path), about_path = PathInAvatar(folder, kAvatarFile);
  WEFT_ASSIGN_OR_RETURN(const std::string json, ReadAvatarJson(folder));
  WEFT_ASSIGN_OR_RETURN(v1::Avatar about, ParseAvatar(json, about_path));
  const bool has_net = about.has_net();
  WEFT_ASSIGN_OR_RETURN(AvatarBytes bytes, ReadAvatarBytes(about, folder));
  absl::StatusOr<AvatarFile> out = AssembleAvatar(std::move(about), std::move(bytes), folder);
  if (!out.ok() || !has_net || reading == NetReading::kBytesAlone) return out;
  if (absl::Status status = CheckNet(out->avatar.net); !status.ok())
    return absl::InvalidArgumentError(
        absl::StrCat(PathInAvatar(folder, kAvatarNetFile), ": ", std::string(status.message())));
  return out;
}

std::string ChecksumOfAvatar(const v1::Avatar& about) {
  if (!about.has_net()) return about.space_checksum();
  return ChecksumOfBytes(absl::StrCat(about.space_checksum(), " ", about.net().onnx_checksum(), " ",
                                      about.net().atlas_level(), " ", about.net().atlas_gutter()));
}

absl::Status WriteAvatar(const std::string& folder, v1::Avatar about, const SparseViewAvatar& avatar) {
  WEFT_RETURN_IF_ERROR(avatar.Validate());
  AvatarBytes bytes{EncodeAvatarSpace(TablesOf(avatar)), avatar.net.onnx, {}};
  Describe(avatar, about);
  if (!avatar.net.empty()) bytes.sample = EncodeNetSample(avatar.net);
  DescribeBytes(avatar.net, bytes, &about);
  return WriteAvatarFolder(folder, about, bytes);
}

absl::Status CheckAvatarFits(const v1::Avatar& avatar, const std::string& path, const Template& garment,
                             const std::string& garment_path) {
  const auto refuse = [&](const char* what, const std::string& of_avatar, const std::string& found) {
    return absl::FailedPreconditionError(absl::StrCat(
        path, ": the avatar was trained for the ", what, " with hash ", of_avatar, " (template \"",
        avatar.template_id(), "\"), but that of ", garment_path, " (template \"", garment.id, "\") has ",
        found, "; give the template that it was trained with, or train one for this"));
  };
  if (garment.board_hash != avatar.board_hash())
    return refuse("board", avatar.board_hash(), garment.board_hash);
  if (const std::string hash = garment.ContentHash(); hash != avatar.template_hash())
    return refuse("template", avatar.template_hash(), hash);
  if (static_cast<size_t>(avatar.vertices()) != garment.rest.vertices_mm.size())
    return refuse("vertices", absl::StrCat(avatar.vertices()), absl::StrCat(garment.rest.vertices_mm.size()));
  return absl::OkStatus();
}

}  // namespace weft
