#include "services/animation/avatar_file.h"

#include <fcntl.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cmath>
#include <cstdint>
#include <cstdio>
#include <filesystem>
#include <utility>

#include "absl/strings/str_cat.h"
#include "absl/strings/str_format.h"
#include "animation/net_correction.h"
#include "capture/file/checksum.h"
#include "services/animation/net_sample.h"
#include "services/files/atomic_file.h"
#include "services/files/json_file.h"
#include "services/files/little_endian.h"
#include "services/files/unique_fd.h"

namespace weft {
namespace {

namespace fs = std::filesystem;

constexpr std::string_view kSpaceMagic = "weftspc1";
constexpr uint64_t kMaxSpaceBytes = uint64_t{1} << 30, kMaxNetBytes = uint64_t{1} << 28;
constexpr size_t kTableHeadBytes = 1 + 4 + 4 + 1;  // with an empty name
constexpr float kSteps = 32767;

std::string PathIn(const std::string& folder, const char* file) { return (fs::path(folder) / file).string(); }

std::string ChecksumOf(std::string_view bytes) {
  return absl::StrFormat("%016x", Checksum(bytes.data(), bytes.size()));
}

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

void Describe(const AvatarNet& net, const AvatarBytes& bytes, v1::AvatarNet& about) {
  about.set_atlas_level(net.atlas.level);
  about.set_atlas_gutter(net.atlas.gutter);
  about.set_onnx_bytes(static_cast<int64_t>(bytes.net.size()));
  about.set_onnx_checksum(ChecksumOf(bytes.net));
  about.set_sample_bytes(static_cast<int64_t>(bytes.sample.size()));
  about.set_sample_checksum(ChecksumOf(bytes.sample));
  about.clear_gain();
  for (size_t k = 0; k < net.gain.size(); ++k) {
    if (net.gain[k].frames == 0) continue;
    v1::AvatarNetGain& gain = *about.add_gain();
    gain.set_cameras(static_cast<int>(k) + 1);
    gain.set_frames(net.gain[k].frames);
    gain.set_before_mm(net.gain[k].before_mm);
    gain.set_after_mm(net.gain[k].after_mm);
  }
}

// Atlas, sample and gain; the bytes of the net are those of its file.
absl::StatusOr<AvatarNet> NetOf(const v1::AvatarNet& about, AvatarBytes bytes, const std::string& folder) {
  AvatarNet out;
  out.atlas.level = about.atlas_level(), out.atlas.gutter = about.atlas_gutter();
  if (absl::Status status = out.atlas.Validate(); !status.ok())
    return absl::InvalidArgumentError(
        absl::StrCat(PathIn(folder, kAvatarFile), ": net: ", std::string(status.message())));
  for (const v1::AvatarNetGain& gain : about.gain()) {
    if (gain.cameras() < 1 || gain.cameras() > SigmaScale::kCameras)
      return absl::InvalidArgumentError(absl::StrCat(PathIn(folder, kAvatarFile), ": net.gain: cameras is ",
                                                     gain.cameras(), ", expected 1 to ",
                                                     SigmaScale::kCameras));
    out.gain[static_cast<size_t>(gain.cameras() - 1)] = {gain.frames(), gain.before_mm(), gain.after_mm()};
  }
  if (absl::Status status = DecodeNetSample(bytes.sample, PathIn(folder, kAvatarSampleFile), &out);
      !status.ok())
    return status;
  out.onnx = std::move(bytes.net);
  return out;
}

// A file of an avatar must be the one that avatar.json tells of.
absl::Status CheckFile(const std::string& folder, const char* file, std::string_view bytes,
                       int64_t told_bytes, const std::string& told_checksum) {
  if (static_cast<int64_t>(bytes.size()) == told_bytes && ChecksumOf(bytes) == told_checksum)
    return absl::OkStatus();
  return absl::DataLossError(
      absl::StrCat(PathIn(folder, file), ": has ", bytes.size(), " bytes and checksum ", ChecksumOf(bytes),
                   ", ", PathIn(folder, kAvatarFile), " says ", told_bytes, " and ", told_checksum,
                   "; the files are damaged or of two avatars, copy or train the avatar again"));
}

absl::Status ReadInto(const std::string& folder, const char* file, uint64_t most, std::string* out) {
  absl::StatusOr<std::string> bytes = ReadWholeFile(PathIn(folder, file), most);
  if (bytes.ok()) *out = *std::move(bytes);
  return bytes.status();
}

absl::Status RemoveFolder(const fs::path& folder) {
  std::error_code error;
  fs::remove_all(folder, error);
  if (!error) return absl::OkStatus();
  return absl::UnavailableError(absl::StrCat(folder.string(), ": cannot be removed (", error.message(), ")"));
}

absl::Status FlushFolder(const fs::path& folder) {
  const UniqueFd fd(open(folder.c_str(), O_RDONLY | O_DIRECTORY | O_CLOEXEC));
  if (fd.get() < 0) return WriteError(folder.string(), errno);
  return SyncFolder(fd.get(), folder.string());
}

// Puts `from` where `to` stands or nothing does; the folder that stood there is then at `from`.
absl::Status PutInPlace(const fs::path& from, const fs::path& to) {
  std::error_code error;
  const unsigned flags = fs::exists(to, error) ? RENAME_EXCHANGE : RENAME_NOREPLACE;
  if (renameat2(AT_FDCWD, from.c_str(), AT_FDCWD, to.c_str(), flags) == 0) return absl::OkStatus();
  if (errno != EINVAL && errno != ENOSYS) return WriteError(to.string(), errno);
  // File systems without that exchange: for a moment nothing stands there.
  if (absl::Status status = RemoveFolder(to); !status.ok()) return status;
  return rename(from.c_str(), to.c_str()) == 0 ? absl::OkStatus() : WriteError(to.string(), errno);
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

absl::StatusOr<v1::Avatar> ParseAvatar(std::string_view json, const std::string& source_name) {
  v1::Avatar about;
  if (absl::Status status = ParseJson(json, source_name, about); !status.ok()) return status;
  const auto bad = [&](const std::string& what) {
    return absl::InvalidArgumentError(absl::StrCat(source_name, ": ", what));
  };
  if (about.kind() != kSparseViewKind)
    return bad(absl::StrCat("kind is \"", about.kind(), "\", this version of weft knows ", kSparseViewKind,
                            "; was the avatar made by a newer one (made_by: ", about.made_by(), ")?"));
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
  const std::string about_path = PathIn(folder, kAvatarFile), space_path = PathIn(folder, kAvatarSpaceFile);
  const v1::AvatarNet& net = about.net();
  absl::Status status =
      CheckFile(folder, kAvatarSpaceFile, bytes.space, about.space_bytes(), about.space_checksum());
  if (about.has_net()) {
    status.Update(CheckFile(folder, kAvatarNetFile, bytes.net, net.onnx_bytes(), net.onnx_checksum()));
    status.Update(
        CheckFile(folder, kAvatarSampleFile, bytes.sample, net.sample_bytes(), net.sample_checksum()));
  }
  if (!status.ok()) return status;
  const absl::StatusOr<std::vector<AvatarTable>> tables = DecodeAvatarSpace(bytes.space, space_path);
  if (!tables.ok()) return tables.status();
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
  status = TakeTables(*tables, &avatar);
  if (status.ok()) status = avatar.Validate();
  if (!status.ok())
    return absl::InvalidArgumentError(absl::StrCat(space_path, ": ", std::string(status.message())));
  if (avatar.space.vertices != about.vertices() || avatar.space.components() != about.components())
    return absl::InvalidArgumentError(absl::StrCat(
        space_path, ": has ", avatar.space.components(), " components of ", avatar.space.vertices,
        " vertices, ", about_path, " says ", about.components(), " of ", about.vertices()));
  if (about.has_net()) {
    absl::StatusOr<AvatarNet> read = NetOf(about.net(), std::move(bytes), folder);
    if (!read.ok()) return read.status();
    avatar.net = *std::move(read);
  }
  out.about = std::move(about);
  return out;
}

absl::StatusOr<AvatarFile> ReadAvatar(const std::string& path, NetReading reading) {
  const fs::path given(path);
  const std::string folder = given.filename() == kAvatarFile ? given.parent_path().string() : path;
  const std::string about_path = PathIn(folder, kAvatarFile);
  const absl::StatusOr<std::string> json = ReadWholeFile(about_path, kMaxJsonBytes);
  if (absl::IsNotFound(json.status()))
    return absl::NotFoundError(
        absl::StrCat(about_path, ": is missing, so this is no avatar; `weft avatar train` makes one"));
  if (!json.ok()) return json.status();
  absl::StatusOr<v1::Avatar> about = ParseAvatar(*json, about_path);
  if (!about.ok()) return about.status();
  const bool has_net = about->has_net();
  AvatarBytes bytes;
  absl::Status status = ReadInto(folder, kAvatarSpaceFile, kMaxSpaceBytes, &bytes.space);
  if (has_net) {
    status.Update(ReadInto(folder, kAvatarNetFile, kMaxNetBytes, &bytes.net));
    status.Update(ReadInto(folder, kAvatarSampleFile, kMaxNetBytes, &bytes.sample));
  } else {
    for (const char* file : {kAvatarNetFile, kAvatarSampleFile})
      if (std::error_code error; fs::exists(PathIn(folder, file), error))
        status.Update(absl::DataLossError(
            absl::StrCat(PathIn(folder, file), ": is there, and ", about_path,
                         " tells of no net; the files are of two avatars, copy the avatar again")));
  }
  if (!status.ok()) return status;
  absl::StatusOr<AvatarFile> out = AssembleAvatar(*std::move(about), std::move(bytes), folder);
  if (!out.ok() || !has_net || reading == NetReading::kBytesAlone) return out;
  if (status = CheckNet(out->avatar.net); !status.ok())
    return absl::InvalidArgumentError(
        absl::StrCat(PathIn(folder, kAvatarNetFile), ": ", std::string(status.message())));
  return out;
}

std::string ChecksumOfAvatar(const v1::Avatar& about) {
  if (!about.has_net()) return about.space_checksum();
  return ChecksumOf(absl::StrCat(about.space_checksum(), " ", about.net().onnx_checksum(), " ",
                                 about.net().atlas_level(), " ", about.net().atlas_gutter()));
}

absl::Status CheckAvatarPlace(const std::string& folder) {
  std::error_code error;
  if (!fs::exists(fs::symlink_status(folder, error))) return absl::OkStatus();
  if (fs::is_directory(folder, error) &&
      (fs::exists(PathIn(folder, kAvatarFile), error) || fs::is_empty(folder, error)))
    return absl::OkStatus();
  return absl::AlreadyExistsError(
      absl::StrCat(folder, ": is there and is no avatar; choose another name, or remove it"));
}

absl::Status WriteAvatar(const std::string& folder, v1::Avatar about, const SparseViewAvatar& avatar) {
  if (absl::Status status = avatar.Validate(); !status.ok()) return status;
  fs::path place = fs::path(folder).lexically_normal();
  if (!place.has_filename()) place = place.parent_path();
  if (absl::Status status = CheckAvatarPlace(place.string()); !status.ok()) return status;
  const fs::path parent = place.has_parent_path() ? place.parent_path() : fs::path(".");
  const fs::path draft = absl::StrCat(place.string(), ".tmp.", getpid());
  AvatarBytes bytes{EncodeAvatarSpace(TablesOf(avatar)), avatar.net.onnx, {}};
  Describe(avatar, about);
  about.set_space_bytes(static_cast<int64_t>(bytes.space.size()));
  about.set_space_checksum(ChecksumOf(bytes.space));
  if (avatar.net.empty()) {
    about.clear_net();
  } else {
    bytes.sample = EncodeNetSample(avatar.net);
    Describe(avatar.net, bytes, *about.mutable_net());
  }
  absl::Status status = CreateFolders(draft.string());
  if (status.ok()) status = WriteFileAtomically(PathIn(draft.string(), kAvatarSpaceFile), bytes.space);
  if (status.ok() && !avatar.net.empty()) {
    status = WriteFileAtomically(PathIn(draft.string(), kAvatarNetFile), bytes.net);
    status.Update(WriteFileAtomically(PathIn(draft.string(), kAvatarSampleFile), bytes.sample));
  }
  if (status.ok()) status = WriteJsonFile(PathIn(draft.string(), kAvatarFile), about);
  if (status.ok()) status = PutInPlace(draft, place);
  if (status.ok()) status = FlushFolder(parent);
  status.Update(RemoveFolder(draft));
  return status;
}

absl::Status CheckAvatarFits(const AvatarFile& avatar, const std::string& path, const Template& garment,
                             const std::string& garment_path) {
  const auto refuse = [&](const char* what, const std::string& of_avatar, const std::string& found) {
    return absl::FailedPreconditionError(absl::StrCat(
        path, ": the avatar was trained for the ", what, " with hash ", of_avatar, " (template \"",
        avatar.about.template_id(), "\"), but that of ", garment_path, " (template \"", garment.id,
        "\") has ", found, "; give the template that it was trained with, or train one for this"));
  };
  if (garment.board_hash != avatar.avatar.board_hash)
    return refuse("board", avatar.avatar.board_hash, garment.board_hash);
  if (const std::string hash = garment.ContentHash(); hash != avatar.avatar.template_hash)
    return refuse("template", avatar.avatar.template_hash, hash);
  return avatar.avatar.CheckFits(garment);
}

}  // namespace weft
