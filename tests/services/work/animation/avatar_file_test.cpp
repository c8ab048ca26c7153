#include "services/work/animation/avatar_file.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <filesystem>
#include <fstream>

#include "services/formats/files/atomic_file.h"
#include "services/work/animation/net_sample.h"
#include "tests/animation/shift_net.h"
#include "tests/capture/temp_folder.h"
#include "tests/services/work/animation/small_avatar.h"

namespace weft {
namespace {

using testing::AllOf;
using testing::HasSubstr;

std::string Message(const absl::Status& status) { return std::string(status.message()); }

v1::Avatar About() {
  v1::Avatar about;
  about.set_template_id("shirt");
  v1::AvatarSource& source = *about.add_sources();
  source.set_name("walk");
  source.set_frames(40);
  return about;
}

std::string Bytes(const std::string& path) { return ReadWholeFile(path).value_or("unreadable"); }

TEST(AvatarFile, KeepsTheAvatar) {
  const TempFolder folder;
  const std::string path = folder / "shirt.avatar";
  const SparseViewAvatar avatar = SmallAvatar();
  ASSERT_TRUE(avatar.Validate().ok()) << avatar.Validate();
  ASSERT_TRUE(WriteAvatar(path, About(), avatar).ok());
  for (const std::string& name : {path, path + "/", path + "/avatar.json"}) {
    const absl::StatusOr<AvatarFile> read = ReadAvatar(name);
    ASSERT_TRUE(read.ok()) << read.status();
    EXPECT_EQ(read->about.template_id(), "shirt");
    EXPECT_EQ(read->about.sources(0).frames(), 40);
    EXPECT_EQ(read->avatar.template_hash, avatar.template_hash);
    EXPECT_EQ(read->avatar.board_hash, avatar.board_hash);
    EXPECT_EQ(read->avatar.fps, 25);
    EXPECT_EQ(read->avatar.training_frames, 40);
    EXPECT_EQ(read->avatar.space.mean_mm, avatar.space.mean_mm);
    EXPECT_EQ(read->avatar.space.sigma_mm, avatar.space.sigma_mm);
    EXPECT_EQ(read->avatar.acceleration, avatar.acceleration);
    EXPECT_EQ(read->avatar.edge_mm, avatar.edge_mm);
    EXPECT_EQ(read->avatar.sigma.of[2][1], 1.5f);
    EXPECT_EQ(read->avatar.held_out_check.frames, 12);
    EXPECT_EQ(read->avatar.held_out_check.within_two, 0.9375);
    EXPECT_EQ(read->avatar.left_out_check.frames, 0);
    ASSERT_EQ(read->avatar.space.basis.size(), avatar.space.basis.size());
    for (size_t k = 0; k < avatar.space.basis.size(); ++k)
      EXPECT_NEAR(read->avatar.space.basis[k], avatar.space.basis[k], 0.5 / 32767);
  }
  // Nothing else is left beside it.
  EXPECT_EQ(std::distance(std::filesystem::directory_iterator(folder.path()), {}), 1);
}

TEST(AvatarFile, IsReplacedWholeByTheSameBytes) {
  const TempFolder folder;
  const std::string path = folder / "shirt.avatar";
  ASSERT_TRUE(WriteAvatar(path, About(), SmallAvatar(7)).ok());
  ASSERT_TRUE(WriteAvatar(path, About(), SmallAvatar()).ok());
  const std::string json = Bytes(path + "/avatar.json"), space = Bytes(path + "/space.bin");
  ASSERT_TRUE(WriteAvatar(path, About(), SmallAvatar()).ok());
  EXPECT_EQ(Bytes(path + "/avatar.json"), json);
  EXPECT_EQ(Bytes(path + "/space.bin"), space);
  EXPECT_EQ(ReadAvatar(path)->avatar.space.vertices, 4);
}

TEST(AvatarFile, DoesNotReplaceWhatIsNoAvatar) {
  const TempFolder folder;
  std::ofstream(folder / "notes.txt") << "mine";
  const absl::Status status = WriteAvatar(folder.path(), About(), SmallAvatar());
  EXPECT_EQ(status.code(), absl::StatusCode::kAlreadyExists);
  EXPECT_THAT(Message(status), HasSubstr("is no avatar"));
  EXPECT_TRUE(std::filesystem::exists(folder / "notes.txt"));
}

class BrokenAvatar : public testing::Test {
 protected:
  void SetUp() override { ASSERT_TRUE(WriteAvatar(path_, About(), SmallAvatar()).ok()); }

  void Replace(const std::string& file, const std::string& was, const std::string& is) {
    std::string bytes = Bytes(path_ + "/" + file);
    const size_t at = bytes.find(was);
    ASSERT_NE(at, std::string::npos) << was;
    bytes.replace(at, was.size(), is);
    std::ofstream(path_ + "/" + file, std::ios::binary) << bytes;
  }
  std::string WhyNot() { return Message(ReadAvatar(path_).status()); }

