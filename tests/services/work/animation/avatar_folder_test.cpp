#include "services/work/animation/avatar_folder.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cstdint>
#include <filesystem>
#include <functional>
#include <set>
#include <string>
#include <vector>

#include "capture/file/checksum.h"
#include "services/formats/files/json_file.h"
#include "services/formats/files/little_endian.h"
#include "services/work/animation/avatar_file.h"
#include "services/work/animation/net_sample.h"
#include "tests/animation/recorded.h"
#include "tests/animation/shift_net.h"
#include "tests/capture/temp_folder.h"
#include "tests/services/work/animation/small_avatar.h"

namespace weft {
namespace {

std::string WordsOf(const absl::Status& status) { return std::string(status.message()); }

v1::Avatar AboutShirt() {
  v1::Avatar about;
  about.set_template_id("shirt");
  v1::AvatarSource& source = *about.add_sources();
  source.set_name("walk");
  source.set_frames(40);
  return about;
}

// An avatar with a net.
class StoredAvatar : public testing::Test {
 protected:
  void SetUp() override {
    avatar_.net = ShiftNet();
    avatar_.net.atlas.gutter = 5;
    avatar_.net.gain[1] = {40, 3.5, 3.25};
    ASSERT_TRUE(WriteAvatar(path_, AboutShirt(), avatar_).ok());
  }

