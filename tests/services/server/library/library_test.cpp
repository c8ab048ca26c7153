// Items on the disk: uploads that go on, versions, damage, deletion.
#include "services/server/library/library.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <filesystem>

#include "absl/strings/str_cat.h"
#include "base/host_clock.h"
#include "services/work/items/check_item.h"
#include "tests/services/server/library/items_on_disk.h"

namespace weft {
namespace {

using ::testing::HasSubstr;

TEST_F(ItemsOnDisk, AreThereAfterARestart) {
  const auto item = Upload("lab", {{"rig.json", "{}"}, {"more/empty", ""}});
  ASSERT_TRUE(item.ok()) << item.status();
  Restart();
  EXPECT_EQ(FindId("lab"), item->id());
  const auto held = library_->Hold(v1::ITEM_KIND_RIG, "lab");
  ASSERT_TRUE(held.ok()) << held.status();
  EXPECT_EQ(ReadBytes(held->path + "/rig.json"), "{}");
  EXPECT_EQ(CountUploads(), 0u);
}

TEST_F(ItemsOnDisk, HaveVersionsByContent) {
  const std::string first = Upload("lab", {{"rig.json", "1"}}).value().id();
  const std::string second = Upload("lab", {{"rig.json", "2"}}).value().id();
  EXPECT_EQ(Upload("lab", {{"rig.json", "1"}}).value().names_size(), 1);
  EXPECT_EQ(FindId("lab"), second);
  EXPECT_EQ(FindId("lab@1"), first);
  EXPECT_EQ(FindId("sha256:" + first), first);
  EXPECT_THAT(FindId("lab@3"), HasSubstr("lab@1, lab@2"));
  EXPECT_EQ(Upload("hall", {{"rig.json", "1"}}).value().id(), first);
  EXPECT_FALSE(Delete("lab@1").value().content_deleted);
  EXPECT_EQ(FindId("hall"), first);
  EXPECT_TRUE(Delete("hall").value().content_deleted);
  EXPECT_THAT(FindId("hall"), HasSubstr("no rig \"hall\""));
}

TEST_F(ItemsOnDisk, AreReadAsJobsReadThem) {
  Restart(CheckItemContent);
  const absl::Status status = Upload("lab", {{"rig.json", "{\"cameras\": 3}"}}).status();
  EXPECT_EQ(status.code(), absl::StatusCode::kInvalidArgument);
  EXPECT_THAT(std::string(status.message()), HasSubstr("rig.json"));
  EXPECT_THAT(std::string(status.message()), HasSubstr("cameras"));
  EXPECT_EQ(CountUploads(), 0u);
}

TEST_F(ItemsOnDisk, ThatAreDamagedHideNoOther) {
  const std::string good = Upload("good", {{"rig.json", "1"}}).value().id();
  const std::string bad = Upload("bad", {{"rig.json", "2"}}).value().id();
  WriteBytes(folder_ / ("library/rig/" + bad + "/item.json"), "{");
  const auto listing = library_->List(v1::ITEM_KIND_UNSPECIFIED);
  ASSERT_EQ(listing->items.size(), 1u);
  EXPECT_EQ(listing->items[0].id(), good);
  ASSERT_EQ(listing->damaged.size(), 1u);
  EXPECT_THAT(listing->damaged[0], HasSubstr(bad));
  EXPECT_EQ(Upload("bad", {{"rig.json", "2"}}).value().id(), bad);
  std::filesystem::remove(folder_ / ("library/rig/" + bad + "/content/rig.json"));
  EXPECT_EQ(library_->Hold(v1::ITEM_KIND_RIG, "bad").status().code(), absl::StatusCode::kDataLoss);
  EXPECT_EQ(Upload("bad", {{"rig.json", "2"}}).value().id(), bad);
  EXPECT_TRUE(library_->Hold(v1::ITEM_KIND_RIG, "bad").ok());
}

TEST_F(ItemsOnDisk, AreNotDeletedWhileHeld) {
  ASSERT_TRUE(Upload("lab", {{"rig.json", "1"}}).ok());
  auto held = library_->Hold(v1::ITEM_KIND_RIG, "lab");
  EXPECT_EQ(Delete("lab").status().code(), absl::StatusCode::kFailedPrecondition);
  held = absl::UnknownError("");
  EXPECT_TRUE(Delete("lab").ok());
}

// Of {"rig.json": "{}", "more/empty": ""}, by sha256sum.
constexpr char kIdOfTwo[] = "dbe02eefdadef46a826bbc1f3752dadd4f301023fae8256e768e41cc79435185";

TEST_F(ItemsOnDisk, AreDescribedWhole) {
  const int64_t before_ns = HostTime_ns();
  v1::LibraryItem item = Upload("lab", {{"rig.json", "{}"}, {"more/empty", ""}}).value();
  EXPECT_EQ(item.manifest().files_size(), 2);
  item.clear_manifest();
  ASSERT_EQ(item.names_size(), 1);
  EXPECT_GE(item.names(0).created_unix_ns(), before_ns);
  EXPECT_LE(item.names(0).created_unix_ns(), HostTime_ns());
  const auto listed = library_->List(v1::ITEM_KIND_RIG);
  ASSERT_EQ(listed->items.size(), 1u);
  EXPECT_EQ(listed->items[0].DebugString(), item.DebugString());
  item.mutable_names(0)->clear_created_unix_ns();
  EXPECT_EQ(item.ShortDebugString(),
            absl::StrCat("kind: ITEM_KIND_RIG id: \"", kIdOfTwo,
                         "\" names { name: \"lab\" version: 1 } bytes: 2 file_count: 2"));
  std::vector<std::string> files;
  for (const auto& entry :
       std::filesystem::directory_iterator(folder_ / absl::StrCat("library/rig/", kIdOfTwo)))
    files.push_back(entry.path().filename());
  EXPECT_THAT(files, ::testing::UnorderedElementsAre("content", "item.json", "manifest.json"));
  EXPECT_EQ(library_->Hold(v1::ITEM_KIND_RIG, "lab")->path,
            library_->ContentFolder(v1::ITEM_KIND_RIG, kIdOfTwo));
}

TEST(PlaceInList, IsByKindNameVersionAndId) {
  v1::LibraryItem item;
  item.set_kind(v1::ITEM_KIND_BOARD);
  item.set_id("ab");
  EXPECT_EQ(PlaceInList(item), "2  0000000000 ab");
  item.add_names()->set_name("shirt");
  item.mutable_names(0)->set_version(12);
  item.add_names()->set_name("another");
  EXPECT_EQ(PlaceInList(item), "2 shirt 0000000012 ab");
}

TEST_F(ItemsOnDisk, AreListedInOrderWithWhatIsNone) {
  ASSERT_TRUE(Upload("b", {{"rig.json", "1"}}).ok());
  ASSERT_TRUE(Upload("b", {{"rig.json", "2"}}).ok());
  ASSERT_TRUE(Upload("a", {{"rig.json", "3"}}).ok());
  WriteBytes(folder_ / "library/rig/rubbish/file", "");
  const auto listing = library_->List(v1::ITEM_KIND_RIG);
  std::vector<std::string> names;
  for (const v1::LibraryItem& item : listing->items)
    names.push_back(absl::StrCat(item.names(0).name(), "@", item.names(0).version()));
  EXPECT_THAT(names, ::testing::ElementsAre("a@1", "b@1", "b@2"));
  EXPECT_THAT(listing->damaged,
              ::testing::ElementsAre(folder_ / "library/rig/rubbish: is no item; remove it"));
  EXPECT_TRUE(library_->List(v1::ITEM_KIND_BOARD)->items.empty());
  EXPECT_TRUE(library_->List(v1::ITEM_KIND_BOARD)->damaged.empty());
  std::filesystem::remove(folder_ / "library/board");
  EXPECT_EQ(library_->List(v1::ITEM_KIND_UNSPECIFIED).status().code(), absl::StatusCode::kUnavailable);
  EXPECT_TRUE(library_->List(v1::ITEM_KIND_RIG).ok());
}

TEST_F(ItemsOnDisk, AreNamedWhereAnotherIsAskedFor) {
  const auto error_of = [this](const std::string& item) {
    return std::string(library_->Find(v1::ITEM_KIND_RIG, item).status().message());
  };
  EXPECT_EQ(error_of("x"), "the library has no rig \"x\"; it has none yet");
  const std::string id = Upload("r00", {{"rig.json", "0"}})->id();
  std::string names = "r00@1";
  for (int i = 1; i < 20; ++i) {
    const std::string name = absl::StrCat("r", i / 10, i % 10);
    ASSERT_TRUE(library_->AddName(v1::ITEM_KIND_RIG, id, name).ok());
    absl::StrAppend(&names, ", ", name, "@1");
  }
  EXPECT_EQ(error_of("x"), absl::StrCat("the library has no rig \"x\"; it has ", names));
  ASSERT_TRUE(library_->AddName(v1::ITEM_KIND_RIG, id, "r20").ok());
  WriteBytes(folder_ / "library/rig/rubbish", "");
  EXPECT_EQ(error_of("r01@2"), absl::StrCat("the library has no rig \"r01@2\"; it has ", names,
                                            " and 1 more, and damaged ones"));
  const std::string other = "sha256:" + std::string(64, 'a');
  EXPECT_EQ(library_->Find(v1::ITEM_KIND_RIG, other).status().code(), absl::StatusCode::kNotFound);
  EXPECT_EQ(library_->Find(v1::ITEM_KIND_BOARD, "r00").status().code(), absl::StatusCode::kNotFound);
  for (const char* wrong : {"", "a@0", "sha256:x"})
    EXPECT_EQ(library_->Find(v1::ITEM_KIND_RIG, wrong).status().code(), absl::StatusCode::kInvalidArgument);
  EXPECT_EQ(library_->Find(v1::ITEM_KIND_UNSPECIFIED, "r00").status().code(),
            absl::StatusCode::kInvalidArgument);
}

TEST_F(ItemsOnDisk, ThatAreDamagedSayWhere) {
  const std::string id = Upload("lab", {{"rig.json", "12"}})->id(), folder = folder_ / ("library/rig/" + id);
  const std::string remedy = "; delete the item and upload it again";
  const auto error_of = [&] { return library_->Hold(v1::ITEM_KIND_RIG, "sha256:" + id).status(); };
  const auto damage = [&](const std::string& name, const std::string& bytes) {
    const std::string before = ReadBytes(folder + name);
    WriteBytes(folder + name, bytes);
    const absl::Status status = error_of();
    WriteBytes(folder + name, before);
    EXPECT_TRUE(absl::IsDataLoss(status)) << status;
    return std::string(status.message());
  };
  EXPECT_EQ(damage("/content/rig.json", "123"),
            folder + "/content/rig.json: has 3 bytes instead of 2" + remedy);
  EXPECT_EQ(damage("/manifest.json", "{}"), folder + "/manifest.json: does not fit the item's id" + remedy);
  EXPECT_THAT(damage("/manifest.json", "{"), ::testing::StartsWith(folder + "/manifest.json: "));
  const std::string item = ReadBytes(folder + "/item.json");
  const auto changed = [&item](const std::string& from, const std::string& to) {
    std::string text = item;
    EXPECT_NE(text.find(from), std::string::npos) << item;
    return text.replace(text.find(from), from.size(), to);
  };
  const std::string of_another = folder + "/item.json: is of another item" + remedy;
  EXPECT_EQ(damage("/item.json", changed("ITEM_KIND_RIG", "ITEM_KIND_BOARD")), of_another);
  EXPECT_EQ(damage("/item.json", changed(id, std::string(64, 'a'))), of_another);
  EXPECT_THAT(damage("/item.json", changed("lab", "../lab")),
              HasSubstr("item.json: name: \"../lab\" must be"));
  EXPECT_TRUE(error_of().ok());
  std::filesystem::rename(folder + "/content/rig.json", folder_ / "12");
  EXPECT_EQ(error_of().message(), folder + "/content/rig.json: is missing" + remedy);
  std::filesystem::create_directory(folder + "/content/rig.json");
  EXPECT_THAT(std::string(error_of().message()), HasSubstr("bytes instead of 2"));
}

TEST_F(ItemsOnDisk, GetFurtherNames) {
  const std::string first = Upload("lab", {{"rig.json", "1"}})->id(),
                    second = Upload("hall", {{"rig.json", "2"}})->id();
  const auto add = [this](const std::string& id, const std::string& name) {
    return library_->AddName(v1::ITEM_KIND_RIG, id, name);
  };
  EXPECT_EQ(add(first, "lab")->names_size(), 1) << "it has that one";
  EXPECT_EQ(add(second, "lab")->names(1).version(), 2);
  EXPECT_EQ(FindId("lab"), second);
  EXPECT_EQ(FindId("lab@1"), first);
  EXPECT_THAT(ReadBytes(folder_ / ("library/rig/" + second + "/item.json")),
              ::testing::Not(HasSubstr("manifest")));
  std::filesystem::remove(folder_ / ("library/rig/" + first + "/content/rig.json"));
  EXPECT_EQ(add(first, "other").status().code(), absl::StatusCode::kDataLoss);
}

TEST_F(ItemsOnDisk, AreDeletedWithTheirLastName) {
  const std::string id = Upload("lab", {{"rig.json", "1"}})->id();
  ASSERT_TRUE(library_->AddName(v1::ITEM_KIND_RIG, id, "hall").ok());
  const auto refuse = [](const v1::LibraryItem& item) { return absl::AbortedError(item.id()); };
  const auto one_name = library_->Delete(v1::ITEM_KIND_RIG, "lab", refuse);  // not asked
  ASSERT_TRUE(one_name.ok()) << one_name.status();
  EXPECT_FALSE(one_name->content_deleted);
  ASSERT_EQ(one_name->item.names_size(), 1);
  EXPECT_EQ(one_name->item.names(0).name(), "hall");
  EXPECT_EQ(library_->Delete(v1::ITEM_KIND_RIG, "hall", refuse).status(), absl::AbortedError(id));
  EXPECT_EQ(Delete("lab").status().code(), absl::StatusCode::kNotFound);
  {
    const auto held = library_->Hold(v1::ITEM_KIND_RIG, "hall"),
               again = library_->Hold(v1::ITEM_KIND_RIG, "hall");
    EXPECT_EQ(held->hold, again->hold);
    EXPECT_EQ(Delete("hall").status(),
              absl::FailedPreconditionError("item " + id +
                                            ": a job that reads it is being prepared; try again later"));
  }
  ASSERT_TRUE(library_->AddName(v1::ITEM_KIND_RIG, id, "lab").ok());
  const auto all = Delete("sha256:" + id);  // with all its names
  ASSERT_TRUE(all.ok()) << all.status();
  EXPECT_TRUE(all->content_deleted);
  EXPECT_EQ(all->item.names_size(), 2);
  EXPECT_EQ(CountUploads(), 0u);
  EXPECT_FALSE(std::filesystem::exists(folder_ / ("library/rig/" + id)));
}

TEST_F(ItemsOnDisk, ThatAreDamagedAreDeletedByTheirId) {
  const std::string id = Upload("lab", {{"rig.json", "1"}})->id();
  WriteBytes(folder_ / ("library/rig/" + id + "/item.json"), "{");
  EXPECT_EQ(Delete("lab").status().code(), absl::StatusCode::kNotFound);
  EXPECT_TRUE(Delete("sha256:" + id).value().content_deleted);
  EXPECT_TRUE(library_->List(v1::ITEM_KIND_RIG)->damaged.empty());
}

}  // namespace
}  // namespace weft