  TempFolder folder_;
  const std::string path_ = folder_ / "shirt.avatar";
};

TEST_F(BrokenAvatar, NoFolder) {
  const absl::Status status = ReadAvatar(folder_ / "none.avatar").status();
  EXPECT_EQ(status.code(), absl::StatusCode::kNotFound);
  EXPECT_THAT(Message(status), AllOf(HasSubstr("none.avatar/avatar.json"), HasSubstr("weft avatar train")));
}

TEST_F(BrokenAvatar, OtherKind) {
  Replace("avatar.json", "sparse-view", "detail-view");
  EXPECT_THAT(WhyNot(), AllOf(HasSubstr("avatar.json: kind is \"detail-view\""), HasSubstr("newer")));
}

TEST_F(BrokenAvatar, UnknownField) {
  Replace("avatar.json", "\"template_id\"", "\"tempalte_id\"");
  EXPECT_THAT(WhyNot(), AllOf(HasSubstr("avatar.json"), HasSubstr("tempalte_id")));
}

TEST_F(BrokenAvatar, FieldsOutOfTheirLimits) {
  Replace("avatar.json", "\"fps\": 25", "\"fps\": -5");
  EXPECT_THAT(WhyNot(), HasSubstr("avatar.json: fps is -5"));
}

TEST_F(BrokenAvatar, ChangedNumbers) {
  std::string bytes = Bytes(path_ + "/space.bin");
  bytes[bytes.size() / 2] = static_cast<char>(bytes[bytes.size() / 2] ^ 1);
  std::ofstream(path_ + "/space.bin", std::ios::binary) << bytes;
  EXPECT_EQ(ReadAvatar(path_).status().code(), absl::StatusCode::kDataLoss);
  EXPECT_THAT(WhyNot(), AllOf(HasSubstr("space.bin"), HasSubstr("avatar.json says"), HasSubstr("again")));
}

TEST_F(BrokenAvatar, FilesOfTwoAvatars) {
  ASSERT_TRUE(WriteAvatar(folder_ / "other.avatar", About(), SmallAvatar(5)).ok());
  std::filesystem::copy_file(folder_ / "other.avatar/space.bin", path_ + "/space.bin",
                             std::filesystem::copy_options::overwrite_existing);
  EXPECT_THAT(WhyNot(), HasSubstr("of two avatars"));
}

TEST_F(BrokenAvatar, NoNumbers) {
  std::filesystem::remove(path_ + "/space.bin");
  EXPECT_THAT(WhyNot(), HasSubstr("space.bin"));
}

class AvatarWithNet : public testing::Test {
 protected:
  void SetUp() override {
    avatar_.net = ShiftNet();
    avatar_.net.atlas.gutter = 5;
    avatar_.net.gain[1] = {40, 3.5, 3.25};
    ASSERT_TRUE(WriteAvatar(path_, About(), avatar_).ok());
  }
  void Append(const std::string& file) { std::ofstream(path_ + "/" + file, std::ios::app) << 'x'; }
  std::string WhyNot() { return Message(ReadAvatar(path_).status()); }

