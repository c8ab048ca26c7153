#include <algorithm>

#include "animation/paper/pixel_avatar.h"
#include "capture/file/checksum.h"
#include "services/formats/files/little_endian.h"
#include "services/work/animation/avatar_file.h"
#include "services/work/animation/driver_memory.h"
#include "services/work/animation/net_sample.h"
#include "tests/animation/shift_net.h"
#include "tests/fuzz/fuzz_target.h"
#include "tests/services/work/animation/small_avatar.h"

namespace {

// The bytes with another checksum at their end: the right one.
std::string WithChecksum(std::string_view bytes) {
  std::string out(bytes.substr(0, bytes.size() - std::min(bytes.size(), sizeof(uint64_t))));
  weft::PutLittleEndian(weft::Checksum(out.data(), out.size()), out);
  return out;
}

}  // namespace

// avatar.json, space.bin, sample.bin, or what a driver knew.
extern "C" int LLVMFuzzerTestOneInput(const uint8_t* data, size_t size) {
  const std::string_view bytes(reinterpret_cast<const char*>(data), size);
  const auto about = weft::ParseAvatar(bytes, "avatar.json");
  if (about.ok()) weft::FuzzRequire(about->vertices() > 0 && !about->template_hash().empty());
  if (const auto memory = weft::DecodeMemory(bytes); memory.ok())
    weft::FuzzRequire(weft::EncodeMemory(*memory) == bytes);
  weft::AvatarNet net;
  if (weft::DecodeNetSample(bytes, "sample.bin", &net).ok())
    weft::FuzzRequire(weft::EncodeNetSample(net) == bytes);
  // As if the checksum were right, which mutations hardly ever meet.
  for (const std::string& whole : {std::string(bytes), WithChecksum(bytes)}) {
    const auto tables = weft::DecodeAvatarSpace(whole, "space.bin");
    if (!tables.ok()) continue;
    for (const weft::AvatarTable& table : *tables)
      weft::FuzzRequire(table.values.size() == size_t{1} * table.rows * table.columns);
    weft::PixelAvatar of_pixels;
    of_pixels.net.onnx = "x";
    if (weft::TakeTables(*tables, &of_pixels).ok() && of_pixels.Validate().ok())
      weft::FuzzRequire(
          of_pixels.prior.Decode(Eigen::VectorXd::Ones(of_pixels.prior.latents()), nullptr).cols() ==
          of_pixels.prior.nodes());
    weft::SparseViewAvatar avatar = weft::SmallAvatar();
    if (!weft::TakeTables(*tables, &avatar).ok() || !avatar.Validate().ok()) continue;
    const auto again = weft::DecodeAvatarSpace(weft::EncodeAvatarSpace(weft::TablesOf(avatar)), "again");
    weft::FuzzRequire(again.ok(), again.ok() ? "" : std::string(again.status().message()));
  }
  return 0;
}

std::vector<std::string> weft::FuzzSeeds() {
  DriverMemory memory;
  memory.last_ns = 33'333'333;
  const std::string lost = EncodeMemory(memory);
  memory.drive.track.known = 2;
  memory.drive.track.state.z = memory.drive.track.z_before = Eigen::VectorXd::LinSpaced(3, 0, 1);
  memory.drive.track.state.local = Eigen::MatrixXd::Ones(2, 2);
  AvatarNet small;
  small.sample = {1, 2, 2, {1, 2, 3, 4}};
  small.sample_answer = {2, 1, 1, {5, 6}};
  PixelAvatar of_pixels;
  of_pixels.graph.nodes = 3;
  of_pixels.prior.unit.assign(12, 1);
  of_pixels.prior.layers = {{1, 2, {1, 2}, {3, 4}},
                            {2, 12, std::vector<float>(24, 1), std::vector<float>(12, 0)}};
  return {
      EncodeAvatarSpace(TablesOf(of_pixels)),
      EncodeNetSample(small),
      EncodeNetSample(ShiftNet()),
      lost,
      EncodeMemory(memory),
      EncodeAvatarSpace(TablesOf(SmallAvatar())),
      EncodeAvatarSpace(TablesOf(SmallAvatar(1))),
      EncodeAvatarSpace({{"x", 1, 2, true, {3, 4}}, {"", 2, 1, false, {5, 6}}}),
      R"({"kind": "sparse-view", "template_hash": "a", "board_hash": "b", "vertices": 4, "components": 2, "fps": 30,
"sources": [{"name": "walk", "frames": 9, "held_out": true}], "sigma": [{"of_rays": [1, 2]}], "space_bytes": "17"})",
      R"({"kind": "sparse-view", "template_hash": "a", "board_hash": "b", "vertices": 4, "components": 2, "fps": 30,
"net": {"atlas_level": 1, "onnx_bytes": "9", "onnx_checksum": "00ff", "training": {"seed": "1", "steps": "50"},
"gain": [{"cameras": 2, "frames": 40, "before_mm": 3.5, "after_mm": 3}]}})"};
}