  TempFolder folder_;
  const std::string path_ = folder_ / "shirt.avatar";
  SparseViewAvatar avatar_ = SmallAvatar();
};

// All that avatar.json tells, of the avatar and of the files beside.
TEST_F(StoredAvatar, TellsOfItselfAndItsFiles) {
  v1::Avatar about = ReadAvatar(path_)->about;
  EXPECT_THAT(about.made_by(), testing::StartsWith("weft "));
  about.clear_made_by();
  ExpectRecorded(*ToJson(about));
}

TEST_F(StoredAvatar, ComesBackWhole) {
  avatar_.training = {2, 333, 44, 5};
  avatar_.left_out_check = {7, 0.5, 0.875};
  avatar_.net.gain[3] = {9, 2.5, 2.25};
  avatar_.net.atlas.level = 2;
  ASSERT_TRUE(WriteAvatar(path_, AboutShirt(), avatar_).ok());
  const auto read = ReadAvatar(path_);
  ASSERT_TRUE(read.ok()) << read.status();
  const std::string again = folder_ / "again.avatar";
  ASSERT_TRUE(WriteAvatar(again + "/", AboutShirt(), read->avatar).ok());
  for (const char* file : {"/avatar.json", "/space.bin", "/net.onnx", "/sample.bin"})
    EXPECT_EQ(ReadBytes(again + file), ReadBytes(path_ + file)) << file;
}

TEST_F(StoredAvatar, ItsChecksumIsOfAllThatDrives) {
  const v1::Avatar about = ReadAvatar(path_)->about;
  std::set<std::string> checksums = {ChecksumOfAvatar(about)};
  for (const int field : {0, 1, 2, 3}) {
    v1::Avatar other = about;
    if (field == 0) other.set_space_checksum("0");
    if (field == 1) other.mutable_net()->set_onnx_checksum("0");
    if (field == 2) other.mutable_net()->set_atlas_level(6);
    if (field == 3) other.mutable_net()->set_atlas_gutter(6);
    checksums.insert(ChecksumOfAvatar(other));
  }
  EXPECT_EQ(checksums.size(), 5u);
}

TEST_F(StoredAvatar, WhatIsToldOfItMustBePossible) {
  const v1::Avatar about = ReadAvatar(path_)->about;
  const auto why_not = [&](const std::function<void(v1::AvatarNet&)>& change) {
    v1::Avatar other = about;
    change(*other.mutable_net());
    const AvatarBytes bytes{ReadBytes(path_ + "/space.bin"), avatar_.net.onnx, EncodeNetSample(avatar_.net)};
    return WordsOf(AssembleAvatar(other, bytes, "x").status());
  };
  EXPECT_EQ(why_not([](v1::AvatarNet&) {}), "");
  EXPECT_EQ(why_not([](v1::AvatarNet& net) { net.set_atlas_level(7); }),
            "x/avatar.json: net: atlas: level must be 0 to 6");
  EXPECT_EQ(why_not([](v1::AvatarNet& net) { net.mutable_gain(0)->set_cameras(4); }), "");
  for (const int cameras : {0, 5})
    EXPECT_EQ(why_not([&](v1::AvatarNet& net) { net.mutable_gain(0)->set_cameras(cameras); }),
              "x/avatar.json: net.gain: cameras is " + std::to_string(cameras) + ", expected 1 to 4");
  EXPECT_THAT(why_not([](v1::AvatarNet& net) { net.set_onnx_bytes(1); }),
              testing::StartsWith("x/net.onnx: has " + std::to_string(avatar_.net.onnx.size()) +
                                  " bytes and checksum " + about.net().onnx_checksum() +
                                  ", x/avatar.json says 1 and " + about.net().onnx_checksum() +
                                  "; the files are damaged or of two avatars, "));
  v1::Avatar other = about;
  other.set_components(3);
  const AvatarBytes bytes{ReadBytes(path_ + "/space.bin"), avatar_.net.onnx, EncodeNetSample(avatar_.net)};
  EXPECT_EQ(WordsOf(AssembleAvatar(other, bytes, "x").status()),
            "x/space.bin: has 2 components of 4 vertices, x/avatar.json says 3 of 4");
  other.set_components(2), other.set_vertices(5);
  EXPECT_EQ(WordsOf(AssembleAvatar(other, bytes, "x").status()),
            "x/space.bin: has 2 components of 4 vertices, x/avatar.json says 2 of 5");
  // The library that runs nets is not needed to see that this is none.
  other = about;
  const AvatarBytes none{bytes.space, "no net", bytes.sample};
  other.mutable_net()->set_onnx_bytes(6), other.mutable_net()->set_onnx_checksum(ChecksumOfBytes("no net"));
  EXPECT_THAT(WordsOf(AssembleAvatar(other, none, "x").status()),
              testing::StartsWith("x/net.onnx: is no net that can be read: "));
}

TEST_F(StoredAvatar, FilesThatAreTooLarge) {
  std::filesystem::resize_file(path_ + "/space.bin", (uint64_t{1} << 30) + 1);
  EXPECT_EQ(WordsOf(ReadAvatar(path_).status()),
            path_ + "/space.bin: has 1073741825 bytes, more than the 1073741824 that such a file may have");
  SetUp();
  const v1::Avatar about = ReadAvatar(path_)->about;
  for (const char* file : {"/net.onnx", "/sample.bin"}) {
    std::filesystem::resize_file(path_ + file, (uint64_t{1} << 28) + 1);
    EXPECT_EQ(WordsOf(ReadAvatarBytes(about, path_).status()),
              path_ + file + ": has 268435457 bytes, more than the 268435456 that such a file may have");
    SetUp();
  }
}

TEST(AvatarPlace, IsFreeEmptyOrOfAnAvatar) {
  const TempFolder folder;
  EXPECT_TRUE(CheckAvatarPlace(folder / "new.avatar").ok());
  std::filesystem::create_directory(folder / "empty");
  EXPECT_TRUE(CheckAvatarPlace(folder / "empty").ok());
  WriteBytes(folder / "old/avatar.json", "{}");
  WriteBytes(folder / "old/notes.txt", "mine");
  EXPECT_TRUE(CheckAvatarPlace(folder / "old").ok());
  WriteBytes(folder / "file", "x");
  std::filesystem::create_symlink(folder / "nowhere", folder / "link");
  WriteBytes(folder / "other/notes.txt", "x");
  for (const char* name : {"file", "link", "other"})
    EXPECT_EQ(CheckAvatarPlace(folder / name).message(),
              folder / name + ": is there and is no avatar; choose another name, or remove it");
  EXPECT_EQ(AvatarFolderOf("a/x.avatar/avatar.json"), "a/x.avatar");
  EXPECT_EQ(AvatarFolderOf("a/x.avatar"), "a/x.avatar");
  EXPECT_EQ(
      ReadAvatarJson(folder / "other").status().message(),
      folder / "other/avatar.json" + ": is missing, so this is no avatar; `weft avatar train` makes one");
}

TEST(AvatarSpace, TablesMayBeEmptyAndOfBothPrecisions) {
  const std::vector<AvatarTable> tables = {{"zeros", 2, 2, true, {0, 0, 0, 0}},
                                           {"plain", 1, 3, false, {1.5f, -2, 1e-20f}},
                                           {"none", 0, 5, true, {}},
                                           {"", 0, 0, false, {}}};
  const auto read = DecodeAvatarSpace(EncodeAvatarSpace(tables), "space.bin");
  ASSERT_TRUE(read.ok()) << read.status();
  ASSERT_EQ(read->size(), 4u);
  for (size_t k = 0; k < 4; ++k) {
    EXPECT_EQ((*read)[k].name, tables[k].name);
    EXPECT_EQ((*read)[k].rows, tables[k].rows);
    EXPECT_EQ((*read)[k].columns, tables[k].columns);
    EXPECT_EQ((*read)[k].sixteen_bits, tables[k].sixteen_bits);
    EXPECT_EQ((*read)[k].values, tables[k].values);
  }
  const std::string empty = EncodeAvatarSpace({});
  EXPECT_EQ(empty.size(), 20u);
  EXPECT_TRUE(DecodeAvatarSpace(empty, "s")->empty());
  EXPECT_EQ(WordsOf(DecodeAvatarSpace(empty.substr(0, 19), "s").status()),
            "s: ends within its head; was the file truncated?");
  EXPECT_EQ(WordsOf(DecodeAvatarSpace("x" + empty, "s").status()),
            "s: holds no shapes of an avatar; it does not begin with weftspc1");
  std::string damaged = empty;
  damaged[9] ^= 1;
  EXPECT_EQ(DecodeAvatarSpace(damaged, "s").status(),
            absl::DataLossError(
                "s: does not match its checksum; the file is damaged, copy or train the avatar again"));
}

// One table "t" of these sizes, with as many bytes of numbers, and the checksum that it needs.
std::string SpaceOf(uint32_t rows, uint32_t columns, uint8_t bits, size_t bytes) {
  std::string out = "weftspc1";
  PutLittleEndian(uint32_t{1}, out);
  PutLittleEndian(uint8_t{1}, out);
  out += 't';
  PutLittleEndian(rows, out);
  PutLittleEndian(columns, out);
  PutLittleEndian(bits, out);
  out.append(bytes, '\0');
  PutLittleEndian(Checksum(out.data(), out.size()), out);
  return out;
}

TEST(AvatarSpace, SizesOfStrangersAreChecked) {
  const std::string within = "s: ends within table 0 of 1; was it written by a program of yours?";
  const auto why_not = [](uint32_t rows, uint32_t columns, uint8_t bits, size_t bytes) {
    return WordsOf(DecodeAvatarSpace(SpaceOf(rows, columns, bits, bytes), "s").status());
  };
  EXPECT_EQ(why_not(1, 1, 32, 4), "");
  EXPECT_EQ(why_not(1, 2, 16, 8), "");
  EXPECT_EQ(why_not(3, 2, 16, 24), "");
  EXPECT_EQ(why_not(1, 2, 16, 7), within);
  EXPECT_EQ(why_not(2, 2, 32, 15), within);
  EXPECT_EQ(why_not(1, 2, 16, 9), "s: has 1 bytes beyond its tables");
  EXPECT_EQ(why_not(1, 1, 8, 4), within);
  EXPECT_EQ(why_not(1, 1, 33, 4), within);
  EXPECT_EQ(why_not(1, 0, 32, 0), within);
  EXPECT_EQ(why_not(0, 1, 32, 0), "");
  EXPECT_EQ(why_not(0, INT32_MAX, 32, 0), "");
  EXPECT_EQ(why_not(0, uint32_t{INT32_MAX} + 1, 32, 0), within);
  EXPECT_EQ(why_not(uint32_t{INT32_MAX} + 1, 0, 32, 0), within);
  EXPECT_EQ(why_not(UINT32_MAX, UINT32_MAX, 16, 8), within);
}

TEST(ParseAvatar, EveryFieldHasItsLimits) {
  // A good avatar with these fields.
  const auto with = [](const std::string& fields) {
    v1::Avatar about, change;
    about.set_kind("sparse-view"), about.set_template_hash("a"), about.set_board_hash("b");
    about.set_vertices(1), about.set_components(1), about.set_fps(1000);
    EXPECT_TRUE(ParseJson("{" + fields + "}", "change", change).ok());
    about.MergeFrom(change);
    return about;
  };
  const auto of = [](const v1::Avatar& about) {
    return WordsOf(ParseAvatar(*ToJson(about), "a.json").status());
  };
  v1::Avatar about = with("");
  EXPECT_EQ(of(about), "");
  EXPECT_EQ(of(with("\"fps\": 1000.5")), "a.json: fps is 1000.5, expected 0 to 1000");
  about.set_fps(0);
  EXPECT_EQ(of(about), "a.json: fps is 0, expected 0 to 1000");
  about = with("");
  about.set_vertices(0);
  EXPECT_EQ(of(about), "a.json: vertices is 0, expected 1 and more");
  about = with("");
  about.set_components(0);
  EXPECT_EQ(of(about), "a.json: components is 0, expected 1 and more");
  EXPECT_EQ(of(with("\"training_frames\": -1")), "a.json: training_frames is negative");
  EXPECT_EQ(of(with("\"held_out_frames\": -1")), "a.json: held_out_frames is negative");
  about = with("");
  about.clear_template_hash();
  EXPECT_EQ(of(about), "a.json: template_hash is missing");
  about = with("");
  about.clear_board_hash();
  EXPECT_EQ(of(about), "a.json: board_hash is missing");
  EXPECT_EQ(of(with("\"kind\": \"paper\"")),
            "a.json: kind is \"paper\", expected \"sparse-view\"; avatars of the preset paper are compared "
            "with, by `weft evaluate --baseline`, and all others driven");
  EXPECT_EQ(of(with("\"kind\": \"wool\", \"made_by\": \"weft 99\"")),
            "a.json: kind is \"wool\", expected \"sparse-view\"; was the avatar made by a newer version of "
            "weft (made_by: weft 99)?");
}

TEST(AvatarFits, NamesWhatDiffers) {
  Template garment;
  garment.id = "skirt";
  garment.board_hash = "b";
  garment.rest.vertices_mm.resize(4);
  garment.node_of_vertex.resize(4);
  v1::Avatar about = AboutShirt();
  about.set_board_hash("b"), about.set_template_hash(garment.ContentHash()), about.set_vertices(4);
  EXPECT_TRUE(CheckAvatarFits(about, "a", garment, "g").ok());
  about.set_vertices(5);
  EXPECT_EQ(WordsOf(CheckAvatarFits(about, "a", garment, "g")),
            "a: the avatar was trained for the vertices with hash 5 (template \"shirt\"), but that of g "
            "(template \"skirt\") has 4; give the template that it was trained with, or train one for this");
}

}  // namespace
}  // namespace weft