  TempFolder folder_;
  const std::string path_ = folder_ / "shirt.avatar";
  SparseViewAvatar avatar_ = SmallAvatar();
};

TEST_F(AvatarWithNet, IsKept) {
  const absl::StatusOr<AvatarFile> read = ReadAvatar(path_);
  ASSERT_TRUE(read.ok()) << read.status();
  const AvatarNet& net = read->avatar.net;
  EXPECT_EQ(net.onnx, avatar_.net.onnx);
  EXPECT_EQ(Bytes(path_ + "/net.onnx"), avatar_.net.onnx);
  EXPECT_EQ(net.atlas.gutter, 5);
  EXPECT_EQ(net.sample.values, avatar_.net.sample.values);
  EXPECT_EQ(net.sample_answer.height, 8);
  EXPECT_EQ(net.gain[0].frames, 0);
  EXPECT_EQ(net.gain[1].after_mm, 3.25);
  EXPECT_TRUE(net.IsOfUse());
  EXPECT_EQ(std::distance(std::filesystem::directory_iterator(path_), {}), 4);
  // What driving makes of it differs, so its checksum does.
  EXPECT_NE(ChecksumOfAvatar(read->about), read->about.space_checksum());
  // It goes with the avatar that replaces it.
  ASSERT_TRUE(WriteAvatar(path_, About(), SmallAvatar()).ok());
  EXPECT_EQ(std::distance(std::filesystem::directory_iterator(path_), {}), 2);
  EXPECT_TRUE(ReadAvatar(path_)->avatar.net.empty());
  EXPECT_EQ(ChecksumOfAvatar(ReadAvatar(path_)->about), ReadAvatar(path_)->about.space_checksum());
}

TEST_F(AvatarWithNet, ChangedFiles) {
  for (const char* file : {"net.onnx", "sample.bin"}) {
    SetUp();
    Append(file);
    EXPECT_EQ(ReadAvatar(path_).status().code(), absl::StatusCode::kDataLoss);
    EXPECT_THAT(WhyNot(), AllOf(HasSubstr(file), HasSubstr("avatar.json says"), HasSubstr("again")));
    std::filesystem::remove(path_ + "/" + file);
    EXPECT_THAT(WhyNot(), HasSubstr(file));
  }
}

TEST_F(AvatarWithNet, FilesThatNobodyTellsOf) {
  ASSERT_TRUE(WriteAvatar(folder_ / "plain.avatar", About(), SmallAvatar()).ok());
  std::filesystem::copy_file(folder_ / "plain.avatar/avatar.json", path_ + "/avatar.json",
                             std::filesystem::copy_options::overwrite_existing);
  EXPECT_THAT(WhyNot(), AllOf(HasSubstr("net.onnx"), HasSubstr("tells of no net")));
}

TEST_F(AvatarWithNet, AnswersThatAreNotItsOwn) {
  avatar_.net.sample_answer.values[7] += 0.01f;
  ASSERT_TRUE(WriteAvatar(path_, About(), avatar_).ok());
  EXPECT_THAT(WhyNot(), AllOf(HasSubstr("net.onnx"), HasSubstr("does not answer as it did")));
  EXPECT_TRUE(ReadAvatar(path_, NetReading::kBytesAlone).ok());
  avatar_.net = ShiftNet();
  avatar_.net.onnx = "no net";
  ASSERT_TRUE(WriteAvatar(path_, About(), avatar_).ok());
  EXPECT_THAT(WhyNot(), AllOf(HasSubstr("net.onnx"), HasSubstr("is no net")));
}

TEST(NetSample, EveryTruncationIsSeen) {
  const AvatarNet net = ShiftNet();
  const std::string bytes = EncodeNetSample(net);
  AvatarNet read;
  ASSERT_TRUE(DecodeNetSample(bytes, "sample.bin", &read).ok());
  EXPECT_EQ(EncodeNetSample(read), bytes);
  for (size_t size = 0; size < bytes.size(); size += 3)
    EXPECT_FALSE(DecodeNetSample(bytes.substr(0, size), "sample.bin", &read).ok()) << size;
  EXPECT_FALSE(DecodeNetSample(bytes + '\0', "sample.bin", &read).ok());
}

TEST(NetGain, CountsAllCameras) {
  AvatarNet net;
  EXPECT_FALSE(net.IsOfUse());  // nobody knows
  net.gain[1] = {10, 4, 3};
  net.gain[2] = {10, 2, 2.5};
  EXPECT_TRUE(net.IsOfUse());
  net.gain[3] = {10, 2, 2.5};
  EXPECT_FALSE(net.IsOfUse());
}

TEST(AvatarSpace, EveryTruncationIsSeen) {
  const std::string bytes = EncodeAvatarSpace(TablesOf(SmallAvatar()));
  ASSERT_TRUE(DecodeAvatarSpace(bytes, "space.bin").ok());
  for (size_t size = 0; size < bytes.size(); ++size)
    EXPECT_FALSE(DecodeAvatarSpace(bytes.substr(0, size), "space.bin").ok()) << size;
  EXPECT_FALSE(DecodeAvatarSpace(bytes + '\0', "space.bin").ok());
}

TEST(AvatarSpace, RowsAreExactToAStepOfTheirLargestValue) {
  AvatarTable table{"basis", 2, 3, true, {1000, -0.5f, 0, 1e-6f, 2e-6f, -3e-6f}};
  const auto read = DecodeAvatarSpace(EncodeAvatarSpace({table}), "space.bin");
  ASSERT_TRUE(read.ok()) << read.status();
  ASSERT_EQ(read->size(), 1u);
  for (size_t k = 0; k < 6; ++k)
    EXPECT_NEAR(read->front().values[k], table.values[k], (k < 3 ? 1000 : 3e-6) * 0.501 / 32767);
}

TEST(AvatarFits, NamesBothTemplates) {
  const SparseViewAvatar avatar = SmallAvatar();
  v1::Avatar about = About();
  about.set_board_hash(avatar.board_hash);
  about.set_template_hash(avatar.template_hash);
  Template garment;
  garment.id = "skirt";
  garment.board_hash = avatar.board_hash;
  garment.rest.vertices_mm.resize(4);
  garment.node_of_vertex.resize(4);
  absl::Status status = CheckAvatarFits(about, "shirt.avatar", garment, "skirt/template");
  EXPECT_EQ(status.code(), absl::StatusCode::kFailedPrecondition);
  EXPECT_THAT(Message(status), AllOf(HasSubstr("shirt.avatar"), HasSubstr("skirt/template"),
                                     HasSubstr(avatar.template_hash), HasSubstr(garment.ContentHash())));
  garment.board_hash = "0000000000000000";
  status = CheckAvatarFits(about, "shirt.avatar", garment, "skirt/template");
  EXPECT_THAT(Message(status),
              AllOf(HasSubstr("board with hash fedcba9876543210"), HasSubstr("0000000000000000")));
}

}  // namespace
}  // namespace weft
